"""How far the recorder has come with what is sent to it on a topic, by what it says on /diagnostics."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher

from advise_ros.ros.graph_client import GraphClient
from advise_ros.ros.receivers import counted

MARK_S = 1.0
# Readers of each topic; a writer that has not matched them all would lose what it sends. Positions have any name.
READERS: Mapping[str, frozenset[str]] = {
    'cmd_vel': frozenset({'recorder'}), 'vehicle_status': frozenset({'recorder', 'policy'}),
    'demonstration': frozenset({'recorder', 'advise'}),
}
OF_POSITIONS = frozenset({'recorder', 'policy'})


def is_matched(node: Node, publisher: Publisher, names: frozenset[str]) -> bool:
    """Whether each of these nodes that reads the topic is there, and every reader of it is matched with its publisher."""
    wanted = READERS.get(publisher.topic_name.rsplit('/', 1)[-1], OF_POSITIONS) & names
    readers = node.get_subscriptions_info_by_topic(publisher.topic_name)
    return wanted <= {one.node_name for one in readers} and publisher.get_subscription_count() >= len(readers)


class RecorderProgress:
    """Which positions or commands the recorder has received, by its own report: nothing else shows it.

    A mark is a message in a frame that is nowhere: the recorder refuses it and says so, and what was sent before it on
    the same topic it has had by then, or, where that is best effort, never will.

    Args:
        publisher: of the topic.
        kind: class of its messages.
        topic: its full name.
    """

    def __init__(self, client: GraphClient, publisher: Any, kind: type[Any], topic: str) -> None:
        self._client, self._publisher, self._kind, self._topic = client, publisher, kind, topic
        self._marks, self._marked_s = 0, 0.0
        self._sent = self._before = 0

    def sent(self) -> None:
        """A message went out."""
        self._sent += 1

    @property
    def missing(self) -> int:
        """Messages that the recorder has not reported yet, lost ones included."""
        return self._sent + self._before - self._count()

    def reset(self) -> None:
        """All that it had by now is not counted any more, and what it had not is lost."""
        self._sent, self._before = 0, self._count()

    def mark(self) -> None:
        """Send a mark, a new one."""
        self._marks += 1
        self._send_mark()

    def reached(self) -> bool:
        """Whether the recorder has reported the last mark; it is sent again every MARK_S."""
        if time.monotonic() - self._marked_s > MARK_S:
            self._send_mark()
        health = self._client.health.get('recorder')
        return health is not None and any(f"'{self._frame}'" in pair.key for pair in health.values)

    @property
    def _frame(self) -> str:
        return f'nowhere on {self._topic} {self._marks}'

    def _send_mark(self) -> None:
        message = self._kind()
        message.header.frame_id = self._frame
        self._publisher.publish(message)
        self.sent()
        self._marked_s = time.monotonic()

    def _count(self) -> int:
        health = self._client.health.get('recorder')
        return counted(health, self._topic) if health else 0

"""One turn of talking to an autopilot without a node: what came in is taken, what is due is sent."""

from __future__ import annotations

import time
from collections.abc import Callable

from advise_ros.mavlink.companion import Companion
from advise_ros.mavlink.link import Link
from advise_ros.mavlink.messages import Message


def exchange(
    link: Link, companion: Companion, take: Callable[[Message, float], None], due: Callable[[float], list[Message]],
) -> None:
    """Serve a link once.

    Args:
        link: started.
        companion: finds the autopilot and keeps its messages coming.
        take: called with each message of the autopilot and when it arrived (steady time).
        due: what is to be sent beside the companion's messages at a steady time.
    """
    for received in link.poll():
        if companion.observe(received.message, received.at_s, received.source):
            link.answer_to(received.source)
            take(received.message, received.at_s)
    now_s = time.monotonic()
    for message in [*companion.step(now_s, link.problem or link.doubt), *due(now_s)]:
        link.send(message)


def serve_until(condition: Callable[[], bool], turn: Callable[[], object], seconds: float, turn_s: float) -> None:
    """Take turns until a condition holds or the time is over.

    Args:
        condition: asked before each turn.
        turn: one of them.
        seconds: of steady time at most.
        turn_s: pause after each.
    """
    end_s = time.monotonic() + seconds
    while not condition() and time.monotonic() < end_s:
        turn()
        time.sleep(turn_s)

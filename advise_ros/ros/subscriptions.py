"""Raw subscriptions to topics by name or pattern, with the quality of service that their publishers offer."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial
from typing import Any, NamedTuple

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

QUEUE_DEPTH = 2000
LATCHED_DEPTH = 10_000

# (topic, type name, CDR bytes, source stamp [ns]).
OnMessage = Callable[[str, str, bytes, int], None]


class _Entry(NamedTuple):
    subscription: Subscription
    type_name: str
    profile: QoSProfile


def message_class(type_name: str) -> type[Any]:
    """The class of 'pkg/msg/Type'.

    Raises:
        ImportError, AttributeError: the package is not installed or lacks the type.
    """
    package, _, name = type_name.split('/')
    found: type[Any] = getattr(importlib.import_module(f'{package}.msg'), name)
    return found


def adapted(offers: Sequence[QoSProfile]) -> QoSProfile:
    """The strongest profile that every one of the publishers satisfies."""
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=LATCHED_DEPTH if latched else QUEUE_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _asks_too_much(wanted: QoSProfile, offers: Sequence[QoSProfile]) -> bool:
    best = adapted(offers)
    return (wanted.reliability == ReliabilityPolicy.RELIABLE != best.reliability) or (
        wanted.durability == DurabilityPolicy.TRANSIENT_LOCAL != best.durability
    )


class RawSubscriptions:
    """Subscribes to known topics at once and to matching ones when their publisher appears.

    Call `refresh` now and then: it finds new topics, and takes up again what a later publisher with a
    weaker profile or another type would not match.
    """

    def __init__(
        self, node: Node, patterns: Sequence[str], known: Mapping[str, tuple[str, QoSProfile]], on_message: OnMessage,
    ) -> None:
        self._node = node
        self._on_message = on_message
        self._entries: dict[str, _Entry] = {}
        self.problems: dict[str, str] = {}
        self._patterns = tuple(_absolute(node, pattern) for pattern in patterns)
        for name, (type_name, profile) in known.items():
            self._subscribe(node.resolve_topic_name(name), type_name, profile)

    def refresh(self) -> None:
        for topic, _ in self._node.get_topic_names_and_types():
            if topic in self._entries or self._matches(topic):
                self._adapt(topic)

    def offers(self, topic: str) -> list[Qos]:
        """What the present publishers of a topic offer, as bags store it."""
        return [_as_recorded(publisher.qos_profile) for publisher in self._node.get_publishers_info_by_topic(topic)]

    def _matches(self, topic: str) -> bool:
        return any(fnmatchcase(topic, pattern) for pattern in self._patterns)

    def _adapt(self, topic: str) -> None:
        publishers = self._node.get_publishers_info_by_topic(topic)
        if not publishers:
            return
        type_name = publishers[0].topic_type
        offers = [publisher.qos_profile for publisher in publishers]
        entry = self._entries.get(topic)
        if entry is not None and entry.type_name == type_name and not _asks_too_much(entry.profile, offers):
            return
        if entry is not None:
            self._node.destroy_subscription(entry.subscription)
        self._subscribe(topic, type_name, adapted(offers))

    def _subscribe(self, topic: str, type_name: str, profile: QoSProfile) -> None:
        try:
            subscription = self._node.create_subscription(
                message_class(type_name), topic, partial(self._received, topic, type_name), profile, raw=True,
            )
        except (ImportError, AttributeError, ValueError):
            self.problems[topic] = f'{topic} is not recorded: its type {type_name} is not installed here'
            return
        self._entries[topic] = _Entry(subscription, type_name, profile)

    def _received(self, topic: str, type_name: str, data: bytes, info: Mapping[str, Any]) -> None:
        self._on_message(topic, type_name, data, info['source_timestamp'])


def _absolute(node: Node, pattern: str) -> str:
    """A pattern in the node's namespace, unless it starts with a slash."""
    return pattern if pattern.startswith('/') else f'{node.get_namespace().rstrip("/")}/{pattern}'


def _as_recorded(profile: QoSProfile) -> Qos:
    return Qos(
        QosHistory(int(profile.history)),
        profile.depth,
        QosReliability(int(profile.reliability)),
        QosDurability(int(profile.durability)),
        _time(profile.deadline),
        _time(profile.lifespan),
        QosLiveliness(int(profile.liveliness)),
        _time(profile.liveliness_lease_duration),
        profile.avoid_ros_namespace_conventions,
    )


def _time(duration: Duration) -> QosTime:
    return QosTime(*divmod(duration.nanoseconds, 1_000_000_000))

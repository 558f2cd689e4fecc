"""Raw subscriptions to topics by name or pattern, with the quality of service that their publishers offer."""

from __future__ import annotations

import importlib
import time
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from itertools import pairwise
from operator import attrgetter
from typing import Any, NamedTuple

from rclpy.callback_groups import CallbackGroup
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

from advise_ros.ros import qos

CLOCK_TOPIC = '/clock'
# Seconds of any topic: a busy machine may leave us without processor time for a while.
QUEUE_DEPTH = 20_000
LATCHED_DEPTH = 10_000

WILDCARDS = frozenset('*?[')


class Arrival(NamedTuple):
    """One message as it came: CDR bytes, the publisher's wall clock and ours [ns]."""

    topic: str
    type_name: str
    data: bytes
    source_ns: int
    received_ns: int


class Polled(CallbackGroup):
    """Keeps its subscriptions out of the executor's wait set: they are drained by `take`.

    An executor in Python spends nine tenths of the cost of a message on waiting for it.
    """

    def can_execute(self, entity: object) -> bool:
        return False

    def beginning_execution(self, entity: object) -> bool:
        return False

    def ending_execution(self, entity: object) -> None:
        """Nothing is ever executed."""


class _Entry(NamedTuple):
    subscription: Subscription
    type_name: str
    profile: QoSProfile


def message_class(type_name: str) -> type[Any]:
    """The class of 'pkg/msg/Type', or of 'pkg/srv/Type_Event': what a service publishes of its calls.

    Raises:
        ImportError, AttributeError, ValueError: the package is not installed or lacks the type.
    """
    package, kind, name = type_name.split('/')
    module = importlib.import_module(f'{package}.{kind}')
    service = name.removesuffix('_Event')
    found: type[Any] = getattr(module, service).Event if kind == 'srv' and service != name else getattr(module, name)
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
    weaker profile or another type would not match. Call `take` often: queues are finite.

    Attributes:
        problems: topic -> why it is not subscribed to, one sentence.
        left_out: topic -> type of what somebody publishes and is not asked for.
    """

    def __init__(
        self, node: Node, patterns: Sequence[str], known: Mapping[str, tuple[str, QoSProfile]], *, clock: bool = False,
    ) -> None:
        """`clock`: take /clock too, whether it matches or not."""
        self._node = node
        self._group = Polled()
        self._entries: dict[str, _Entry] = {}
        self._held: list[Arrival] = []
        self.problems: dict[str, str] = {}
        self.left_out: dict[str, str] = {}
        self._patterns = tuple(_absolute(node, pattern) for pattern in patterns)
        for name, (type_name, profile) in known.items():
            self._subscribe(node.resolve_topic_name(name), type_name, profile)
        if clock:
            self._subscribe(CLOCK_TOPIC, 'rosgraph_msgs/msg/Clock', qos.COMMAND)  # Clocks are not latched.

    def take(self) -> list[Arrival]:
        """What has come since the last call, in the order of its arrival over all topics."""
        begun_ns = time.time_ns()
        found: list[Arrival] = []
        in_order = True
        for topic, entry in self._entries.items():
            new = _drained(topic, entry)
            in_order = in_order and all(a.received_ns <= b.received_ns for a, b in pairwise(new))
            found += new
        ready, self._held = self._held, []
        if not in_order:  # The wall clock was set back: at least each topic keeps its order.
            return ready + found
        # What came while topics were drained may be newer than what is yet to be found on an earlier one.
        for arrival in found:
            (self._held if arrival.received_ns > begun_ns else ready).append(arrival)
        return sorted(ready, key=_received_ns)

    def is_asked_for(self, topic: str) -> bool:
        """A pattern names it."""
        return any(fnmatchcase(topic, pattern) for pattern in self._patterns)

    def refresh(self) -> None:
        for topic, types in self._node.get_topic_names_and_types():
            if topic in self._entries or self.is_asked_for(topic):
                self._adapt(topic)
            elif topic not in self.left_out and self._node.count_publishers(topic):
                self.left_out[topic] = types[0]

    def offers(self, topic: str) -> list[Qos]:
        """What the present publishers of a topic offer, as bags store it; what we ask for when they, or the context, are gone."""
        return [as_recorded(profile) for profile in self._offered(topic) or [self._entries[topic].profile]]

    def _offered(self, topic: str) -> list[QoSProfile]:
        try:
            return [publisher.qos_profile for publisher in self._node.get_publishers_info_by_topic(topic)]
        except RuntimeError:
            if self._node.context.ok():
                raise
            return []

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
            self._held += _drained(topic, entry)
            self._node.destroy_subscription(entry.subscription)
        self._subscribe(topic, type_name, adapted(offers))

    def _subscribe(self, topic: str, type_name: str, profile: QoSProfile) -> None:
        try:
            subscription = self._node.create_subscription(
                message_class(type_name), topic, _never_called, _deep(profile), raw=True, callback_group=self._group,
            )
        except (ImportError, AttributeError, ValueError):
            package = type_name.partition('/')[0]
            self.problems[topic] = f'{topic} is not recorded: its type {type_name} is not installed here; install {package}'
            return
        self._entries[topic] = _Entry(subscription, type_name, profile)


def _deep(profile: QoSProfile) -> QoSProfile:
    """With room for what comes while the machine has no time for us; what is latched has its own depth."""
    if profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
        return profile
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=QUEUE_DEPTH, reliability=profile.reliability, durability=profile.durability,
    )


def _never_called(_: bytes) -> None:
    """The executor does not know of subscriptions that are polled."""


_received_ns = attrgetter('received_ns')


def _drained(topic: str, entry: _Entry) -> list[Arrival]:
    """Everything in a subscription's queue."""
    found = []
    handle, kind, type_name = entry.subscription.handle, entry.subscription.msg_type, entry.type_name
    with handle:
        while (taken := handle.take_message(kind, True)) is not None:
            data, info = taken
            found.append(Arrival(topic, type_name, data, info['source_timestamp'], info['received_timestamp']))
    return found


def _absolute(node: Node, pattern: str) -> str:
    """A pattern in the node's namespace, unless it starts with a slash; a plain name may be remapped."""
    if not WILDCARDS.intersection(pattern):
        return str(node.resolve_topic_name(pattern))
    return pattern if pattern.startswith('/') else f'{node.get_namespace().rstrip("/")}/{pattern}'


def as_recorded(profile: QoSProfile) -> Qos:
    """A profile as bags keep it."""
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

"""What a session decided, without its times and last bits: what two replays are compared by."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from advise_ros.core.demonstrations.samples import PoseSamples

DIGITS = 6
# Type -> the fields of its decisions.
FIELDS: Mapping[str, tuple[str, ...]] = {
    'advise_msgs/msg/Demonstration': ('states', 'actions', 'end_reason'),
    'advise_msgs/msg/Policy': ('version', 'demonstrations', 'log_length', 'greedy'),
    'advise_msgs/msg/AdviceQuery': ('query_id', 'states'),
    'geometry_msgs/msg/TwistStamped': ('twist.linear.x', 'twist.linear.y', 'twist.linear.z', 'twist.angular.z'),
    'advise_msgs/msg/FlightStatus': ('phase', 'state', 'steps', 'next_waypoint'),
}

Decision = dict[str, Any]


def decision(value: Any, type_name: str) -> Decision:
    """The decisions in a message, as JSON knows numbers and lists."""
    return {name: _plain(_field(value, name)) for name in FIELDS[type_name]}


def _field(value: Any, name: str) -> Any:
    for part in name.split('.'):
        value = getattr(value, part)
    return value


def _plain(value: Any) -> Any:
    if hasattr(value, 'tolist'):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    return round(value, DIGITS) + 0.0 if isinstance(value, float) else int(value)


def first_change(new: Decision, old: Decision) -> str:
    """The first field that is not as it was, in words; '' when all are."""
    for name, now in new.items():
        before = old.get(name)
        if now == before:
            continue
        if not isinstance(now, list) or not isinstance(before, list):
            return f'{name} would be {now}, was {before}'
        if len(now) != len(before):
            return f'{name} would have {len(now)} entries, had {len(before)}'
        places = [index for index, (one, other) in enumerate(zip(now, before, strict=True)) if one != other]
        first = places[0]
        more = f' ({len(places)} of {len(now)} differ)' if len(places) > 1 else ''
        return f'{name}[{first}] would be {now[first]}, was {before[first]}{more}'
    return ''


def digest(poses: PoseSamples) -> str:
    """Of the positions that a session was flown by: commands can be compared where they are the same."""
    found = hashlib.sha256(poses.stamps_ns.tobytes())
    found.update(poses.positions_enu_m.tobytes())
    return found.hexdigest()

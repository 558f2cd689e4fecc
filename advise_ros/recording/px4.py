"""Positions in PX4's own messages (px4_msgs, as its uXRCE-DDS client publishes them): NED, microseconds, no header.

Versions of PX4 lay these messages out differently, so the places come from the definition that the bag holds.
CDR: numbers are aligned to their size.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Nodetype

from advise_ros.core.units import MAP_FRAME
from advise_ros.mavlink.frames import enu_rows_from_ned
from advise_ros.recording.blocks import Block, Channel, Integers, gather
from advise_ros.recording.codec import parsed
from advise_ros.recording.columns import ENCAPSULATION, PLAIN_CDR_LITTLE_ENDIAN, Column, Frames

TYPES = ('px4_msgs/msg/VehicleOdometry', 'px4_msgs/msg/VehicleLocalPosition')
TOPICS = ('fmu/out/vehicle_odometry', 'fmu/out/vehicle_local_position', 'fmu/out/vehicle_local_position_v1')
SETPOINT = 'px4_msgs/msg/TrajectorySetpoint'
NS_PER_US = 1000
SIZES = {'bool': 1, 'uint8': 1, 'int8': 1, 'char': 1, 'byte': 1, 'octet': 1, 'uint16': 2, 'int16': 2, 'uint32': 4, 'int32': 4,
         'float32': 4, 'uint64': 8, 'int64': 8, 'float64': 8}
# Field with the frame of a position -> its number of north-east-down; before and since PX4 1.14.
NED = {'local_frame': 0, 'pose_frame': 1}
VALID = ('xy_valid', 'z_valid')


class MessageLayout(NamedTuple):
    """Where the fields of a message lie, from the beginning of its bytes."""

    stamp_at: int
    position_at: tuple[int, int, int]
    frame: tuple[int, int] | None
    valid_at: tuple[int, ...]
    size: int


@lru_cache(16)
def layout(channel: Channel) -> MessageLayout | None:
    """Of a channel whose definition can be read; None where it has no stamp or no position at a fixed place."""
    if not channel.definition:
        return None
    places = _places(parsed(channel.type_name, channel.encoding, channel.definition)[channel.type_name][1])
    whole, single = ('velocity', ('vx', 'vy', 'vz')) if channel.type_name == SETPOINT else ('position', ('x', 'y', 'z'))
    first = places.get(whole)
    at = [first + 4 * axis for axis in range(3)] if first is not None else [places.get(name, 0) for name in single]
    if 'timestamp' not in places or not all(at):
        return None
    frame = next(((places[name], ned) for name, ned in NED.items() if name in places), None)
    valid = tuple(places[name] for name in VALID if name in places)
    size = max(places['timestamp'] + 8, max(at) + 4, *(place + 1 for place in valid))
    return MessageLayout(places['timestamp'], (at[0], at[1], at[2]), frame, valid, size)


# From this size on a VehicleOdometry, a VehicleStatus and a TrajectorySetpoint is of px4_msgs before 1.14.
OLDER_ODOMETRY_BYTES, OLDER_STATUS_BYTES, OLDER_SETPOINT_BYTES = 200, 100, 80


def known_layout(type_name: str, size: int) -> MessageLayout:
    """Of messages that a bag does not define, as px4_msgs 1.13 to 1.18 have them.

    Args:
        type_name: of TYPES, or SETPOINT.
        size: of a message in bytes, by which the versions differ.
    """
    if type_name == SETPOINT:
        at = 32 if size >= OLDER_SETPOINT_BYTES else 24
        return MessageLayout(4, (at, at + 4, at + 8), None, (), at + 12)
    if type_name == TYPES[1]:
        return MessageLayout(4, (24, 28, 32), None, (20, 21), 36)
    return MessageLayout(4, (24, 28, 32), (20, NED['local_frame' if size >= OLDER_ODOMETRY_BYTES else 'pose_frame']), (), 36)


def known_status(size: int) -> str:
    """As known_layout, for VehicleStatus: a definition of the fields that are looked at."""
    if size >= OLDER_STATUS_BYTES:
        return f'uint64 timestamp\nuint8 nav_state\nuint8[15] skipped\nuint8 arming_state\nuint8[{size - 29}] rest\n'
    return (
        f'uint64 timestamp\nuint64[2] others\nuint8 arming_state\nuint8[16] skipped\nuint8 nav_state\nuint8[{size - 46}] rest\n'
    )


def _places(fields: Any) -> Mapping[str, int]:
    """Field -> offset, up to the first that has no fixed size."""
    found: dict[str, int] = {}
    at = 0
    for name, (node, of) in fields:
        (inner, kind), count = of if node == Nodetype.ARRAY else ((node, of), 1)
        size = SIZES.get(kind[0], 0) if inner == Nodetype.BASE else 0
        if not size:
            break
        at += -at % size
        found[name] = ENCAPSULATION + at
        at += size * count
    return found


def read(block: Block, rows: Integers, where: MessageLayout, frames: Frames) -> Column:
    """PX4 messages as positions in the map frame (ENU); what is not valid is not a number.

    Args:
        block: of messages.
        rows: (n,) which of them, in their order.
        where: the fields of the channel's messages.
        frames: takes up the names of their frames.
    """
    data, starts, count = block.data, block.starts[rows], len(rows)
    fits = block.ends[rows] - starts >= where.size
    fits[fits] = gather(data, '<u2', starts[fits]) == PLAIN_CDR_LITTLE_ENDIAN
    rows, starts = rows[fits], starts[fits]
    numbers = np.full(len(rows), frames.number(MAP_FRAME), dtype=np.int64)
    if where.frame is not None:
        at, ned = where.frame
        of = gather(data, 'u1', starts + at)
        for frame in np.unique(of[of != ned]).tolist():
            numbers[of == frame] = frames.number(f'PX4 frame {frame}')
    positions = np.stack([gather(data, '<f4', starts + at) for at in where.position_at], axis=1).astype(np.float64)
    for at in where.valid_at:
        positions[gather(data, 'u1', starts + at) == 0] = np.nan
    stamps_ns: npt.NDArray[np.int64] = (gather(data, '<u8', starts + where.stamp_at) * np.uint64(NS_PER_US)).astype(np.int64)
    return Column(stamps_ns, enu_rows_from_ned(positions), block.log_ns[rows], numbers, count - len(rows), rows)

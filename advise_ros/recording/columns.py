"""Stamps and vectors out of many CDR messages at once, by the fixed places at which they lie.

A stamped message begins with std_msgs/Header; after it, and after a second string where the type has one, come
the three float64 of a position or a velocity. Only the lengths of the strings move them.
CDR: OMG DDSI-RTPS 10 (PLAIN_CDR); numbers are aligned to their size from byte 4 on.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Nodetype

from advise_ros.core.units import MAP_FRAME, NS
from advise_ros.recording.blocks import Block, Channel, Integers, gather
from advise_ros.recording.codec import parsed

# Type -> strings before its first vector; 0: it has no header, and so no stamp.
STRINGS = {
    'geometry_msgs/msg/PoseStamped': 1,
    'geometry_msgs/msg/PoseWithCovarianceStamped': 1,
    'nav_msgs/msg/Odometry': 2,
    'geometry_msgs/msg/TransformStamped': 2,
    'geometry_msgs/msg/TwistStamped': 1,
    'geometry_msgs/msg/Twist': 0,
    'geographic_msgs/msg/GeoPoseStamped': 1,
    'geographic_msgs/msg/GeoPointStamped': 1,
    'sensor_msgs/msg/NavSatFix': 1,
    'mavros_msgs/msg/PositionTarget': 1,
}
# Types with latitude, longitude [deg] and altitude [m] for a vector; of these NAVSAT_FIX has a status (int8, uint16) before it.
ON_EARTH = tuple(name for name in STRINGS if name.startswith(('geographic_msgs', 'sensor_msgs')))
NAVSAT_FIX = 'sensor_msgs/msg/NavSatFix'
# MAVROS's setpoint: the number of a frame (uint8), which parts are to be ignored (uint16), a position, then the velocity.
POSITION_TARGET = 'mavros_msgs/msg/PositionTarget'
# MAV_FRAME LOCAL_NED and LOCAL_OFFSET_NED, which MAVROS takes as east, north, up; POSITION_TARGET_TYPEMASK for vx or vy, and vz.
LOCAL_FRAMES, NO_HORIZONTAL, NO_VERTICAL = (1, 7), 8 | 16, 32
POINT = ('float64 x', 'float64 y', 'float64 z')
COVARIANCE = 'float64[36] covariance'
# These types and what they are made of, as ROS 2 defines them. (rosbags knows them all, but takes long to load.)
DEFINED = {
    'builtin_interfaces/msg/Time': ('int32 sec', 'uint32 nanosec'),
    'std_msgs/msg/Header': ('builtin_interfaces/msg/Time stamp', 'string frame_id'),
    'geometry_msgs/msg/Point': POINT,
    'geometry_msgs/msg/Vector3': POINT,
    'geometry_msgs/msg/Quaternion': (*POINT, 'float64 w'),
    'geometry_msgs/msg/Pose': ('geometry_msgs/msg/Point position', 'geometry_msgs/msg/Quaternion orientation'),
    'geometry_msgs/msg/Twist': ('geometry_msgs/msg/Vector3 linear', 'geometry_msgs/msg/Vector3 angular'),
    'geometry_msgs/msg/PoseWithCovariance': ('geometry_msgs/msg/Pose pose', COVARIANCE),
    'geometry_msgs/msg/TwistWithCovariance': ('geometry_msgs/msg/Twist twist', COVARIANCE),
    'geometry_msgs/msg/PoseStamped': ('std_msgs/msg/Header header', 'geometry_msgs/msg/Pose pose'),
    'geometry_msgs/msg/PoseWithCovarianceStamped': ('std_msgs/msg/Header header', 'geometry_msgs/msg/PoseWithCovariance pose'),
    'geometry_msgs/msg/Transform': ('geometry_msgs/msg/Vector3 translation', 'geometry_msgs/msg/Quaternion rotation'),
    'geometry_msgs/msg/TransformStamped': (
        'std_msgs/msg/Header header', 'string child_frame_id', 'geometry_msgs/msg/Transform transform',
    ),
    'geometry_msgs/msg/TwistStamped': ('std_msgs/msg/Header header', 'geometry_msgs/msg/Twist twist'),
    'geographic_msgs/msg/GeoPoint': ('float64 latitude', 'float64 longitude', 'float64 altitude'),
    'geographic_msgs/msg/GeoPose': ('geographic_msgs/msg/GeoPoint position', 'geometry_msgs/msg/Quaternion orientation'),
    'geographic_msgs/msg/GeoPoseStamped': ('std_msgs/msg/Header header', 'geographic_msgs/msg/GeoPose pose'),
    'geographic_msgs/msg/GeoPointStamped': ('std_msgs/msg/Header header', 'geographic_msgs/msg/GeoPoint position'),
    'sensor_msgs/msg/NavSatStatus': ('int8 status', 'uint16 service'),
    'sensor_msgs/msg/NavSatFix': (
        'std_msgs/msg/Header header', 'sensor_msgs/msg/NavSatStatus status', 'float64 latitude', 'float64 longitude',
        'float64 altitude', 'float64[9] position_covariance', 'uint8 position_covariance_type',
    ),
    'mavros_msgs/msg/PositionTarget': (
        'std_msgs/msg/Header header', 'uint8 coordinate_frame', 'uint16 type_mask', 'geometry_msgs/msg/Point position',
        'geometry_msgs/msg/Vector3 velocity', 'geometry_msgs/msg/Vector3 acceleration_or_force',
        'float32 yaw', 'float32 yaw_rate',
    ),
    'nav_msgs/msg/Odometry': (
        'std_msgs/msg/Header header', 'string child_frame_id', 'geometry_msgs/msg/PoseWithCovariance pose',
        'geometry_msgs/msg/TwistWithCovariance twist',
    ),
}
ENCAPSULATION, SECONDS_AT, NANOSECONDS_AT, LENGTH_AT, STRING_AT = 4, 4, 8, 12, 16
PLAIN_CDR_LITTLE_ENDIAN = 0x0100  # The first two bytes, read as a little-endian number; no ROS 2 writes another.
VECTOR_BYTES = 24
# Names of frames are short; a longer one is damage.
LONGEST_NAME = 256
# When there is no room left, the arrays grow by one row in this many.
GROWTH = 4


class Column(NamedTuple):
    """What the messages of one topic in one block hold.

    Attributes:
        stamps_ns: (m,) of the headers, 0 where they have none.
        vectors: (m, 3).
        log_ns: (m,) when they were recorded.
        frames: (m,) numbers of their frames.
        unfit: messages whose bytes are not of the type; they are left out.
        rows: (m,) where they lie in the block.
    """

    stamps_ns: Integers
    vectors: npt.NDArray[np.float64]
    log_ns: Integers
    frames: Integers
    unfit: int
    rows: Integers


class Frames(dict[str, int]):
    """Names of frames without a slash in front, numbered as they come."""

    def number(self, name: str) -> int:
        return self.setdefault(name.lstrip('/'), len(self))


@cache
def why_unlike(channel: Channel) -> str:
    """Why a channel's definition is not that of ROS 2, '' if it is or if the bag holds none.

    Other types than those in DEFINED are only checked for being readable.
    """
    if not channel.definition:
        return ''
    try:
        types = parsed(channel.type_name, channel.encoding, channel.definition)
    except Exception:  # noqa: BLE001  rosbags lets its parser's errors through
        return f'its definition of {channel.type_name} cannot be read'
    for name, (_, fields) in types.items():
        if name in DEFINED and DEFINED[name] != tuple(f'{_spelt(kind)} {field}' for field, kind in fields):
            return f'its definition of {name} is not that of ROS 2'
    return ''


def _spelt(kind: Any) -> str:
    """The type of a field as messages write it."""
    node, of = kind
    if node == Nodetype.NAME:
        return str(of)
    return str(of[0]) if node == Nodetype.BASE else f'{_spelt(of[0])}[{of[1] or ""}]'


def read(block: Block, rows: Integers, strings: int, frames: Frames, *, kind: str = '') -> Column:
    """The messages at `rows`, in their order.

    Args:
        block: of messages.
        rows: (n,) which of them.
        strings: as in STRINGS, for the type of these messages.
        frames: takes up the names of their frames.
        kind: NAVSAT_FIX, where without a fix the vector is not a number, or POSITION_TARGET, where that is so without a
            velocity; '' for all others.
    """
    data, count = block.data, len(rows)
    starts, sizes = block.starts[rows], block.ends[rows] - block.starts[rows]
    rows, starts, sizes = _only(sizes >= STRING_AT, rows, starts, sizes)
    rows, starts, sizes = _only(gather(data, '<u2', starts) == PLAIN_CDR_LITTLE_ENDIAN, rows, starts, sizes)
    if not strings:
        rows, starts = _only(sizes >= ENCAPSULATION + VECTOR_BYTES, rows, starts)
        nothing = np.zeros(len(rows), dtype=np.int64)
        frame = nothing + frames.number('') if len(rows) else nothing
        return Column(nothing, _vectors(data, starts + ENCAPSULATION), block.log_ns[rows], frame, count - len(rows), rows)
    lengths = gather(data, '<u4', starts + LENGTH_AT).astype(np.int64)
    at, fits = _vectors_at(data, starts, sizes, lengths, strings, kind=kind)
    rows, starts, lengths, at = _only(fits, rows, starts, lengths, at)
    seconds = gather(data, '<i4', starts + SECONDS_AT).astype(np.int64)
    stamps_ns = seconds * NS + gather(data, '<u4', starts + NANOSECONDS_AT)
    vectors = _vectors(data, starts + at)
    if kind == POSITION_TARGET:
        numbers = _aim(data, starts, STRING_AT + lengths, vectors, frames)
    else:
        numbers = _frames_of(data, starts + STRING_AT, lengths, frames)
    if kind == NAVSAT_FIX:
        vectors[gather(data, 'i1', starts + STRING_AT + lengths) < 0] = np.nan
    return Column(stamps_ns, vectors, block.log_ns[rows], numbers, count - len(rows), rows)


def _vectors(data: bytes, at: Integers) -> npt.NDArray[np.float64]:
    vectors = np.empty((len(at), 3))
    for axis in range(3):
        vectors[:, axis] = gather(data, '<f8', at + 8 * axis)
    return vectors


def _only(kept: npt.NDArray[np.bool_], *arrays: Integers) -> tuple[Integers, ...]:
    return arrays if kept.all() else tuple(array[kept] for array in arrays)


def _vectors_at(
    data: bytes, starts: Integers, sizes: Integers, lengths: Integers, strings: int, *, kind: str,
) -> tuple[Integers, npt.NDArray[np.bool_]]:
    """Where the vector of each message lies from its start, and whether it lies inside."""
    at, fits = STRING_AT + lengths, lengths <= LONGEST_NAME
    for _ in range(strings - 1):
        at = _aligned(at, 4)
        fits &= at + 4 <= sizes
        more = gather(data, '<u4', starts + np.where(fits, at, 0)).astype(np.int64)
        at, fits = at + 4 + more, fits & (more <= LONGEST_NAME)
    if kind:
        at = _aligned(at + 1, 2) + 2
    at = _aligned(at, 8)
    if kind == POSITION_TARGET:
        at = at + VECTOR_BYTES
    return at, fits & (at + VECTOR_BYTES <= sizes)


def _aim(data: bytes, starts: Integers, at: Integers, vectors: npt.NDArray[np.float64], frames: Frames) -> Integers:
    """Clears the velocities of POSITION_TARGET that are to be ignored; the numbers of the frames that they are in."""
    masks, of = gather(data, '<u2', starts + _aligned(at + 1, 2)), gather(data, 'u1', starts + at)
    vectors[(masks & NO_VERTICAL) != 0, 2] = 0.0
    vectors[(masks & NO_HORIZONTAL) != 0] = np.nan
    numbers = np.zeros(len(at), dtype=np.int64)
    for frame in np.unique(of).tolist():
        numbers[of == frame] = frames.number(MAP_FRAME if frame in LOCAL_FRAMES else f'MAV_FRAME {frame}')
    return numbers


def _aligned(at: Integers, size: int) -> Integers:
    return at + (ENCAPSULATION - at) % size


def _frames_of(data: bytes, at: Integers, lengths: Integers, frames: Frames) -> Integers:
    """The numbers of the frames whose names lie there; names of one length are looked at together."""
    numbers = np.zeros(len(at), dtype=np.int64)
    for length in np.unique(lengths).tolist():
        same = np.flatnonzero(lengths == length)
        texts = gather(data, f'S{length}', at[same]) if length else np.zeros(len(same), dtype='S1')
        for text in texts[:1] if (texts == texts[0]).all() else np.unique(texts):
            numbers[same[texts == text]] = frames.number(bytes(text).decode('utf-8', 'replace'))
    return numbers


class Growing:
    """Rows of numbers that are added piece by piece; memory stays near that of the result."""

    def __init__(self, kind: npt.DTypeLike, *shape: int) -> None:
        self._rows: npt.NDArray[Any] = np.empty((0, *shape), dtype=kind)
        self._count = 0

    def add(self, rows: npt.NDArray[Any]) -> None:
        after = self._count + len(rows)
        if after > len(self._rows):
            self._resize(after + after // GROWTH)
        self._rows[self._count : after] = rows
        self._count = after

    def whole(self) -> npt.NDArray[Any]:
        """The rows; nothing can be added after."""
        self._resize(self._count)
        return self._rows

    def _resize(self, count: int) -> None:
        # In place: no second copy of what is there.
        self._rows.resize((count, *self._rows.shape[1:]), refcheck=False)

"""MAVLink telemetry logs (.tlog): an 8-byte big-endian time stamp in microseconds, then a frame, and so on.

Frames: https://mavlink.io/en/guide/serialization.html. Messages: https://mavlink.io/en/messages/common.html.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from advise_ros.core.demonstrations.samples import Arrivals, CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.errors import LogError
from advise_ros.core.units import Vector
from advise_ros.mavlink.companion import MACHINES
from advise_ros.mavlink.frames import enu_from_ned
from advise_ros.mavlink.messages import (
    AUTOPILOT_NAMES,
    EXTENDED_SYS_STATE,
    FRAME_LOCAL_NED,
    HEARTBEAT,
    IN_AIR,
    LANDING,
    LOCAL_POSITION_NED,
    MODE_FLAG_ARMED,
    ON_GROUND,
    TAKING_OFF,
    MAVError,
    Message,
    dialect,
)
from advise_ros.recording.frames import STAMP_BYTES, message_id, next_stamped, stamp_us, stamped_length

SET_POSITION_TARGET_LOCAL_NED = int(dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED)
WANTED = frozenset((HEARTBEAT, LOCAL_POSITION_NED, EXTENDED_SYS_STATE, SET_POSITION_TARGET_LOCAL_NED))
IGNORES_VELOCITY = 8 | 16 | 32

ProgressCallback = Callable[[int, int], None]


class Frame(NamedTuple):
    """A sound frame of the log: when it was logged, its bytes with the stamp, and its message if it is a wanted one."""

    stamp_ns: int
    data: bytes
    message: Message | None


class Logged(NamedTuple):
    """A wanted message and when it was logged."""

    stamp_ns: int
    message: Message


@dataclass
class Scan:
    """What is in a log besides the messages asked for."""

    frames: int = 0
    garbage_bytes: int = 0
    cut_bytes: int = 0


def read_tlog(path: str | Path, progress: ProgressCallback | None = None) -> Recording:
    """Positions, velocity setpoints and state of the vehicle in a log, stamped with the log's times.

    The vehicle is the autopilot that sends most positions. Setpoints are those sent to it in frame LOCAL_NED
    with a velocity. Garbage, unknown messages and a last frame that is cut off are skipped and noted.

    Args:
        path: the log.
        progress: called now and then with bytes read and bytes in all.

    Raises:
        LogError: the file can't be read, is empty, no MAVLink log, or has no positions.
    """
    data = _read(Path(path))
    scan = Scan()
    frames = frames_of(data, scan, progress)
    logged = [Logged(frame.stamp_ns, frame.message) for frame in frames if frame.message is not None]
    if not scan.frames:
        raise LogError(
            f'{path} is not a MAVLink telemetry log: no frame in {len(data)} bytes; '
            'name a .tlog as ground stations and mavproxy write it'
        )
    vehicle = _vehicle(logged)
    if vehicle is None:
        raise LogError(
            f'{path} has {scan.frames} MAVLink frames but no position (LOCAL_POSITION_NED); '
            'ask the autopilot for message 32 and record again'
        )
    return _recording(path, logged, vehicle, scan)


def frames_of(data: bytes, scan: Scan, progress: ProgressCallback | None = None) -> Iterator[Frame]:
    """All sound frames of a log, in its order; `scan` is filled on the way."""
    codec = dialect.MAVLink(None)
    at, reported = 0, 0
    while at < len(data):
        length = stamped_length(data, at)
        cut = at + length > len(data)
        good, message = _take(codec, data, at, length) if length and not cut else (False, None)
        if not good:
            at = _resume(data, at, scan, cut=cut)
            continue
        scan.frames += 1
        yield Frame(stamp_us(data, at) * 1000, data[at : at + length], message)
        at += length
        if progress is not None and at - reported > len(data) // 100:
            reported = at
            progress(at, len(data))


def _read(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise LogError(f'{path}: there is no such file; name a .tlog file') from None
    except OSError as problem:
        raise LogError(f'{path} cannot be read ({problem.strerror}); name a .tlog file') from None
    if not data:
        raise LogError(f'{path} is empty; name a log with frames in it')
    return data


# -- frames ----------------------------------------------------------------------------------------
def _take(codec: Any, data: bytes, at: int, length: int) -> tuple[bool, Message | None]:
    """Whether the frame is sound, and its message if it is a wanted one.

    Decoding costs most of the time: a frame that is not needed is believed when another follows it at once.
    """
    after, number = at + length, message_id(data, at + STAMP_BYTES)
    if number not in WANTED and (after == len(data) or stamped_length(data, after)):
        return True, None
    if number not in dialect.mavlink_map:
        return False, None
    try:
        message = codec.decode(bytearray(data[at + STAMP_BYTES : after]))
    except MAVError:
        return False, None
    return True, message if number in WANTED else None


def _resume(data: bytes, at: int, scan: Scan, *, cut: bool) -> int:
    """The next place where a frame may begin; the bytes up to there are of no use."""
    found = next_stamped(data, at + 1)
    after = found if found >= 0 else len(data)
    if after == len(data) and cut:
        scan.cut_bytes = after - at
    else:
        scan.garbage_bytes += after - at
    return after


# -- samples ---------------------------------------------------------------------------------------
def _vehicle(frames: list[Logged]) -> tuple[int, int] | None:
    """System and component that send most positions."""
    senders = Counter(_sender(frame) for frame in frames if frame.message.get_msgId() == LOCAL_POSITION_NED)
    return senders.most_common(1)[0][0] if senders else None


def _sender(frame: Logged) -> tuple[int, int]:
    return frame.message.get_srcSystem(), frame.message.get_srcComponent()


def _recording(path: str | Path, frames: list[Logged], vehicle: tuple[int, int], scan: Scan) -> Recording:
    mine = [_sender(frame) == vehicle for frame in frames]
    kinds = [frame.message.get_msgId() for frame in frames]
    places = [row for row, kind in enumerate(kinds) if kind == LOCAL_POSITION_NED and mine[row]]
    others = {_sender(frame)[0] for frame, kind in zip(frames, kinds, strict=True) if kind == LOCAL_POSITION_NED} - {vehicle[0]}
    setpoints = [row for row, frame in enumerate(frames) if _is_for(frame, vehicle)]
    velocities = [row for row in setpoints if is_velocity(frames[row].message)]
    moved = [(frames[row].stamp_ns, (m.vx, m.vy, m.vz)) for row in velocities for m in [frames[row].message]]
    events, changed = _events([(row, frame) for row, frame in enumerate(frames) if mine[row]])
    return Recording(
        poses=PoseSamples(*_arrays([(frames[row].stamp_ns, (m.x, m.y, m.z)) for row in places for m in [frames[row].message]])),
        commands=CommandSamples(*_arrays(moved)),
        events=events,
        source=str(path),
        notes=_notes(scan, (vehicle[0], others), len(setpoints) - len(velocities)),
        arrivals=Arrivals(*(np.searchsorted(places, np.array(rows, dtype=np.int64)) for rows in (velocities, changed, []))),
    )


def _is_for(frame: Logged, vehicle: tuple[int, int]) -> bool:
    message = frame.message
    return message.get_msgId() == SET_POSITION_TARGET_LOCAL_NED and message.target_system in (0, vehicle[0])


def is_velocity(message: Message) -> bool:
    """A SET_POSITION_TARGET_LOCAL_NED that commands a velocity over ground in north-east-down."""
    return bool(message.coordinate_frame == FRAME_LOCAL_NED and not message.type_mask & IGNORES_VELOCITY)


def _arrays(rows: list[tuple[int, Vector]]) -> tuple[Any, Any]:
    stamps_ns = np.array([stamp_ns for stamp_ns, _ in rows], dtype=np.int64)
    vectors = np.array([enu_from_ned(vector_ned) for _, vector_ned in rows], dtype=np.float64)
    return stamps_ns, vectors.reshape(-1, 3)


def _events(own: list[tuple[int, Logged]]) -> tuple[tuple[VehicleEvent, ...], list[int]]:
    """Changes of armed, in-air and mode, and the rows at which they are; none where the log holds none of them.

    Without heartbeats of the vehicle in the log, being in the air has to mean armed.
    """
    events: list[VehicleEvent] = []
    rows: list[int] = []
    state = VehicleEvent(0, not any(frame.message.get_msgId() == HEARTBEAT for _, frame in own), None)
    for row, (stamp_ns, message) in own:
        if message.get_msgId() == HEARTBEAT:
            state = after_heartbeat(state, message)
        elif message.get_msgId() == EXTENDED_SYS_STATE:
            state = state._replace(in_air=in_air_from(message.landed_state, state.in_air))
        else:
            continue
        if not events or events[-1][1:] != state[1:]:
            events.append(state._replace(stamp_ns=stamp_ns))
            rows.append(row)
    return tuple(events), rows


def after_heartbeat(state: VehicleEvent, message: Message) -> VehicleEvent:
    """The state in a HEARTBEAT of the autopilot; modes of other autopilots than the two have no name."""
    machine = MACHINES.get(message.autopilot)
    number = int(message.custom_mode)
    return state._replace(
        armed=bool(message.base_mode & MODE_FLAG_ARMED),
        mode=machine.modes.get(number, f'mode {number:#x}') if machine else '',
        autopilot=AUTOPILOT_NAMES.get(message.autopilot, ''),
    )


def in_air_from(landed_state: int, before: bool | None) -> bool | None:
    """In the air by MAV_LANDED_STATE; an undefined state changes nothing."""
    if landed_state in (IN_AIR, TAKING_OFF, LANDING):
        return True
    return False if landed_state == ON_GROUND else before


def _notes(scan: Scan, vehicles: tuple[int, set[int]], other_setpoints: int) -> tuple[str, ...]:
    vehicle, others = vehicles
    said = (
        (scan.cut_bytes, f'the last frame is cut off ({scan.cut_bytes} bytes)'),
        (scan.garbage_bytes, f'{scan.garbage_bytes} bytes are no sound frames and were skipped'),
        (others, f'positions of system {vehicle} were taken, those of {", ".join(map(str, sorted(others)))} not'),
        (other_setpoints, f'{other_setpoints} setpoints without a velocity in frame LOCAL_NED were not used'),
    )
    return tuple(note for condition, note in said if condition)

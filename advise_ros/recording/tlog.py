"""MAVLink telemetry logs (.tlog): an 8-byte big-endian time stamp in microseconds, then a frame, and so on.

Frames: https://mavlink.io/en/guide/serialization.html. Messages: https://mavlink.io/en/messages/common.html.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from advise_ros.core.demonstrations.known_states import changes, with_silences
from advise_ros.core.demonstrations.samples import Arrivals, CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.errors import LogError
from advise_ros.core.units import NS, Vector
from advise_ros.mavlink.companion import MACHINES
from advise_ros.mavlink.frames import enu_from_ned, enu_rows_from_ned
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
from advise_ros.recording.telemetry_vehicles import Fixes, TelemetryVehicle, choose_vehicle, vehicles_of, without_echoes

STATE_CONTENTS: Mapping[int, Callable[[Message], Hashable]] = {
    HEARTBEAT: lambda message: (message.base_mode, message.custom_mode),
    EXTENDED_SYS_STATE: lambda message: message.landed_state,
}
NONE = np.empty(0, dtype=np.int64)
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


def read_tlog(path: str | Path, progress: ProgressCallback | None = None, vehicle: str = '') -> Recording:
    """Positions, velocity setpoints and state of one vehicle in a log, stamped with the log's times.

    Setpoints are those sent to it in frame LOCAL_NED with a velocity. What a second link brought again, garbage, unknown
    messages and a last frame that is cut off are skipped and noted.

    Args:
        path: the log.
        progress: called now and then with bytes read and bytes in all.
        vehicle: its system id, with a letter where several share it; '': the one that flies.

    Raises:
        LogError: the file can't be read, is empty, no MAVLink log, or has no positions of that vehicle.
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
    fixes = _fixes(logged)
    if not len(fixes.rows):
        raise LogError(
            f'{path} has {scan.frames} MAVLink frames but no position (LOCAL_POSITION_NED); '
            'ask the autopilot for message 32 and record again'
        )
    vehicles = vehicles_of(fixes)
    chosen = choose_vehicle(path, vehicles, vehicle)
    return _recording(path, logged, chosen, _notes(scan, chosen, [one.name for one in vehicles if one is not chosen]))


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
def _sender(message: Message) -> tuple[int, int]:
    return message.get_srcSystem(), message.get_srcComponent()


def _fixes(logged: list[Logged]) -> Fixes:
    """All positions."""
    rows = [row for row, (_, message) in enumerate(logged) if message.get_msgId() == LOCAL_POSITION_NED]
    of = [logged[row].message for row in rows]
    return Fixes(
        np.array(rows, dtype=np.int64),
        np.array([_sender(message) for message in of], dtype=np.int64).reshape(-1, 2),
        np.array([logged[row].stamp_ns for row in rows], dtype=np.int64),
        np.array([message.time_boot_ms for message in of], dtype=np.int64),
        np.array([(message.x, message.y, message.z) for message in of], dtype=np.float64).reshape(-1, 3),
    )


def _recording(path: str | Path, logged: list[Logged], vehicle: TelemetryVehicle, notes: list[str]) -> Recording:
    """Of vehicles that share a system id only positions are known to be whose they are."""
    places, poses_ns = vehicle.fixes.rows, vehicle.fixes.stamps_ns
    setpoints = [row for row, (_, message) in enumerate(logged) if vehicle.alone and _is_for(message, vehicle.sender)]
    velocities = [row for row in setpoints if is_velocity(logged[row].message)]
    moved = [(logged[row].stamp_ns, (m.vx, m.vy, m.vz)) for row in velocities for m in [logged[row].message]]
    rows = _state_rows(logged, vehicle) if vehicle.alone else []
    arrived = np.searchsorted(places, np.array(rows, dtype=np.int64)).tolist()
    events, changed = changes(*with_silences(_states(logged, rows), arrived, poses_ns))
    if len(setpoints) > len(velocities):
        notes.append(f'{len(setpoints) - len(velocities)} setpoints without a velocity in frame LOCAL_NED were not used')
    return Recording(
        poses=PoseSamples(poses_ns, enu_rows_from_ned(vehicle.fixes.positions_ned_m)),
        commands=CommandSamples(*_arrays(moved)),
        events=events,
        source=f'{path} (positions of vehicle {vehicle.name})',
        notes=tuple(notes),
        arrivals=Arrivals(np.searchsorted(places, np.array(velocities, dtype=np.int64)), changed, NONE),
    )


def _is_for(message: Message, vehicle: tuple[int, int]) -> bool:
    return message.get_msgId() == SET_POSITION_TARGET_LOCAL_NED and message.target_system in (0, vehicle[0])


def _state_rows(logged: list[Logged], vehicle: TelemetryVehicle) -> list[int]:
    """Where the vehicle's own state stands, without what a second link brought again."""
    rows: list[int] = []
    for kind, contents in STATE_CONTENTS.items():
        of_kind = [
            row for row, (_, message) in enumerate(logged)
            if message.get_msgId() == kind and _sender(message) == vehicle.sender
        ]
        said = [(logged[row].stamp_ns, contents(logged[row].message)) for row in of_kind]
        news = without_echoes(said, round(vehicle.lag_s * NS)) if vehicle.repeated else range(len(of_kind))
        rows += [of_kind[index] for index in news]
    return sorted(rows)


def is_velocity(message: Message) -> bool:
    """A SET_POSITION_TARGET_LOCAL_NED that commands a velocity over ground in north-east-down."""
    return bool(message.coordinate_frame == FRAME_LOCAL_NED and not message.type_mask & IGNORES_VELOCITY)


def _arrays(rows: list[tuple[int, Vector]]) -> tuple[Any, Any]:
    stamps_ns = np.array([stamp_ns for stamp_ns, _ in rows], dtype=np.int64)
    vectors = np.array([enu_from_ned(vector_ned) for _, vector_ned in rows], dtype=np.float64)
    return stamps_ns, vectors.reshape(-1, 3)


def _states(logged: list[Logged], rows: list[int]) -> list[VehicleEvent]:
    """Armed, in the air and mode as the message in each row has them.

    Without heartbeats of the vehicle in the log, being in the air has to mean armed.
    """
    state = VehicleEvent(0, not any(logged[row].message.get_msgId() == HEARTBEAT for row in rows), None)
    states = []
    for row in rows:
        stamp_ns, message = logged[row]
        if message.get_msgId() == HEARTBEAT:
            state = after_heartbeat(state, message)
        else:
            state = state._replace(in_air=in_air_from(message.landed_state, state.in_air))
        states.append(state._replace(stamp_ns=stamp_ns))
    return states


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


def _notes(scan: Scan, vehicle: TelemetryVehicle, others: list[str]) -> list[str]:
    others_named, again = ', '.join(others), f'{vehicle.repeated} positions came again, up to {vehicle.lag_s:.1f} s late'
    shared = f'several vehicles send as system {vehicle.sender[0]} and are distinguished by their time since boot'
    said = (
        (scan.cut_bytes, f'the last frame is cut off ({scan.cut_bytes} bytes)'),
        (scan.garbage_bytes, f'{scan.garbage_bytes} bytes are no sound frames and were skipped'),
        (others, f'positions of vehicle {vehicle.name} were taken, those of {others_named} not (--vehicle)'),
        (vehicle.repeated, f'{again}, by a second link to the vehicle; they were not used'),
        (not vehicle.alone, f'{shared}: which of them commands and states belong to is not known, and they were not used'),
    )
    return [note for condition, note in said if condition]

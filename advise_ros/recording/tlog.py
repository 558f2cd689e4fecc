"""MAVLink telemetry logs (.tlog): an 8-byte big-endian time stamp in microseconds, then a frame, and so on.

Frames: https://mavlink.io/en/guide/serialization.html. Messages: https://mavlink.io/en/messages/common.html.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.known_states import changes, with_silences
from advise_ros.core.demonstrations.samples import Arrivals, CommandSamples, PoseSamples, Recording, VehicleEvent
from advise_ros.core.errors import LogError
from advise_ros.core.units import NS
from advise_ros.mavlink.companion import MACHINES
from advise_ros.mavlink.frames import enu_rows_from_ned
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
    Message,
)
from advise_ros.recording.autopilot_log import NO_PLACE
from advise_ros.recording.place import Place
from advise_ros.recording.progress import ProgressCallback
from advise_ros.recording.telemetry_columns import Columns, columns_of
from advise_ros.recording.telemetry_frames import (
    GLOBAL_POSITION_INT,
    SET_POSITION_TARGET_LOCAL_NED,
    Scan,
    frames_of_file,
)
from advise_ros.recording.telemetry_vehicles import Fixes, TelemetryVehicle, choose_vehicle, vehicles_of, without_echoes

NONE = np.empty(0, dtype=np.int64)
IGNORES_VELOCITY = 8 | 16 | 32

# Latitude and longitude in 1e-7 degrees, height in mm.
GLOBAL_UNITS = np.array([1e-7, 1e-7, 1e-3])

Floats = npt.NDArray[np.float64]
Logged = Mapping[int, Columns]


class StateMessage(NamedTuple):
    """A HEARTBEAT (or, with its landed state in the place of the first field, an EXTENDED_SYS_STATE) at its row of the log."""

    row: int
    stamp_ns: int
    kind: int
    base_mode: int
    custom_mode: int = 0
    autopilot: int = 0

    @property
    def landed_state(self) -> int:
        return self.base_mode


def read_tlog(
    path: str | Path, progress: ProgressCallback | None = None, vehicle: str = '', place: Place | None = None,
) -> Recording:
    """Positions, velocity setpoints and state of one vehicle in a log, stamped with the log's times.

    Setpoints are those sent to it in frame LOCAL_NED with a velocity. What a second link brought again, garbage, unknown
    messages and a last frame that is cut off are skipped and noted.

    Args:
        path: the log.
        progress: called now and then with bytes read and bytes in all.
        vehicle: its system id, with a letter where several share it; '': the one that flies.
        place: of the grid on the earth: positions are then those of GLOBAL_POSITION_INT, where the log has it.

    Raises:
        LogError: the file can't be read, is empty, no MAVLink log, or has no positions of that vehicle.
    """
    scan = Scan()
    logged = columns_of(frames_of_file(Path(path), scan, progress), on_earth=place is not None)
    if not scan.frames:
        raise LogError(
            f'{path} is not a MAVLink telemetry log: no frame in {Path(path).stat().st_size} bytes; '
            'name a .tlog as ground stations and mavproxy write it'
        )
    try:
        fixes, said = _fixes(logged, place)
    except LogError as problem:
        raise LogError(f'{path} has {scan.frames} MAVLink frames, but {problem}') from None
    vehicles = vehicles_of(fixes)
    chosen = choose_vehicle(path, vehicles, vehicle)
    others = [one.name for one in vehicles if one is not chosen]
    source = f'{path} (positions of vehicle {chosen.name})' if others else str(path)
    return _recording(source, logged, chosen, place, said + _notes(scan, chosen, others))


# -- samples ---------------------------------------------------------------------------------------
def _fixes(logged: Logged, place: Place | None) -> tuple[Fixes, list[str]]:
    """All positions, and what is to be said about them.

    Raises:
        LogError: there are none.
    """
    local, on_earth = logged[LOCAL_POSITION_NED], logged[GLOBAL_POSITION_INT]
    if place is not None and len(on_earth.rows):
        latitudes, longitudes, heights = (on_earth.values[:, 1:] * GLOBAL_UNITS).T
        return _fixes_of(on_earth, enu_rows_from_ned(place.positions(latitudes, longitudes, heights))), []
    if len(local.rows):
        return _fixes_of(local, local.values[:, 1:]), [NO_PLACE] * (place is not None)
    if len(on_earth.rows):
        raise LogError(
            'they hold places on the earth only (GLOBAL_POSITION_INT), no LOCAL_POSITION_NED; '
            "add the grid's place to the grid file: origin_wgs84: [latitude, longitude]"
        )
    raise LogError('no position (LOCAL_POSITION_NED); ask the autopilot for message 32 and record again')


def _fixes_of(columns: Columns, positions_ned_m: Floats) -> Fixes:
    boot_ms = columns.values[:, 0].astype(np.int64)
    return Fixes(columns.rows, columns.senders.astype(np.int64), columns.stamps_ns, boot_ms, positions_ned_m)


def _recording(source: str, logged: Logged, vehicle: TelemetryVehicle, place: Place | None, notes: list[str]) -> Recording:
    """Of vehicles that share a system id only positions are known to be whose they are."""
    places, poses_ns = vehicle.fixes.rows, vehicle.fixes.stamps_ns
    setpoints = logged[SET_POSITION_TARGET_LOCAL_NED]
    target, frame, mask = setpoints.values[:, :3].astype(np.int64).T
    mine = np.isin(target, (0, vehicle.sender[0])) & vehicle.alone
    moving = mine & (frame == FRAME_LOCAL_NED) & ((mask & IGNORES_VELOCITY) == 0)
    velocities = enu_rows_from_ned(setpoints.values[moving, 3:])
    states = _state_messages(logged, vehicle) if vehicle.alone else []
    arrived = np.searchsorted(places, np.array([one.row for one in states], dtype=np.int64)).tolist()
    events, changed = changes(*with_silences(_states(states), arrived, poses_ns))
    if others := int(mine.sum() - moving.sum()):
        notes.append(f'{others} setpoints without a velocity in frame LOCAL_NED were not used')
    return Recording(
        poses=PoseSamples(poses_ns, enu_rows_from_ned(vehicle.fixes.positions_ned_m)),
        commands=CommandSamples(setpoints.stamps_ns[moving], velocities if place is None else place.turned(velocities)),
        events=events,
        source=source,
        notes=tuple(notes),
        arrivals=Arrivals(np.searchsorted(places, setpoints.rows[moving]), changed, NONE),
    )


def _state_messages(logged: Logged, vehicle: TelemetryVehicle) -> list[StateMessage]:
    """The vehicle's own states, without what a second link brought again."""
    found: list[StateMessage] = []
    for kind in (HEARTBEAT, EXTENDED_SYS_STATE):
        columns = logged[kind]
        mine = np.flatnonzero((columns.senders == vehicle.sender).all(axis=1))
        if not vehicle.repeated:
            mine = mine[_says_more(columns.stamps_ns[mine], columns.values[mine])]
        rows = zip(columns.rows[mine].tolist(), columns.stamps_ns[mine].tolist(), columns.values[mine].tolist(), strict=True)
        of_kind = [StateMessage(row, stamp_ns, kind, *map(int, values)) for row, stamp_ns, values in rows]
        if vehicle.repeated:
            said = [(one.stamp_ns, one[2:]) for one in of_kind]
            of_kind = [of_kind[index] for index in without_echoes(said, round(vehicle.lag_s * NS))]
        found += of_kind
    return sorted(found)


def _says_more(stamps_ns: npt.NDArray[np.int64], values: Floats) -> npt.NDArray[np.bool_]:
    """(n,) the messages that change something, the first of each second and the last before a pause of a second.

    The others say nothing: a pause is a silence only after seconds (known_states.SILENCE_NS), and an autopilot may send its
    state hundreds of thousands of times.
    """
    more = np.ones(len(stamps_ns), dtype=np.bool_)
    seconds, last = stamps_ns // NS, np.append(np.diff(stamps_ns) > NS, True)
    more[1:] = (values[1:] != values[:-1]).any(axis=1) | (seconds[1:] != seconds[:-1]) | last[1:]
    return more


def is_velocity(message: Message) -> bool:
    """A SET_POSITION_TARGET_LOCAL_NED that commands a velocity over ground in north-east-down."""
    return bool(message.coordinate_frame == FRAME_LOCAL_NED and not message.type_mask & IGNORES_VELOCITY)


def _states(messages: list[StateMessage]) -> list[VehicleEvent]:
    """Armed, in the air and mode as each message has them.

    Without heartbeats of the vehicle in the log, being in the air has to mean armed.
    """
    state = VehicleEvent(0, not any(one.kind == HEARTBEAT for one in messages), None)
    states = []
    for one in messages:
        if one.kind == HEARTBEAT:
            state = after_heartbeat(state, one)
        else:
            state = state._replace(in_air=in_air_from(one.landed_state, state.in_air))
        states.append(state._replace(stamp_ns=one.stamp_ns))
    return states


def after_heartbeat(state: VehicleEvent, message: Message | StateMessage) -> VehicleEvent:
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

"""Logs of autopilots made of a recording, as ArduPilot (dataflash) and PX4 (ULog) would have written them."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from advise_ros.core.demonstrations.samples import Recording
from advise_ros.mavlink.ardupilot import MODES
from advise_ros.mavlink.messages import dialect

# Number, struct format and FMT's text, of each type.
TYPES = {
    'FMT': (128, '<BB4s16s64s', 'BBnNZ', 'Type,Length,Name,Format,Columns'),
    'XKF1': (44, '<QBfff', 'QBfff', 'TimeUS,C,PN,PE,PD'),
    'ORGN': (73, '<QBiii', 'QBLLe', 'TimeUS,Type,Lat,Lng,Alt'),
    'POS': (74, '<Qiifff', 'QLLfff', 'TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt'),
    'GUIP': (8, '<QBfffBffffff', 'QBfffbffffff', 'TimeUS,Type,pX,pY,pZ,Terrain,vX,vY,vZ,aX,aY,aZ'),
    'MODE': (120, '<QBBB', 'QMBB', 'TimeUS,Mode,ModeNum,Rsn'),
    'ARM': (186, '<QBIBB', 'QBIBB', 'TimeUS,ArmState,ArmChecks,Forced,Method'),
    'EV': (181, '<QB', 'QB', 'TimeUS,Id'),
}
NUMBERS = {name: number for number, name in MODES.items()}
VELOCITY = 4
Row = tuple[int, bytes]


def dataflash(recording: Recording, *, origin: tuple[float, float] | None = None, core: int = 0) -> bytes:
    """A .BIN with the positions, commands and states of a recording.

    Args:
        recording: what was flown.
        origin: latitude and longitude of the estimator's origin.
        core: of the estimator.
    """
    rows: list[Row] = [
        (stamp, packed('XKF1', stamp, core, north, east, -up))
        for stamp, (east, north, up) in zip(_us(recording.poses.stamps_ns), recording.poses.positions_enu_m.tolist(), strict=True)
    ]
    rows += [
        (stamp, packed('GUIP', stamp, VELOCITY, 0, 0, 0, 0, north, east, up, 0, 0, 0))
        for stamp, (east, north, up)
        in zip(_us(recording.commands.stamps_ns), recording.commands.velocities_enu_m_s.tolist(), strict=True)
    ]
    for event in recording.events:
        stamp = event.stamp_ns // 1000
        mode = NUMBERS.get(event.mode, NUMBERS['GUIDED'])
        rows.append((stamp, packed('MODE', stamp, mode, mode, 1)))
        rows.append((stamp, packed('ARM', stamp, event.armed, 0, 0, 0)))
        rows += [] if event.in_air is None else [(stamp, packed('EV', stamp, 28 if event.in_air else 18))]
    if origin is not None:
        stamp = int(recording.poses.stamps_ns[0]) // 1000
        rows.append((stamp, packed('ORGN', stamp, 0, round(origin[0] * 1e7), round(origin[1] * 1e7), 0)))
    return formats() + b''.join(data for _, data in sorted(rows, key=lambda row: row[0]))


def formats(names: Sequence[str] = tuple(TYPES)) -> bytes:
    """The FMT messages at the beginning of a log."""
    texts = ((TYPES[name], name) for name in names)
    return b''.join(
        packed('FMT', number, 3 + struct.calcsize(layout), name.encode(), kinds.encode(), fields.encode())
        for (number, layout, kinds, fields), name in texts
    )


def packed(name: str, *values: object) -> bytes:
    """A message of a dataflash log."""
    number, layout, *_ = TYPES[name]
    return b'\xa3\x95' + bytes([number]) + struct.pack(layout, *values)


def _us(stamps_ns: np.ndarray) -> list[int]:
    return (stamps_ns // 1000).tolist()


# -- telemetry -------------------------------------------------------------------------------------
def tlog(recording: Recording) -> bytes:
    """A .tlog with the positions, commands and states of a recording.

    Args:
        recording: what was flown.
    """
    codec = dialect.MAVLink(None, 1, 1)
    rows: list[tuple[int, Any]] = []
    for stamp, (east, north, up) in zip(_us(recording.poses.stamps_ns), recording.poses.positions_enu_m.tolist(), strict=True):
        rows.append((stamp, dialect.MAVLink_local_position_ned_message(stamp // 1000 % 2**32, north, east, -up, 0, 0, 0)))
    for stamp, (east, north, up) in zip(
        _us(recording.commands.stamps_ns), recording.commands.velocities_enu_m_s.tolist(), strict=True,
    ):
        rows.append((stamp, dialect.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, 1, 0x5C7, 0, 0, 0, north, east, -up, 0, 0, 0, 0, 0,
        )))
    for event in recording.events:
        stamp = event.stamp_ns // 1000
        rows.append((stamp, dialect.MAVLink_heartbeat_message(2, 3, 128 if event.armed else 0, 4, 4, 3)))
        rows.append((stamp, dialect.MAVLink_extended_sys_state_message(0, 2 if event.in_air else 1)))
    return b''.join(
        stamp.to_bytes(8, 'big') + bytes(message.pack(codec)) for stamp, message in sorted(rows, key=lambda row: row[0])
    )


# -- ULog ------------------------------------------------------------------------------------------
ULOG_TYPES = {
    'vehicle_local_position': (
        ('uint64_t timestamp;double ref_lat;double ref_lon;float x;float y;float z;bool xy_valid;bool z_valid;bool xy_global;'
        'uint8_t[5] _padding0;'), '<Qddfff???',
    ),
    'vehicle_status': ('uint64_t timestamp;uint8_t arming_state;uint8_t nav_state;uint8_t[6] _padding0;', '<QBB'),
    'vehicle_land_detected': ('uint64_t timestamp;bool landed;uint8_t[7] _padding0;', '<Q?'),
    'trajectory_setpoint': (
        ('uint64_t timestamp;float[3] position;float[3] velocity;float[3] acceleration;float yaw;float yawspeed;'
        'uint8_t[4] _padding0;'), '<Q3f3f3fff',
    ),
}  # fmt: skip
NAVIGATION_STATES = {'OFFBOARD': 14, 'LAND': 18, 'LOITER': 4}
NAN3 = (np.nan,) * 3


def ulog(recording: Recording, *, origin: tuple[float, float] = (0.0, 0.0)) -> bytes:
    """A .ulg with the positions, commands and states of a recording.

    Args:
        recording: what was flown.
        origin: latitude and longitude of the local positions' reference.
    """
    head = b'ULog\x01\x12\x35\x01' + struct.pack('<Q', 0) + _message('B', bytes(40))
    for name, (fields, _) in ULOG_TYPES.items():
        head += _message('F', f'{name}:{fields}'.encode())
    for number, name in enumerate(ULOG_TYPES):
        head += _message('A', struct.pack('<BH', 0, number) + name.encode())
    rows = sorted(_rows(recording, origin), key=lambda row: row[0])
    return head + b''.join(data for _, data in rows)


def _rows(recording: Recording, origin: tuple[float, float]) -> Iterator[Row]:
    known = origin != (0.0, 0.0)
    for stamp, (east, north, up) in zip(_us(recording.poses.stamps_ns), recording.poses.positions_enu_m.tolist(), strict=True):
        yield stamp, _data('vehicle_local_position', stamp, *origin, north, east, -up, True, True, known)
    for stamp, (east, north, up) in zip(
        _us(recording.commands.stamps_ns), recording.commands.velocities_enu_m_s.tolist(), strict=True,
    ):
        yield stamp, _data('trajectory_setpoint', stamp, *NAN3, north, east, -up, *NAN3, np.nan, np.nan)
    for event in recording.events:
        stamp = event.stamp_ns // 1000
        yield stamp, _data('vehicle_status', stamp, 1 + event.armed, NAVIGATION_STATES.get(event.mode, 14))
        if event.in_air is not None:
            yield stamp, _data('vehicle_land_detected', stamp, not event.in_air)


def _data(name: str, *values: object) -> bytes:
    number = list(ULOG_TYPES).index(name)
    return _message('D', struct.pack('<H', number) + struct.pack(ULOG_TYPES[name][1], *values))


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack('<HB', len(body), ord(kind)) + body

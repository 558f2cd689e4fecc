"""Telemetry logs, also broken ones."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.mavlink.messages import dialect
from advise_ros.recording import telemetry_frames
from advise_ros.recording.place import Place
from advise_ros.recording.telemetry_frames import Scan, frames_of
from advise_ros.recording.tlog import read_tlog

START_US = 1_700_000_000_000_000
FLAG_ARMED = dialect.MAV_MODE_FLAG_SAFETY_ARMED


def position(north: float, east: float, down: float) -> Any:
    return dialect.MAVLink_local_position_ned_message(0, north, east, down, 0.0, 0.0, 0.0)


def setpoint(velocity_ned: tuple[float, float, float], *, frame: int = 1, mask: int = 0x5C7, target: int = 1) -> Any:
    return dialect.MAVLink_set_position_target_local_ned_message(
        0, target, 1, frame, mask, 0.0, 0.0, 0.0, *velocity_ned, 0.0, 0.0, 0.0, 0.0, 0.0,
    )


def heartbeat(*, armed: bool) -> Any:
    return dialect.MAVLink_heartbeat_message(2, 3, FLAG_ARMED if armed else 0, 4, 4, 3)


def log(entries: Iterable[tuple[Any, tuple[int, int]]], *, v1: bool = False) -> list[bytes]:
    """Stamped frames, one every millisecond."""
    codecs: dict[tuple[int, int], Any] = {}
    frames = []
    for index, (message, sender) in enumerate(entries):
        codec = codecs.setdefault(sender, dialect.MAVLink(None, *sender))
        frames.append((START_US + 1000 * index).to_bytes(8, 'big') + bytes(message.pack(codec, force_mavlink1=v1)))
    return frames


HERE = (47.0, 8.0)
VEHICLE, COMPANION, OTHER = (1, 1), (1, 191), (2, 1)
FLIGHT = [
    (heartbeat(armed=False), VEHICLE),
    (dialect.MAVLink_extended_sys_state_message(0, 1), VEHICLE),
    (heartbeat(armed=True), VEHICLE),
    (heartbeat(armed=False), COMPANION),
    (dialect.MAVLink_extended_sys_state_message(0, 3), VEHICLE),
    (dialect.MAVLink_attitude_message(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), VEHICLE),
    (position(1.0, 2.0, -5.0), VEHICLE),
    (setpoint((0.5, 1.5, -0.25)), COMPANION),
    (position(1.5, 2.5, -5.0), VEHICLE),
    (dialect.MAVLink_extended_sys_state_message(0, 0), VEHICLE),
    (dialect.MAVLink_extended_sys_state_message(0, 1), VEHICLE),
    (heartbeat(armed=False), VEHICLE),
]


def read(tmp_path: Path, data: bytes) -> Recording:
    path = tmp_path / 'flight.tlog'
    path.write_bytes(data)
    return read_tlog(path)


@pytest.mark.parametrize('v1', [False, True])
def test_positions_commands_and_states_come_out_in_enu(tmp_path: Path, v1: bool) -> None:
    found = read(tmp_path, b''.join(log(FLIGHT, v1=v1)))
    assert found.poses.positions_enu_m.tolist() == [[2.0, 1.0, 5.0], [2.5, 1.5, 5.0]]
    assert found.poses.stamps_ns.tolist() == [(START_US + 6000) * 1000, (START_US + 8000) * 1000]
    assert found.commands.velocities_enu_m_s.tolist() == [[1.5, 0.5, 0.25]]
    states = [(False, None), (False, False), (True, False), (True, True), (True, False), (False, False)]
    assert [(event.armed, event.in_air) for event in found.events] == states
    assert {(event.mode, event.autopilot) for event in found.events} == {('GUIDED', 'ardupilot')}
    assert found.notes == ()


def test_only_velocities_for_this_vehicle_in_local_ned_count(tmp_path: Path) -> None:
    entries = [
        (position(0.0, 0.0, -5.0), VEHICLE), (setpoint((1.0, 0.0, 0.0), frame=8), COMPANION),
        (setpoint((1.0, 0.0, 0.0), mask=0xFFF), COMPANION), (setpoint((1.0, 0.0, 0.0), target=2), COMPANION),
        (setpoint((1.0, 0.0, 0.0), target=0), COMPANION),
    ]
    found = read(tmp_path, b''.join(log(entries)))
    assert len(found.commands.stamps_ns) == 1
    assert found.notes == ('2 setpoints without a velocity in frame LOCAL_NED were not used',)


def test_the_vehicle_with_most_positions_is_taken(tmp_path: Path) -> None:
    entries = [(position(float(i), 0.0, -5.0), OTHER if i % 3 else VEHICLE) for i in range(9)]
    found = read(tmp_path, b''.join(log(entries)))
    assert len(found.poses.stamps_ns) == 6 and 'of vehicle 2 were taken, those of 1 not' in found.notes[0]


def test_without_landed_states_the_altitude_has_to_tell(tmp_path: Path) -> None:
    events = read(tmp_path, b''.join(log(FLIGHT[2:4] + FLIGHT[5:9]))).events
    assert events and all(event.in_air is None for event in events)


def on_earth(north: float, east: float, up: float) -> Any:
    """Metres from HERE, by the length of a degree there."""
    latitude, longitude = HERE[0] + north / 111_174.0, HERE[1] + east / 76_056.0
    return dialect.MAVLink_global_position_int_message(
        0, round(latitude * 1e7), round(longitude * 1e7), 400_000, round(up * 1000), 0, 0, 0, 0,
    )


def test_places_on_the_earth_are_positions_where_the_grid_has_its_place(tmp_path: Path) -> None:
    path = tmp_path / 'flight.tlog'
    elsewhere = [(position(100.0, 100.0, -5.0), VEHICLE), (on_earth(1.0, 2.0, 5.0), VEHICLE)]
    path.write_bytes(b''.join(log(FLIGHT[:6] + elsewhere + FLIGHT[7:8])))
    found = read_tlog(path, place=Place(*HERE))
    assert found.poses.positions_enu_m == pytest.approx(np.array([[2.0, 1.0, 5.0]]), abs=0.02)
    turned = read_tlog(path, place=Place(*HERE, heading_deg=90.0))
    assert turned.poses.positions_enu_m == pytest.approx(np.array([[-1.0, 2.0, 5.0]]), abs=0.02)
    assert turned.commands.velocities_enu_m_s.tolist() == [pytest.approx([-0.5, 1.5, 0.25])]
    path.write_bytes(b''.join(log(FLIGHT[:6] + elsewhere[1:])))
    with pytest.raises(LogError, match='to the grid file: origin_wgs84'):
        read_tlog(path)
    path.write_bytes(b''.join(log(FLIGHT)))
    assert 'no place on the earth' in read_tlog(path, place=Place(*HERE)).notes[0]


def test_a_log_is_the_same_whatever_the_windows_it_is_read_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = b''.join(log(FLIGHT * 30)) + b'\xfe\xfd' * 40 + b''.join(log(FLIGHT))
    whole = read(tmp_path, data)
    for size in (1, 301, 997):
        monkeypatch.setattr(telemetry_frames, 'WINDOW', size)
        found = read(tmp_path, data)
        assert (found.poses.stamps_ns == whole.poses.stamps_ns).all() and found.events == whole.events
        assert found.notes == whole.notes and 'bytes are no sound frames' in found.notes[-1]


@pytest.mark.parametrize('garbage', [b'\xfd', b'\xfe\xfd\x00' * 5, bytes(range(256)), b'\x00' * 40])
@pytest.mark.parametrize('where', [0, 3, 6, 7, 12])
def test_garbage_between_frames_costs_nothing_else(tmp_path: Path, garbage: bytes, where: int) -> None:
    frames = log(FLIGHT)
    found = read(tmp_path, b''.join([*frames[:where], garbage, *frames[where:]]))
    whole = read(tmp_path, b''.join(frames))
    assert found.poses.stamps_ns.tolist() == whole.poses.stamps_ns.tolist()
    assert found.events == whole.events and found.notes


def test_unknown_ids_and_wrong_checksums_are_skipped(tmp_path: Path) -> None:
    frames = log(FLIGHT)
    unknown = bytearray(frames[5])
    unknown[8 + 7 : 8 + 10] = (999_999).to_bytes(3, 'little')
    broken = bytearray(frames[6])
    broken[20] ^= 0xFF
    found = read(tmp_path, b''.join([*frames[:6], unknown, broken, *frames[7:]]))
    assert len(found.poses.stamps_ns) == 1 and 'no sound frames' in found.notes[0]


def test_a_log_may_be_cut_off_anywhere(tmp_path: Path) -> None:
    frames = log(FLIGHT)
    data = b''.join(frames)
    for length in range(len(b''.join(frames[:7])), len(data)):
        found = read(tmp_path, data[:length])
        assert 1 <= len(found.poses.stamps_ns) <= 2
    assert read(tmp_path, data[:-3]).notes == (f'the last frame is cut off ({len(frames[-1]) - 3} bytes)',)


def test_every_sound_frame_can_be_copied() -> None:
    frames = log(FLIGHT)
    assert [frame.data for frame in frames_of(b''.join(frames), Scan())] == frames


@pytest.mark.parametrize(
    ('data', 'expected'),
    [
        (b'', 'is empty'),
        (b'# A readme\n' * 100, 'is not a MAVLink telemetry log'),
        (bytes(4000), 'is not a MAVLink telemetry log'),
        (b''.join(log(FLIGHT[:3])), 'has 3 MAVLink frames, but no position'),
    ],
)
def test_logs_of_no_use_are_refused_with_a_remedy(tmp_path: Path, data: bytes, expected: str) -> None:
    with pytest.raises(LogError, match=expected):
        read(tmp_path, data)


def test_a_stream_without_stamps_is_no_log(tmp_path: Path) -> None:
    with pytest.raises(LogError):
        read(tmp_path, b''.join(frame[8:] for frame in log(FLIGHT)))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(LogError, match='there is no such file'):
        read_tlog(tmp_path / 'none.tlog')
    with pytest.raises(LogError, match='cannot be read'):
        read_tlog(tmp_path)


def test_progress_ends_near_the_end(tmp_path: Path) -> None:
    path = tmp_path / 'flight.tlog'
    path.write_bytes(b''.join(log(FLIGHT * 20)))
    seen: list[tuple[int, int]] = []
    read_tlog(path, lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen) and seen[-1][0] > 0.98 * seen[-1][1]

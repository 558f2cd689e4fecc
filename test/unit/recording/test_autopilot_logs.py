"""The logs that autopilots write themselves: ArduPilot's (dataflash, also as text) and PX4's (ULog)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink import DFReader
from pyulog import ULog

from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.demonstrations.samples import Recording
from advise_ros.core.errors import LogError
from advise_ros.recording.place import Place
from advise_ros.recording.sources import read_recording
from support.flown import GRID, flight, round_trip
from support.logs import dataflash, formats, packed, ulog

FLOWN = flight(GRID, round_trip())
MAKERS = {'flight.BIN': dataflash, 'flight.ulg': ulog}
# Somewhere, and 30 m east and 20 m north of it.
HERE, THERE, AWAY_M = (47.3977, 8.5456), (47.39787987, 8.54599743), (30.0, 20.0, 0.0)


def actions(recording: Recording) -> list[tuple[int, ...]]:
    return [one.actions for one in demonstrations_of(GRID, recording, DiscretiseSettings()).demonstrations]


RIGHT = actions(FLOWN)


def written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


@pytest.mark.parametrize('name', MAKERS)
def test_a_log_gives_the_demonstrations_that_were_flown(tmp_path: Path, name: str) -> None:
    found = read_recording(written(tmp_path / 'renamed.log', MAKERS[name](FLOWN)))
    assert RIGHT and actions(found) == RIGHT
    assert np.allclose(found.poses.positions_enu_m, FLOWN.poses.positions_enu_m, atol=1e-4)
    assert np.allclose(found.commands.velocities_enu_m_s, FLOWN.commands.velocities_enu_m_s, atol=1e-6)
    assert {event.autopilot for event in found.events} == {'ardupilot' if name.endswith('BIN') else 'px4'} and found.notes == ()


def test_pymavlink_reads_the_same_out_of_a_dataflash_log(tmp_path: Path) -> None:
    path = written(tmp_path / 'flight.BIN', dataflash(FLOWN))
    reader, rows = DFReader.DFReader_binary(str(path)), []
    while (message := reader.recv_match(type='XKF1')) is not None:
        rows.append((message.TimeUS * 1000, message.PE, message.PN, -message.PD))
    reader.close()
    found = read_recording(path).poses
    assert rows == [(stamp, *at) for stamp, at in zip(found.stamps_ns.tolist(), found.positions_enu_m.tolist(), strict=True)]


def test_pyulog_reads_the_same_out_of_a_ulog(tmp_path: Path) -> None:
    path = written(tmp_path / 'flight.ulg', ulog(FLOWN))
    data = ULog(str(path)).get_dataset('vehicle_local_position').data
    found = read_recording(path).poses
    assert (data['timestamp'] * 1000 == found.stamps_ns).all()
    assert (np.column_stack([data['y'], data['x'], -data['z']]) == found.positions_enu_m).all()


@pytest.mark.parametrize('name', MAKERS)
def test_the_grids_place_on_the_earth_moves_the_vehicles_origin(tmp_path: Path, name: str) -> None:
    path = written(tmp_path / name, MAKERS[name](FLOWN, origin=THERE))
    found = read_recording(path, place=Place(*HERE))
    assert np.allclose(found.poses.positions_enu_m, FLOWN.poses.positions_enu_m + AWAY_M, atol=0.02)
    turned = read_recording(path, place=Place(*HERE, heading_deg=90.0))
    east, north, up = found.poses.positions_enu_m.T
    assert np.allclose(turned.poses.positions_enu_m, np.column_stack([-north, east, up]), atol=1e-6)
    assert np.allclose(turned.commands.velocities_enu_m_s[:, 1], FLOWN.commands.velocities_enu_m_s[:, 0], atol=1e-5)
    with pytest.raises(LogError, match=r'lie \d+ km from origin_wgs84 \[8.5456, 47.3977\]'):
        read_recording(path, place=Place(*reversed(HERE)))


@pytest.mark.parametrize('name', MAKERS)
def test_a_log_without_a_place_on_the_earth_says_so(tmp_path: Path, name: str) -> None:
    found = read_recording(written(tmp_path / name, MAKERS[name](FLOWN)), place=Place(*HERE))
    assert actions(found) == RIGHT and 'no place on the earth' in found.notes[0]


@pytest.mark.parametrize('core', [0, 1])
def test_the_estimators_primary_core_is_taken(tmp_path: Path, core: int) -> None:
    elsewhere = FLOWN.poses._replace(positions_enu_m=FLOWN.poses.positions_enu_m + 50.0)
    wrong = dataflash(FLOWN._replace(poses=elsewhere, events=()), core=1 - core)
    switch = b'\xa3\x95' + packed('FMT', 47, 12, b'XKF4', b'QB', b'TimeUS,PI')[2:] + b'\xa3\x95\x2f' + bytes(8) + bytes([core])
    found = read_recording(written(tmp_path / 'flight.BIN', formats() + switch + dataflash(FLOWN, core=core) + wrong))
    assert actions(found) == RIGHT and len(found.poses.stamps_ns) == len(FLOWN.poses.stamps_ns)


@pytest.mark.parametrize('garbage', [b'\xa3\x95' * 3, b'\xa3\x95\x2c', bytes(200), bytes(range(256)) * 4])
def test_damage_in_a_dataflash_log_costs_nothing_else(tmp_path: Path, garbage: bytes) -> None:
    data = dataflash(FLOWN)
    at = data.index(packed('XKF1', int(FLOWN.poses.stamps_ns[200]) // 1000, 0, 0, 0, 0)[:11])
    found = read_recording(written(tmp_path / 'flight.BIN', data[:at] + garbage + data[at:]))
    assert len(FLOWN.poses.stamps_ns) - len(found.poses.stamps_ns) <= 2 and actions(found) == RIGHT
    assert 'were skipped' in ' '.join(found.notes)


@pytest.mark.parametrize('name', MAKERS)
def test_a_log_may_be_cut_off_anywhere(tmp_path: Path, name: str) -> None:
    data = MAKERS[name](FLOWN)
    for length in (len(data) - 1, len(data) - 20, len(data) // 2):
        found = read_recording(written(tmp_path / name, data[:length]))
        assert 0 < len(found.poses.stamps_ns) <= len(FLOWN.poses.stamps_ns)


@pytest.mark.parametrize(('data', 'expected'), [
    (b'ULog\x01\x12\x35\x01' + bytes(100), 'has no vehicle_local_position'),
    (b'\xa3\x95\x80' + bytes(100), 'not an ArduPilot log'),
    (formats(), r'no positions \(XKF1'),
    (formats() + packed('POS', 10, 473977000, 85456000, 0, 0, 0), 'origin_wgs84'),
])
def test_logs_of_no_use_are_refused_with_a_remedy(tmp_path: Path, data: bytes, expected: str) -> None:
    with pytest.raises(LogError, match=expected):
        read_recording(written(tmp_path / 'flight.bin', data))


def as_text(path: Path) -> str:
    """A dataflash log as ground stations convert it."""
    reader = DFReader.DFReader_binary(str(path))
    lines = [
        f'FMT, {form.type}, {form.len}, {form.name}, {form.format}, {",".join(form.columns)}' for form in reader.formats.values()
    ]
    while (message := reader.recv_msg()) is not None:
        if message.get_type() != 'FMT':
            values: list[Any] = [getattr(message, name) for name in message.get_fieldnames()]
            lines.append(', '.join([message.get_type(), *map(str, values)]))
    reader.close()
    return '\n'.join(lines)


def test_a_dataflash_log_as_text_is_the_same_log(tmp_path: Path) -> None:
    path = written(tmp_path / 'flight.BIN', dataflash(FLOWN, origin=THERE))
    text = written(tmp_path / 'flight.log', as_text(path).encode())
    for place in (None, Place(*HERE)):
        binary, converted = read_recording(path, place=place), read_recording(text, place=place)
        assert np.allclose(binary.poses.positions_enu_m, converted.poses.positions_enu_m, atol=1e-5)
        assert actions(binary) == actions(converted) and binary.events == converted.events

"""What fly_check says of an autopilot's estimator and GPS, from the messages that real ones sent."""

from __future__ import annotations

import math

import pytest

from advise_ros.mavlink.estimator_check import WINDOW_S, EstimatorWatch
from advise_ros.mavlink.findings import Finding, Level
from advise_ros.mavlink.messages import Message, dialect

# Seen on the real ones: well on the ground, and after the GPS was lost.
WELL = {'ardupilot': 0x33F, 'px4': 0x3FF}
LOST = {'ardupilot': 0x25, 'px4': 0x365}
BOTH = pytest.mark.parametrize('autopilot', ['ardupilot', 'px4'])


def report(autopilot: str, flags: int, position: float = 0.1, compass: float = 0.2) -> Message:
    if autopilot == 'ardupilot':
        return dialect.MAVLink_ekf_status_report_message(flags, 0.1, position, 0.1, compass, 0.0)
    return dialect.MAVLink_estimator_status_message(0, flags, 0.1, position, 0.1, compass, math.nan, math.nan, 0.3, 0.3)


def fix(kind: int = 3, satellites: int = 10, eph: int = 120) -> Message:
    return dialect.MAVLink_gps_raw_int_message(0, kind, 0, 0, 0, eph, 100, 0, 0, satellites)


def found(autopilot: str, *messages: Message) -> list[Finding]:
    watch = EstimatorWatch(autopilot)
    for message in messages:
        watch.observe(message, 1.0)
    return watch.findings()


@BOTH
def test_a_sound_estimator_and_fix_are_right(autopilot: str) -> None:
    findings = found(autopilot, report(autopilot, WELL[autopilot]), fix())
    assert [finding.level for finding in findings] == [Level.RIGHT] * 3
    assert 'worst ratio 0.20 (compass' in findings[1].what
    assert findings[2].what == 'GPS: 3D fix, 10 satellites, HDOP 1.2'


@BOTH
def test_a_lost_position_is_wrong_even_if_only_one_message_says_so(autopilot: str) -> None:
    findings = found(autopilot, *(report(autopilot, flags) for flags in (WELL[autopilot], LOST[autopilot], WELL[autopilot])))
    assert findings[0].level is Level.WRONG
    assert 'it lacks horizontal velocity, horizontal position' in findings[0].what
    assert f'flags {LOST[autopilot]:#x}' in findings[0].what


@pytest.mark.parametrize(('autopilot', 'bit', 'words'), [
    ('ardupilot', 0x8000, 'its GPS glitches'), ('ardupilot', 0x80, 'it holds a constant position'),
    ('ardupilot', 0x400, 'it is not initialised'), ('px4', 0x400, 'its GPS glitches'), ('px4', 0x800, 'its accelerometer is bad'),
])
def test_each_doubt_has_its_name_in_each_dialect(autopilot: str, bit: int, words: str) -> None:
    finding = found(autopilot, report(autopilot, WELL[autopilot] | bit))[0]
    assert finding.level is Level.WRONG
    assert words in finding.what


@pytest.mark.parametrize(('autopilot', 'ratio', 'level'), [
    ('ardupilot', 0.49, Level.RIGHT), ('ardupilot', 0.6, Level.ADVICE), ('ardupilot', 0.8, Level.WRONG),
    ('px4', 0.49, Level.RIGHT), ('px4', 0.9, Level.ADVICE), ('px4', 1.5, Level.WRONG),
])
def test_the_worst_ratio_counts_and_names_its_sensor(autopilot: str, ratio: float, level: Level) -> None:
    finding = found(autopilot, report(autopilot, WELL[autopilot], position=ratio), report(autopilot, WELL[autopilot]))[1]
    assert finding.level is level
    assert f'worst ratio {ratio:.2f} (position;' in finding.what


@BOTH
def test_silence_is_unknown_and_what_is_old_is_forgotten(autopilot: str) -> None:
    watch = EstimatorWatch(autopilot)
    assert [finding.level for finding in watch.findings()] == [Level.UNKNOWN]
    assert len(watch.wanted) == 2
    watch.observe(report(autopilot, 0), 0.0)
    watch.observe(report(autopilot, WELL[autopilot]), WINDOW_S + 0.1)
    assert watch.findings()[0].level is Level.RIGHT
    watch.observe(fix(), WINDOW_S + 0.1)
    assert watch.wanted == []


@pytest.mark.parametrize(('message', 'flags', 'level', 'words'), [
    (fix(kind=1), 0, Level.WRONG, 'no 3D fix (fix type 1)'), (fix(kind=0), 0x33F, Level.ADVICE, 'comes from something else'),
    (fix(satellites=5), 0x33F, Level.ADVICE, '5 satellites'), (fix(eph=300), 0x33F, Level.ADVICE, 'HDOP 3.0'),
    (fix(eph=0xFFFF), 0x33F, Level.RIGHT, 'GPS: 3D fix, 10 satellites'),
])
def test_the_gps_is_judged_by_fix_satellites_and_precision(message: Message, flags: int, level: Level, words: str) -> None:
    finding = found('ardupilot', report('ardupilot', flags), message)[-1]
    assert finding.level is level
    assert words in finding.what

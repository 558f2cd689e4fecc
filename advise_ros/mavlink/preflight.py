"""What is right with an autopilot before a flight, what is not, and how to set it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from typing import NamedTuple

from advise_ros.mavlink.companion import Status


class Level(Enum):
    """How a finding stands."""

    RIGHT = 'right'
    ADVICE = 'advice'
    WRONG = 'WRONG'
    UNKNOWN = 'unknown'


class Finding(NamedTuple):
    """One line of the report."""

    level: Level
    what: str
    remedy: str = ''


class Room(NamedTuple):
    """What the route needs: the furthest corner of our fence from the origin, and its highest altitude, metres."""

    reach_m: float
    high_m: float


Judge = Callable[[float, Room | None], Finding]
RIGHT, ADVICE, WRONG = Level.RIGHT, Level.ADVICE, Level.WRONG


# Setpoints come at 20 Hz; a time-out shorter than this takes a few lost ones for the end of them all.
SHORTEST_TIMEOUT_S = 0.3


def _guid_timeout(value: float, _: Room | None) -> Finding:
    if value < SHORTEST_TIMEOUT_S:
        return Finding(ADVICE, f'it brakes {value:g} s after the last setpoint: at each that is lost', 'set GUID_TIMEOUT to 1')
    if value <= 1.0:
        return Finding(RIGHT, f'it brakes {value:g} s after the last setpoint')
    level = ADVICE if value <= 3.0 else WRONG
    return Finding(level, f'it flies on for {value:g} s after the last setpoint', 'set GUID_TIMEOUT to 1')


def _fs_gcs(value: float, _: Room | None) -> Finding:
    if value:
        return Finding(RIGHT, 'a ground station that falls silent brings it home; the bridge then stops commanding')
    remedy = 'set FS_GCS_ENABLE to 1 (return) or 5 (land) if a ground station is always there'
    return Finding(ADVICE, 'a lost ground station changes nothing', remedy)


def _fence_enable(value: float, _: Room | None) -> Finding:
    return Finding(RIGHT, "the vehicle's own fence is on") if value else Finding(
        WRONG, "the vehicle's own fence is off: nothing holds it when this computer fails", 'set FENCE_ENABLE to 1')


def _fence_action(value: float, _: Room | None) -> Finding:
    return Finding(RIGHT, 'it acts at its fence') if value else Finding(
        WRONG, 'it only reports at its fence', 'set FENCE_ACTION to 1')


def _fence_type(value: float, _: Room | None) -> Finding:
    # Bits: 1 greatest altitude, 2 circle around home, 4 polygons, 8 least altitude.
    lacking = [what for bit, what in ((1, 'an altitude'), (6, 'a circle or polygon')) if not round(value) & bit]
    if lacking:
        return Finding(WRONG, f'its fence lacks {" and ".join(lacking)}', 'set FENCE_TYPE to 7')
    return Finding(RIGHT, 'its fence has an altitude and a circle or polygon')


def _arming_check(value: float, _: Room | None) -> Finding:
    if value == 0.0:
        return Finding(WRONG, 'checks before arming are off', 'set ARMING_CHECK to 1')
    if round(value) & 1:
        return Finding(RIGHT, 'checks before arming are on')
    return Finding(ADVICE, 'only some checks before arming are on', 'set ARMING_CHECK to 1')


def _skipped_checks(value: float, _: Room | None) -> Finding:
    """ArduPilot 4.7 names what is skipped, -1 is all of it."""
    if value == 0.0:
        return Finding(RIGHT, 'all checks before arming are on')
    if value < 0.0:
        return Finding(WRONG, 'checks before arming are off', 'set ARMING_SKIPCHK to 0')
    return Finding(ADVICE, 'some checks before arming are skipped', 'set ARMING_SKIPCHK to 0')


def _at_least(name: str, of: Callable[[Room], float], what: str) -> Judge:
    def judge(value: float, room: Room | None) -> Finding:
        if room is not None and 0.0 < value < of(room):
            return Finding(WRONG, f'its fence ends at {value:g} m, the route needs {of(room):.0f} m', f'set {name} above that')
        return Finding(RIGHT, f'{what} {value:g} m')
    return judge


def _at_least_and_on(name: str, of: Callable[[Room], float], what: str) -> Judge:
    enough = _at_least(name, of, what)

    def judge(value: float, room: Room | None) -> Finding:
        if value > 0.0:
            return enough(value, room)
        wanted = f'{of(room) + 5.0:.0f}' if room is not None else 'what the route needs'
        return Finding(WRONG, f'there is no fence ({what} any)', f'set {name} to {wanted}')
    return judge


def _offboard_loss_time(value: float, _: Room | None) -> Finding:
    said = f'OFFBOARD is left {value:g} s after the last setpoint'
    if value < SHORTEST_TIMEOUT_S:
        return Finding(WRONG, f'{said}: at each that is lost', 'set COM_OF_LOSS_T to 1')
    return Finding(RIGHT, said) if value <= 1.0 else Finding(WRONG, said, 'set COM_OF_LOSS_T to 1')


def _offboard_loss_action(value: float, _: Room | None) -> Finding:
    actions = {4: 'it lands', 5: 'it holds'}
    if value in actions:
        return Finding(RIGHT, f'without setpoints {actions[round(value)]}')
    falls = {6: 'it terminates the flight and falls', 7: 'it disarms and falls'}
    said = falls.get(round(value), 'it returns or sinks')
    return Finding(WRONG, f'without setpoints {said}', 'set COM_OBL_RC_ACT to 5 (hold) or 4 (land)')


def _sticks(value: float, _: Room | None) -> Finding:
    if round(value) & 4:
        return Finding(RIGHT, 'lost sticks do not end OFFBOARD')
    return Finding(ADVICE, 'a joystick that was seen once and is lost ends OFFBOARD', 'set COM_RCL_EXCEPT to 4 if one may appear')


def _data_link(value: float, _: Room | None) -> Finding:
    if value == 0.0:
        return Finding(RIGHT, 'it does not wait for a ground station')
    said = 'it arms and flies only while a ground station is heard (the bridge counts as one)'
    return Finding(ADVICE, said, 'set NAV_DLL_ACT to 0')


def _geofence_action(value: float, _: Room | None) -> Finding:
    remedy = 'set GF_ACTION to 2 (hold), 3 (return) or 5 (land)'
    if value == 4.0:
        return Finding(WRONG, 'it terminates the flight at its fence, and falls', remedy)
    return Finding(RIGHT, 'it acts at its fence') if value >= 2.0 else Finding(
        WRONG, 'it does nothing or only warns at its fence', remedy)


# Name -> judge; those in OPTIONAL are not in every version.
PARAMETERS: Mapping[str, Mapping[str, Judge]] = {
    'ardupilot': {
        'GUID_TIMEOUT': _guid_timeout, 'FS_GCS_ENABLE': _fs_gcs, 'FENCE_ENABLE': _fence_enable, 'FENCE_ACTION': _fence_action,
        'FENCE_RADIUS': _at_least('FENCE_RADIUS', lambda room: room.reach_m, 'its fence has a radius of'),
        'FENCE_ALT_MAX': _at_least('FENCE_ALT_MAX', lambda room: room.high_m, 'its fence has a height of'),
        'FENCE_TYPE': _fence_type, 'ARMING_CHECK': _arming_check, 'ARMING_SKIPCHK': _skipped_checks,
    },
    'px4': {
        'COM_OF_LOSS_T': _offboard_loss_time, 'COM_OBL_RC_ACT': _offboard_loss_action, 'COM_RCL_EXCEPT': _sticks,
        'NAV_DLL_ACT': _data_link, 'GF_ACTION': _geofence_action,
        'GF_MAX_HOR_DIST': _at_least_and_on('GF_MAX_HOR_DIST', lambda room: room.reach_m, 'distance from home'),
        'GF_MAX_VER_DIST': _at_least_and_on('GF_MAX_VER_DIST', lambda room: room.high_m, 'height above home'),
    },
}
OPTIONAL = frozenset({'FENCE_TYPE', 'ARMING_CHECK', 'ARMING_SKIPCHK'})


def parameter_findings(autopilot: str, values: Mapping[str, float], room: Room | None) -> list[Finding]:
    """A finding for each parameter; one that did not come is unknown."""
    found = []
    for name, judge in PARAMETERS[autopilot].items():
        if name in values:
            finding = judge(values[name], room)
            found.append(finding._replace(what=f'{name} = {values[name]:g}: {finding.what}'))
        elif name not in OPTIONAL:
            found.append(Finding(Level.UNKNOWN, f'{name} was not told', 'ask again; another version may name it otherwise'))
    return found


def state_findings(status: Status, texts: list[str]) -> list[Finding]:
    """What the vehicle says of itself."""
    found = [Finding(RIGHT, f'{status.autopilot} multicopter is heard, mode {status.mode}')]
    if status.armed:
        found.append(Finding(WRONG, 'it is armed', 'disarm it before a check'))
    elif status.ready:
        found.append(Finding(RIGHT, 'it is ready to arm'))
    else:
        lacking = f'it is not ready to arm; it waits for: {status.waiting_for}'
        found.append(Finding(WRONG, lacking, 'wait longer (--wait), or mend what it says below'))
    return found + [Finding(ADVICE, f'it says: {text}') for text in texts]

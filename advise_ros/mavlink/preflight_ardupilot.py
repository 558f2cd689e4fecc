"""ArduCopter's parameters before a flight: what is right, what is not, and what to write.

Names and meaning: https://ardupilot.org/copter/docs/parameters.html. Version 4.7 renames some (RTL_ALT in
centimetres is RTL_ALT_M in metres) and turns ARMING_CHECK (what is checked) into ARMING_SKIPCHK (what is not).
"""

from __future__ import annotations

import math

from advise_ros.mavlink.findings import Finding, Room, Values, advice, right, set_to, wrong

# Setpoints come at 20 Hz; a time-out shorter than this takes a few lost ones for the end of them all.
SHORTEST_TIMEOUT_S, GOOD_TIMEOUT_S, LONGEST_TIMEOUT_S = 0.3, 1.0, 3.0
# The vehicle's own fence stands at least so far outside ours.
CLEARANCE_M = 1.0
MARGIN_M = 2.0  # FENCE_MARGIN where it is not known: its default.
ALTITUDE, CIRCLE, POLYGON = 1, 2, 4  # Bits of FENCE_TYPE.

REQUIRED = ('GUID_TIMEOUT', 'FS_GCS_ENABLE', 'FENCE_ENABLE', 'FENCE_ACTION', 'FENCE_RADIUS', 'FENCE_ALT_MAX')
# Not in every version: one name of each row, or none.
ALTERNATIVES = (('FENCE_TYPE',), ('FENCE_MARGIN',), ('ARMING_CHECK', 'ARMING_SKIPCHK'), ('RTL_ALT', 'RTL_ALT_M'))


def judge(values: Values, room: Room | None) -> list[Finding]:
    """A finding for each parameter that is known."""
    judged = (
        _guid_timeout, _fs_gcs, _fence_action, _fence_type, _fence_radius, _fence_altitude, _fence_enable, _return_altitude,
        _arming_check, _skipped_checks,
    )
    return [finding for rule in judged if (finding := rule(values, room)) is not None]


def _guid_timeout(values: Values, room: Room | None) -> Finding | None:
    timeout_s = values.get('GUID_TIMEOUT')
    if timeout_s is None:
        return None
    remedy, change = set_to('GUID_TIMEOUT', GOOD_TIMEOUT_S, 'it brakes soon after the last setpoint')
    if timeout_s < SHORTEST_TIMEOUT_S:
        return advice(f'GUID_TIMEOUT = {timeout_s:g}: it brakes {timeout_s:g} s after the last setpoint: '
                      'at each that is lost', remedy, change)
    if timeout_s <= GOOD_TIMEOUT_S:
        return right(f'GUID_TIMEOUT = {timeout_s:g}: it brakes {timeout_s:g} s after the last setpoint{past(timeout_s, room)}')
    said = f'GUID_TIMEOUT = {timeout_s:g}: it flies on for {timeout_s:g} s after the last setpoint{past(timeout_s, room)}'
    return (advice if timeout_s <= LONGEST_TIMEOUT_S else wrong)(said, remedy, change)


def past(timeout_s: float, room: Room | None) -> str:
    """How far it leaves our fence when this computer dies, as the end of a sentence.

    Args:
        timeout_s: after which the autopilot brakes.
        room: what our fence leaves; None without one.
    """
    if room is None:
        return ''
    return f', up to {room.fly_on_m(timeout_s):.1f} m past our own fence at {room.speed_m_s:g} m/s'


def _fs_gcs(values: Values, _: Room | None) -> Finding | None:
    action = values.get('FS_GCS_ENABLE')
    if action is None:
        return None
    if action:
        return right(f'FS_GCS_ENABLE = {action:g}: a ground station that falls silent brings it home; '
                     'the bridge then stops commanding')
    return advice(f'FS_GCS_ENABLE = {action:g}: a lost ground station changes nothing',
                  'set FS_GCS_ENABLE to 1 (return) or 5 (land) if a ground station is always there')


def _fence_enable(values: Values, _: Room | None) -> Finding | None:
    enabled = values.get('FENCE_ENABLE')
    if enabled is None:
        return None
    if enabled:
        return right(f"FENCE_ENABLE = {enabled:g}: the vehicle's own fence is on")
    return wrong(f"FENCE_ENABLE = {enabled:g}: the vehicle's own fence is off: nothing holds it when this computer fails",
                 *set_to('FENCE_ENABLE', 1.0, 'its own fence holds it when this computer fails'))


def _fence_action(values: Values, _: Room | None) -> Finding | None:
    action = values.get('FENCE_ACTION')
    if action is None:
        return None
    if action:
        return right(f'FENCE_ACTION = {action:g}: it acts at its fence')
    return wrong(f'FENCE_ACTION = {action:g}: it only reports at its fence',
                 *set_to('FENCE_ACTION', 1.0, 'it comes home from its fence', ' (return, or land)'))


def _fence_type(values: Values, _: Room | None) -> Finding | None:
    kind = values.get('FENCE_TYPE')
    if kind is None:
        return None
    bits = round(kind)
    lacking = [what for bit, what in ((ALTITUDE, 'an altitude'), (CIRCLE | POLYGON, 'a circle or polygon')) if not bits & bit]
    if not lacking:
        return right(f'FENCE_TYPE = {kind:g}: its fence has an altitude and a circle or polygon')
    return wrong(f'FENCE_TYPE = {kind:g}: its fence lacks {" and ".join(lacking)}',
                 *set_to('FENCE_TYPE', float(bits | ALTITUDE | CIRCLE | POLYGON), 'its fence has an altitude and a circle'))


def _fence_radius(values: Values, room: Room | None) -> Finding | None:
    return _wide_enough('FENCE_RADIUS', 'radius', values, None if room is None else room.reach_m)


def _fence_altitude(values: Values, room: Room | None) -> Finding | None:
    return _wide_enough('FENCE_ALT_MAX', 'height', values, None if room is None else room.high_m)


def _wide_enough(name: str, what: str, values: Values, ours_m: float | None) -> Finding | None:
    """It already slows down FENCE_MARGIN before its fence."""
    ends_m, margin_m = values.get(name), values.get('FENCE_MARGIN', MARGIN_M)
    if ends_m is None:
        return None
    if ours_m is None or ends_m >= ours_m + margin_m + CLEARANCE_M:
        return right(f'{name} = {ends_m:g}: its fence has a {what} of {ends_m:g} m')
    said = f'{name} = {ends_m:g}: it stops {margin_m:g} m (FENCE_MARGIN) before that, and our own fence ends at {ours_m:.1f} m'
    wide_m = float(math.ceil(ours_m + margin_m + CLEARANCE_M))
    return wrong(said, *set_to(name, wide_m, 'its fence leaves room for ours', ' or more'))


def _return_altitude(values: Values, _: Room | None) -> Finding | None:
    """ArduCopter's return climbs to no more than FENCE_ALT_MAX - FENCE_MARGIN, so no RTL_ALT keeps it from coming home."""
    climb = _climb(values)
    if climb is None:
        return None
    name, value, high_m = climb
    if high_m <= 0.0:
        return right(f'{name} = {value:g}: it returns at the altitude that it has')
    safe_m = values.get('FENCE_ALT_MAX', math.inf) - values.get('FENCE_MARGIN', MARGIN_M)
    if high_m <= safe_m:
        return right(f'{name} = {value:g}: it climbs to {high_m:g} m to return, inside its fence')
    return right(f'{name} = {value:g}: with its fence on it climbs to {safe_m:g} m to return (FENCE_ALT_MAX - FENCE_MARGIN), '
                 f'not to {high_m:g} m')


def _climb(values: Values) -> tuple[str, float, float] | None:
    """Name, value and metres of the altitude of return."""
    for name, metres in (('RTL_ALT_M', 1.0), ('RTL_ALT', 0.01)):
        if name in values:
            return name, values[name], values[name] * metres
    return None


def _arming_check(values: Values, _: Room | None) -> Finding | None:
    checks = values.get('ARMING_CHECK')
    if checks is None:
        return None
    if round(checks) & 1:
        return right(f'ARMING_CHECK = {checks:g}: checks before arming are on')
    remedy, change = set_to('ARMING_CHECK', 1.0, 'it is armed only when all its checks pass')
    if checks == 0.0:
        return wrong('ARMING_CHECK = 0: checks before arming are off', remedy, change)
    return _partly(f'ARMING_CHECK = {checks:g}: only some checks before arming are on', remedy)


def _skipped_checks(values: Values, _: Room | None) -> Finding | None:
    skipped = values.get('ARMING_SKIPCHK')
    if skipped is None:
        return None
    if skipped == 0.0:
        return right('ARMING_SKIPCHK = 0: all checks before arming are on')
    remedy, change = set_to('ARMING_SKIPCHK', 0.0, 'it is armed only when all its checks pass')
    if skipped < 0.0:
        return wrong(f'ARMING_SKIPCHK = {skipped:g}: checks before arming are off', remedy, change)
    return _partly(f'ARMING_SKIPCHK = {skipped:g}: some checks before arming are skipped', remedy)


def _partly(said: str, remedy: str) -> Finding:
    """Which checks are on was chosen by hand and is left so."""
    return advice(said, f'{remedy} unless you know why')

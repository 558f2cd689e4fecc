"""PX4's parameters before a flight: what is right, what is not, and what to write.

Names and meaning: https://docs.px4.io/main/en/advanced_config/parameter_reference. Never written: MPC_XY_VEL_MAX, which
drags MPC_XY_CRUISE and MPC_VEL_MANUAL down with it for good.
"""

from __future__ import annotations

import math

from advise_ros.mavlink.findings import Finding, Room, Values, advice, right, set_to, wrong
from advise_ros.mavlink.preflight_ardupilot import CLEARANCE_M, GOOD_TIMEOUT_S, SHORTEST_TIMEOUT_S, past

# A return that climbs to the fence's ceiling is stopped by it; the climb overshoots by less than this.
BELOW_CEILING_M = 2.0
STICKS_IN_OFFBOARD = 4  # Bit of COM_RCL_EXCEPT.

REQUIRED = (
    'COM_OF_LOSS_T', 'COM_OBL_RC_ACT', 'COM_RCL_EXCEPT', 'NAV_DLL_ACT', 'GF_ACTION', 'GF_MAX_HOR_DIST', 'GF_MAX_VER_DIST',
    'RTL_RETURN_ALT',
)
# Not in every version: one name of each row, or none.
ALTERNATIVES = (('COM_OBL_ACT',),)


def judge(values: Values, room: Room | None) -> list[Finding]:
    """A finding for each parameter that is known."""
    judged = (
        _loss_time, _loss_action, _loss_action_without_sticks, _sticks, _data_link, _fence_action, _distance, _ceiling,
        _return_altitude,
    )
    return [finding for rule in judged if (finding := rule(values, room)) is not None]


def _loss_time(values: Values, room: Room | None) -> Finding | None:
    timeout_s = values.get('COM_OF_LOSS_T')
    if timeout_s is None:
        return None
    said = f'COM_OF_LOSS_T = {timeout_s:g}: OFFBOARD is left {timeout_s:g} s after the last setpoint'
    remedy, change = set_to('COM_OF_LOSS_T', GOOD_TIMEOUT_S, 'it stops soon after the last setpoint')
    if timeout_s < SHORTEST_TIMEOUT_S:
        return wrong(f'{said}: at each that is lost', remedy, change)
    if timeout_s > GOOD_TIMEOUT_S:
        return wrong(said + past(timeout_s, room), remedy, change)
    return right(said + past(timeout_s, room))


def _loss_action(values: Values, _: Room | None) -> Finding | None:
    action = values.get('COM_OBL_RC_ACT')
    if action is None:
        return None
    named = f'COM_OBL_RC_ACT = {action:g}: without setpoints'
    stays = {4: 'it lands', 5: 'it holds'}
    if action in stays:
        return right(f'{named} {stays[round(action)]}')
    falls = {6: 'it terminates the flight and falls', 7: 'it disarms and falls'}
    remedy = set_to('COM_OBL_RC_ACT', 5.0, 'it holds when setpoints end', ' (hold) or 4 (land)')
    return wrong(f'{named} {falls.get(round(action), "it returns or sinks")}', *remedy)


def _loss_action_without_sticks(values: Values, _: Room | None) -> Finding | None:
    """Up to version 1.13 a vehicle without a transmitter went by this one."""
    action = values.get('COM_OBL_ACT')
    if action is None:
        return None
    stays = {0: 'it lands', 1: 'it holds'}
    named = f'COM_OBL_ACT = {action:g}: without setpoints and transmitter'
    if action in stays:
        return right(f'{named} {stays[round(action)]}')
    remedy = set_to('COM_OBL_ACT', 1.0, 'it holds when setpoints end', ' (hold) or 0 (land)')
    return wrong(f'{named} it neither holds nor lands', *remedy)


def _sticks(values: Values, _: Room | None) -> Finding | None:
    except_in = values.get('COM_RCL_EXCEPT')
    if except_in is None:
        return None
    if round(except_in) & STICKS_IN_OFFBOARD:
        return right(f'COM_RCL_EXCEPT = {except_in:g}: lost sticks do not end OFFBOARD')
    wanted = round(except_in) | STICKS_IN_OFFBOARD
    return advice(f'COM_RCL_EXCEPT = {except_in:g}: a joystick that was seen once and is lost ends OFFBOARD',
                  f'set COM_RCL_EXCEPT to {wanted} if one may appear')


def _data_link(values: Values, _: Room | None) -> Finding | None:
    action = values.get('NAV_DLL_ACT')
    if action is None:
        return None
    if action == 0.0:
        return right('NAV_DLL_ACT = 0: it does not wait for a ground station')
    said = f'NAV_DLL_ACT = {action:g}: it arms and flies only while a ground station is there (the bridge counts as one)'
    return advice(said, 'set NAV_DLL_ACT to 0 if none is always there')


def _fence_action(values: Values, _: Room | None) -> Finding | None:
    action = values.get('GF_ACTION')
    if action is None:
        return None
    said = f'GF_ACTION = {action:g}: it'
    remedy = set_to('GF_ACTION', 2.0, 'it holds at its fence', ' (hold), 3 (return) or 5 (land)')
    if action == 4.0:
        return wrong(f'{said} terminates the flight at its fence, and falls', *remedy)
    if action < 2.0:
        return wrong(f'{said} does nothing or only warns at its fence', *remedy)
    return right(f'{said} acts at its fence')


def _distance(values: Values, room: Room | None) -> Finding | None:
    ends_m = values.get('GF_MAX_HOR_DIST')
    if ends_m is None:
        return None
    return _fence('GF_MAX_HOR_DIST', 'distance from home', ends_m, None if room is None else room.reach_m + CLEARANCE_M)


def _ceiling(values: Values, room: Room | None) -> Finding | None:
    """A fence that is put on leaves room for the return as it is set; one that is on stays where it is."""
    ends_m = values.get('GF_MAX_VER_DIST')
    if ends_m is None:
        return None
    least_m = None if room is None else room.high_m + CLEARANCE_M
    if ends_m <= 0.0 and least_m is not None:
        least_m = max(least_m, values.get('RTL_RETURN_ALT', 0.0) + BELOW_CEILING_M)
    return _fence('GF_MAX_VER_DIST', 'height above home', ends_m, least_m)


def _fence(name: str, what: str, ends_m: float, least_m: float | None) -> Finding:
    why = 'its own fence holds it when this computer fails'
    if ends_m <= 0.0:
        said = f'{name} = {ends_m:g}: there is no fence (any {what})'
        if least_m is None:
            return wrong(said, f'set {name} above what the route needs; --grid FILE says how much that is')
        return wrong(said, *set_to(name, float(math.ceil(least_m)), why))
    if least_m is not None and ends_m < least_m:
        said = f'{name} = {ends_m:g}: our own fence, with {CLEARANCE_M:g} m to spare, ends at {least_m:.1f} m'
        return wrong(said, *set_to(name, float(math.ceil(least_m)), 'its fence leaves room for ours', ' or more'))
    return right(f'{name} = {ends_m:g}: its fence ends at that {what}')


def _return_altitude(values: Values, room: Room | None) -> Finding | None:
    """Judged by the ceiling that is there once the other findings are put right."""
    climbs_m = values.get('RTL_RETURN_ALT')
    if climbs_m is None:
        return None
    ceiling = _ceiling(values, room)
    there_m = values.get('GF_MAX_VER_DIST', 0.0)
    ends_m = ceiling.change.value if ceiling is not None and ceiling.change is not None else there_m
    said = f'RTL_RETURN_ALT = {climbs_m:g}: it climbs to {climbs_m:g} m to return'
    if ends_m <= 0.0 or climbs_m <= max(0.0, ends_m - BELOW_CEILING_M):
        return right(f'{said}, inside its fence' if ends_m > 0.0 else said)
    said += f', and its fence (GF_MAX_VER_DIST) stops it at {ends_m:g} m: it never comes home'
    below_m = max(0.0, math.floor(ends_m - BELOW_CEILING_M))
    besides = f', if nothing on its way home is as high, or GF_MAX_VER_DIST to {math.ceil(climbs_m + BELOW_CEILING_M)}'
    return wrong(said, *set_to('RTL_RETURN_ALT', below_m, 'its return stays below the ceiling of its fence', besides))

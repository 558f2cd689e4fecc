"""Which goals are refused as things are, and why: a goal that is refused changes nothing."""

from __future__ import annotations

from typing import NamedTuple

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.requests import Goal
from advise_ros.mavlink.task import GoalTask
from advise_ros.mavlink.vehicle import Vehicle

TAKES_OVER = 'mavlink_bridge/take_over takes it over'
TAKES_OFF = 'mavlink_bridge/takeoff takes off'


class VehicleSituation(NamedTuple):
    """How things are.

    Attributes:
        task: the goal under way.
        vehicle: its facts.
        ours, commandable: whether we own it, and whether setpoints reach it.
        waiting_for: what the goal under way waits for.
        lost: why it is not ours, in words.
        failsafe: that has it, in words, '' if none.
    """

    task: GoalTask
    vehicle: Vehicle
    ours: bool
    commandable: bool
    waiting_for: str
    lost: str
    failsafe: str


def refusal(goal: Goal, now: VehicleSituation) -> str:
    """Why a goal is refused, '' if it can begin."""
    if goal is Goal.TAKEOFF:
        return _of_take_off(now)
    if goal is Goal.TAKE_OVER:
        return _of_take_over(now)
    if goal is Goal.ARM and now.task.goal_is(Goal.TAKEOFF):
        return f'a take-off is under way and arms by itself; it waits for {now.waiting_for}'
    if goal is Goal.DISARM and now.vehicle.armed and now.vehicle.in_air:
        return 'it is in the air; mavlink_bridge/land lands it'
    return ''


def _of_take_off(now: VehicleSituation) -> str:
    vehicle, task = now.vehicle, now.task
    if task.goal_is(Goal.TAKEOFF, Goal.TAKE_OVER):
        return f'a {task.goal} is under way; it waits for {now.waiting_for}'
    if not vehicle.armed:
        return ''
    if vehicle.landed_state == mav.ON_GROUND:
        return f'{now.failsafe}; mavlink_bridge/arm with false disarms it' if now.failsafe else ''
    if not vehicle.in_air:
        return 'it is armed, and has not said yet whether it flies'
    if task.goal_is(Goal.LAND):
        return 'it is landing; mavlink_bridge/take_over ends that'
    return "it flies already, and is this bridge's" if now.ours else f'it flies already: {now.lost}; {TAKES_OVER}'


def _of_take_over(now: VehicleSituation) -> str:
    vehicle, task = now.vehicle, now.task
    if task.goal_is(Goal.TAKEOFF, Goal.TAKE_OVER):
        return f'a {task.goal} is under way; it waits for {now.waiting_for}'
    if not vehicle.armed:
        return f'it is disarmed; {TAKES_OFF}'
    if not vehicle.in_air:
        return f'it does not fly; {TAKES_OFF}'
    return "it is this bridge's already" if now.commandable else ''

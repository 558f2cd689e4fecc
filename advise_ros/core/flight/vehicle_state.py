"""The vehicle as its bridge sees it, and why it takes no commands."""

from __future__ import annotations

from typing import NamedTuple

OTHERS = 'others'


class VehicleState(NamedTuple):
    """The fields of advise_msgs/VehicleStatus that matter for flying it."""

    ready: bool
    armed: bool
    in_air: bool
    commandable: bool
    mode: str = ''
    waiting_for: str = ''
    text: str = ''
    connected: bool = True
    owner: str = ''
    failsafe: str = ''


def why_no_commands(vehicle: VehicleState) -> str:
    """The first reason in words, of a vehicle that is not commandable."""
    if not vehicle.connected:
        return 'the link to it is lost'
    if vehicle.failsafe:
        return f'failsafe {vehicle.failsafe}, mode {vehicle.mode}'
    if not vehicle.armed:
        return 'it is disarmed'
    if vehicle.owner == OTHERS:
        return f'somebody else commands it, mode {vehicle.mode}'
    return vehicle.waiting_for or f'mode {vehicle.mode}'

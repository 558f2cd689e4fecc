"""What a look at an autopilot before a flight has found, and which parameters are to be changed."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import NamedTuple


class Level(Enum):
    """How a finding stands."""

    RIGHT = 'right'
    ADVICE = 'advice'
    WRONG = 'WRONG'
    UNKNOWN = 'unknown'


class Change(NamedTuple):
    """A parameter's recommended value and, in words, what it is good for."""

    name: str
    value: float
    why: str


class Finding(NamedTuple):
    """One line of the report; `change` is what `--apply` writes to put it right."""

    level: Level
    what: str
    remedy: str = ''
    change: Change | None = None


class Room(NamedTuple):
    """What our own fence encloses, and how fast the vehicle is commanded inside it.

    Attributes:
        reach_m: its corner that is farthest from the map's origin.
        high_m: its highest altitude.
        speed_m_s, braking_m_s2: the guard's limit of horizontal speed, and the deceleration it counts on.
    """

    reach_m: float
    high_m: float
    speed_m_s: float = 3.0
    braking_m_s2: float = 2.0

    def fly_on_m(self, timeout_s: float) -> float:
        """How far it flies after the last setpoint at full speed, until it stands [m].

        Args:
            timeout_s: after which the autopilot brakes.
        """
        return self.speed_m_s * timeout_s + self.speed_m_s**2 / (2.0 * self.braking_m_s2)


Values = Mapping[str, float]


def right(what: str) -> Finding:
    """Nothing to do."""
    return Finding(Level.RIGHT, what)


def advice(what: str, remedy: str, change: Change | None = None) -> Finding:
    """It may stay so."""
    return Finding(Level.ADVICE, what, remedy, change)


def wrong(what: str, remedy: str, change: Change | None = None) -> Finding:
    """It must not stay so."""
    return Finding(Level.WRONG, what, remedy, change)


def set_to(name: str, value: float, why: str, besides: str = '') -> tuple[str, Change]:
    """A remedy in words, and as a change.

    Args:
        name: of the parameter.
        value: to be written.
        why: it is wrong now.
        besides: what else helps, '' if nothing.
    """
    return f'set {name} to {value:g}{besides}', Change(name, value, why)

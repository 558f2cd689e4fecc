"""Samples of a flight as arrays: what every source (topics, MAVLink, logs, bags) becomes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class PoseSamples(NamedTuple):
    """Positions in the map frame (ENU), in order of arrival.

    Attributes:
        stamps_ns: (n,) int64, 0 where a sample had none.
        positions_enu_m: (n, 3) float64.
    """

    stamps_ns: npt.NDArray[np.int64]
    positions_enu_m: npt.NDArray[np.float64]


class CommandSamples(NamedTuple):
    """Commanded velocities in the map frame (ENU), in order of arrival.

    Attributes:
        stamps_ns: (m,) int64.
        velocities_enu_m_s: (m, 3) float64.
    """

    stamps_ns: npt.NDArray[np.int64]
    velocities_enu_m_s: npt.NDArray[np.float64]


class VehicleEvent(NamedTuple):
    """The vehicle's state from a stamp on, until the next event."""

    stamp_ns: int
    armed: bool
    in_air: bool


NO_COMMANDS = CommandSamples(np.empty(0, dtype=np.int64), np.empty((0, 3), dtype=np.float64))


class Recording(NamedTuple):
    """What one source holds of one vehicle.

    Attributes:
        events: ascending by stamp; empty when the source does not tell.
        policy_ns: closed intervals of stamps in which a policy flew.
        source: where the samples come from, for people.
        notes: what the source has that could not be used, one sentence each.
    """

    poses: PoseSamples
    commands: CommandSamples = NO_COMMANDS
    events: tuple[VehicleEvent, ...] = ()
    policy_ns: tuple[tuple[int, int], ...] = ()
    source: str = ''
    notes: tuple[str, ...] = ()

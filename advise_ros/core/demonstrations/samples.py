"""Samples of a flight as arrays: what every source (topics, MAVLink, logs, bags) becomes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.flight_modes import Mover, mover

# Stamp of a position whose own stamp cannot be true (see core/demonstrations/timeline.py); 0: it had none.
STRAY_NS = -1
NEVER_NS = int(np.iinfo(np.int64).max)


class PoseSamples(NamedTuple):
    """Positions in the map frame (ENU), in order of arrival.

    Attributes:
        stamps_ns: (n,) int64, 0 where a sample had none, STRAY_NS where it was far from the clock of the others.
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
    """The vehicle's state from a stamp on, until the next event.

    Attributes:
        in_air: None where the source does not say.
        mode, autopilot, owner: as core/demonstrations/flight_modes.py takes them; '' where they are not known.
        connected: False says that nothing else here is known.
    """

    stamp_ns: int
    armed: bool
    in_air: bool | None
    mode: str = ''
    autopilot: str = ''
    owner: str = ''
    connected: bool = True

    @property
    def mover(self) -> Mover:
        """What moves the vehicle from here on."""
        return mover(self.mode, self.autopilot, self.owner)


class PolicyEvent(NamedTuple):
    """From a stamp on a policy flies the vehicle, or no more."""

    stamp_ns: int
    flies: bool


class Arrivals(NamedTuple):
    """How many positions had arrived before each command (m,), vehicle event and policy event, in their order."""

    commands: npt.NDArray[np.int64]
    events: npt.NDArray[np.int64]
    policy: npt.NDArray[np.int64]


NO_COMMANDS = CommandSamples(np.empty(0, dtype=np.int64), np.empty((0, 3), dtype=np.float64))


class Recording(NamedTuple):
    """What one source holds of one vehicle, each kind in order of arrival.

    Attributes:
        events: empty when the source has none.
        policy: when a policy began and ended to fly.
        source: where the samples come from, for people.
        notes: what the source has that could not be used, one sentence each.
        arrivals: how the kinds interleave; None where that is not known: then their stamps decide.
        commanded_ns: stamp of the first command, which may lie before those that are here; 0: before the clock was set
            back; NEVER_NS: see the commands that are here.
    """

    poses: PoseSamples
    commands: CommandSamples = NO_COMMANDS
    events: tuple[VehicleEvent, ...] = ()
    policy: tuple[PolicyEvent, ...] = ()
    source: str = ''
    notes: tuple[str, ...] = ()
    arrivals: Arrivals | None = None
    commanded_ns: int = NEVER_NS

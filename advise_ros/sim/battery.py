"""A battery that lasts for a given flight time."""

from __future__ import annotations

from dataclasses import dataclass, replace

FULL_V, EMPTY_V, SAG_V = 12.6, 10.5, 0.3
FLYING_A, IDLE_A, STANDBY_A = 15.0, 1.5, 0.3


@dataclass(frozen=True)
class SimulatedBattery:
    """What is left, as seconds of flight."""

    full_s: float
    used_s: float = 0.0
    current_a: float = STANDBY_A

    def after(self, step_s: float, *, armed: bool, airborne: bool) -> SimulatedBattery:
        """The battery one step later; on the ground it lasts longer by the ratio of the currents."""
        current = FLYING_A if airborne else IDLE_A if armed else STANDBY_A
        used = self.used_s + (step_s * current / FLYING_A if armed or airborne else 0.0)
        return replace(self, used_s=min(used, self.full_s), current_a=current)

    @property
    def remaining(self) -> float:
        """Share that is left, 0 to 1."""
        return 1.0 - self.used_s / self.full_s

    @property
    def voltage_v(self) -> float:
        """Falls with charge, and a little with the load."""
        return EMPTY_V + (FULL_V - EMPTY_V) * self.remaining - SAG_V * self.current_a / FLYING_A

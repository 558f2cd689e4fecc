"""A companion and a simulated autopilot in simulated time, through real frames."""

from __future__ import annotations

from typing import Any

import numpy as np

from advise_ros.config import SimulatorConfig
from advise_ros.sim.autopilot import Autopilot
from support.companion_flight import Flight


class Simulated:
    """A simulated autopilot in the shape of a scripted copter; tests of standing and drifting give it its drift."""

    def __init__(self, dialect: type[Any], **values: Any) -> None:
        config = SimulatorConfig(**{'ready_after_s': 3.0, 'step_s': 0.05, 'drift_m_s': 0.0, **values})
        self.autopilot: Autopilot = dialect(config, np.random.default_rng(config.seed))
        self.vehicle = self.autopilot.vehicle
        self.system_id = config.system_id
        self._step_s = config.step_s

    def step(self, dt_s: float) -> list[Any]:
        return [message for _ in range(round(dt_s / self._step_s)) for message in self.autopilot.step()]

    def receive(self, message: Any) -> list[Any]:
        return self.autopilot.receive(message)


class SimulatedFlight(Flight):
    """Streams the wanted velocity as the bridge's timer does."""

    copter: Simulated
    velocity = (0.0, 0.0, 0.0)
    doubt = ''

    def tick(self) -> None:
        super().tick()
        setpoint = None if self.cut else self.companion.setpoint(self.velocity, 0.0, self.now_s, self.doubt)
        if setpoint is not None:
            setpoint.pack(self._codec)  # To the precision of the wire.
            self.copter.receive(setpoint)

    @property
    def mode(self) -> str:
        return self.copter.vehicle.mode.name

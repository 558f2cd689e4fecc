"""The rigid body, its rotors and its drag (RotorPy's Multirotor, integrated in one cheap step), its battery and the wind."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rotorpy.vehicles.hummingbird_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

Array = NDArray[np.float64]
Body = dict[str, Array]

# The Hummingbird with the motors and the attitude loop of a larger craft, as ArduCopter flies: slow enough
# that control held for 25 ms is well damped, and midpoint steps of 25 ms stay within a millimetre of a fine
# integration over a flight.
PARAMETERS: dict[str, Any] = {**quad_params, 'tau_m': 0.03, 'kp_att': 150.0, 'kd_att': 24.0, 'motor_noise_std': 0.0}
HOVER_ROTOR_RAD_S = float(np.sqrt(PARAMETERS['mass'] * 9.81 / (4 * PARAMETERS['k_eta'])))


class Airframe(Multirotor):  # type: ignore[misc]  # RotorPy has no types
    """RotorPy's forces, moments and attitude loop; the step is the midpoint rule.

    RotorPy's own `step` calls solve_ivp, which costs more than the physics, and draws motor noise from
    numpy's global state, which no seed of ours reaches.
    """

    def __init__(self, parameters: dict[str, Any] | None = None) -> None:
        super().__init__(parameters or PARAMETERS, control_abstraction='cmd_ctatt', enable_ground=True)

    def step(self, state: Body, control: dict[str, Any], t_step: float) -> Body:
        """One step with constant rotor commands.

        Args:
            state: RotorPy's state: x, v, wind (3,) in ENU, q (4,) as [i, j, k, w], w (3,) in the body, rotor_speeds (4,).
            control: cmd_thrust in newtons and cmd_q (4,).
            t_step: seconds.
        """
        wanted = np.clip(self.get_cmd_motor_speeds(state, control), self.rotor_speed_min, self.rotor_speed_max)
        after: Body = self._unpack_state(self._midpoint(self._pack_state(state), wanted, t_step))
        after['q'] = after['q'] / np.linalg.norm(after['q'])
        after['rotor_speeds'] = np.clip(after['rotor_speeds'], self.rotor_speed_min, self.rotor_speed_max)
        if self._on_ground(after):
            after = self._handle_vehicle_on_ground(after)
        return after

    def _midpoint(self, now: Array, wanted_rotor_rad_s: Array, step_s: float) -> Array:
        start: Array = self._s_dot_fn(0.0, now, wanted_rotor_rad_s)
        middle: Array = self._s_dot_fn(0.0, now + 0.5 * step_s * start, wanted_rotor_rad_s)
        return now + step_s * middle


def at_rest(position_enu_m: tuple[float, float, float], rotor_rad_s: float = 0.0) -> Body:
    """A level body that stands still, nose to the north as an autopilot boots.

    Args:
        position_enu_m: (east, north, up).
        rotor_rad_s: of all rotors.
    """
    half = np.pi / 4
    return {
        'x': np.array(position_enu_m, dtype=float),
        'v': np.zeros(3),
        'q': np.array([0.0, 0.0, np.sin(half), np.cos(half)]),
        'w': np.zeros(3),
        'wind': np.zeros(3),
        'rotor_speeds': np.full(4, rotor_rad_s),
    }


FULL_V, EMPTY_V, SAG_V = 12.6, 10.5, 0.3
FLYING_A, IDLE_A, STANDBY_A = 15.0, 1.5, 0.3


@dataclass(frozen=True)
class SimulatedBattery:
    """What is left, as seconds of flight."""

    full_s: float
    used_s: float = 0.0
    current_a: float = STANDBY_A

    def after(self, step_s: float, *, armed: bool, airborne: bool) -> SimulatedBattery:
        """The battery one step later; on the ground it lasts longer by the ratio of the currents.

        Args:
            step_s: simulated.
            armed, airborne: state of the vehicle.
        """
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


CORRELATION_S = 2.0


@dataclass(frozen=True)
class Wind:
    """Horizontal wind in ENU; gusts have a standard deviation of `gust_m_s` on each axis."""

    mean_enu_m_s: tuple[float, float] = (0.0, 0.0)
    gust_m_s: float = 0.0

    def next_gust(self, gust_m_s: Array, noise: Array, step_s: float) -> Array:
        """The gust one step later.

        Args:
            gust_m_s: now, east and north, (2,).
            noise: standard normal, (2,).
            step_s: length of the step.
        """
        kept = math.exp(-step_s / CORRELATION_S)
        return kept * gust_m_s + self.gust_m_s * math.sqrt(1.0 - kept * kept) * noise

    def at(self, gust_m_s: Array) -> Array:
        """Wind velocity in ENU, (3,).

        Args:
            gust_m_s: (2,) east and north.
        """
        return np.array([self.mean_enu_m_s[0] + gust_m_s[0], self.mean_enu_m_s[1] + gust_m_s[1], 0.0])

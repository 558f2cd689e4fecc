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
# RotorPy's contact.
GROUND_M = 0.001
HOVER_ROTOR_RAD_S = float(np.sqrt(PARAMETERS['mass'] * 9.81 / (4 * PARAMETERS['k_eta'])))


class Airframe(Multirotor):  # type: ignore[misc]  # RotorPy has no types
    """RotorPy's forces, moments and attitude loop; the step is the midpoint rule.

    RotorPy's own `step` calls solve_ivp, which costs more than the physics, and draws motor noise from
    numpy's global state, which no seed of ours reaches. Its equations are written here with a fifth of its
    temporary objects; a test compares the two.
    """

    def __init__(self, parameters: dict[str, Any] | None = None) -> None:
        super().__init__(parameters or PARAMETERS, control_abstraction='cmd_ctatt', enable_ground=True)
        # (3, 3 * rotors): forces at the rotors, row by row, to their moment about the centre of mass.
        lever = self.rotor_geometry.T
        self._lever: Array = -np.moveaxis(Multirotor.hat_map(lever.T), 1, 0).reshape(3, -1)

    def step(self, state: Body, control: dict[str, Any], t_step: float) -> Body:
        """One step with constant rotor commands.

        Args:
            state: RotorPy's state: x, v, wind (3,) in ENU, q (4,) as [i, j, k, w], w (3,) in the body, rotor_speeds (4,).
            control: cmd_thrust in newtons and cmd_q (4,).
            t_step: seconds.
        """
        wanted = self._possible(self.get_cmd_motor_speeds(state, control))
        after: Body = self._unpack_state(self._midpoint(self._pack_state(state), wanted, t_step))
        after['q'] = after['q'] / math.sqrt(float(after['q'] @ after['q']))
        after['rotor_speeds'] = self._possible(after['rotor_speeds'])
        if self._on_ground(after):
            after = self._handle_vehicle_on_ground(after)
        return after

    def _possible(self, rotor_rad_s: Array) -> Array:
        speeds: Array = np.minimum(np.maximum(rotor_rad_s, self.rotor_speed_min), self.rotor_speed_max)
        return speeds

    def _midpoint(self, now: Array, wanted_rotor_rad_s: Array, step_s: float) -> Array:
        start: Array = self._s_dot_fn(0.0, now, wanted_rotor_rad_s)
        middle: Array = self._s_dot_fn(0.0, now + 0.5 * step_s * start, wanted_rotor_rad_s)
        return now + step_s * middle

    def get_cmd_motor_speeds(self, state: Body, control: dict[str, Any]) -> Array:
        """RotorPy's attitude loop (cmd_ctatt): rotor speeds (4,) [rad/s], not yet limited.

        Args:
            state, control: as of `step`.
        """
        now, wanted, rates = rotation(state['q']), rotation(control['cmd_q']), state['w']
        error = wanted.T @ now
        error = 0.5 * (error - error.T)
        attitude_error = np.array([error[2, 1], error[0, 2], error[1, 0]])
        turn = self.inertia @ (-self.kp_att * attitude_error - self.kd_att * rates) + cross(rates, self.inertia @ rates)
        forces = self.TM_to_f @ np.array([control['cmd_thrust'], *turn]) / self.k_eta
        speeds: Array = np.sign(forces) * np.sqrt(np.abs(forces))
        return speeds

    def _s_dot_fn(self, t: float, s: Array, cmd_rotor_speeds: Array) -> Array:
        """Derivative of RotorPy's state vector: x, v, q, w, wind, rotor speeds, (20,)."""
        velocity, rates, speeds = s[3:6], s[10:13], s[16:]
        turned = rotation(s[6:10])
        force, moment = self.compute_body_wrench(rates, speeds, (velocity - s[13:16]) @ turned)
        total = turned @ force + self.weight
        if self._enable_ground and s[2] <= GROUND_M:
            total[2] = max(total[2], 0.0)
        out = np.zeros(len(s))
        out[0:3] = velocity
        out[3:6] = total / self.mass
        out[6:10] = quaternion_rate(s[6:10], rates)
        out[10:13] = self.inv_inertia @ (moment - cross(rates, self.inertia @ rates))
        out[16:] = (cmd_rotor_speeds - speeds) / self.tau_m
        return out

    def compute_body_wrench(self, body_rates: Array, rotor_speeds: Array, body_airspeed_vector: Array) -> tuple[Array, Array]:
        """RotorPy's force and moment in the body frame, (3,) each: thrust, drag, and the air at every rotor.

        Args:
            body_rates: (3,) [rad/s].
            rotor_speeds: (4,) [rad/s].
            body_airspeed_vector: (3,) [m/s].
        """
        x, y, z = body_rates.tolist()
        turning = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        air = body_airspeed_vector[:, None] + turning @ self.rotor_geometry.T
        squared = rotor_speeds * rotor_speeds
        forces = -rotor_speeds * (self.rotor_drag_matrix @ air)
        forces[2] += self.k_eta * squared + self.k_h * (air[0] * air[0] + air[1] * air[1])
        drag = math.sqrt(float(body_airspeed_vector @ body_airspeed_vector)) * (self.drag_matrix @ body_airspeed_vector)
        moment: Array = self._lever @ forces.ravel()
        moment[0] -= self.k_flap * float(rotor_speeds @ air[1])
        moment[1] += self.k_flap * float(rotor_speeds @ air[0])
        moment[2] += self.k_m * float(self.rotor_dir @ squared)
        return forces.sum(axis=1) - drag, moment


def rotation(quaternion: Array) -> Array:
    """Rotation matrix (3, 3) of a quaternion (4,) as [i, j, k, w] of any length but 0."""
    i, j, k, w = quaternion.tolist()
    scale = 2.0 / (i * i + j * j + k * k + w * w)
    return np.array([
        [1.0 - scale * (j * j + k * k), scale * (i * j - k * w), scale * (i * k + j * w)],
        [scale * (i * j + k * w), 1.0 - scale * (i * i + k * k), scale * (j * k - i * w)],
        [scale * (i * k - j * w), scale * (j * k + i * w), 1.0 - scale * (i * i + j * j)],
    ])


def quaternion_rate(quaternion: Array, rates_rad_s: Array) -> tuple[float, float, float, float]:
    """How a quaternion [i, j, k, w] changes in a second by rates in the body frame."""
    i, j, k, w = quaternion.tolist()
    x, y, z = rates_rad_s.tolist()
    return (
        0.5 * (w * x - k * y + j * z), 0.5 * (k * x + w * y - i * z),
        0.5 * (-j * x + i * y + w * z), 0.5 * (-i * x - j * y - k * z),
    )


def cross(left: Array, right: Array) -> Array:
    """Cross product of two vectors (3,): numpy's takes twenty times as long."""
    a, b, c = left.tolist()
    x, y, z = right.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


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

"""The rigid body, its rotors and its drag (RotorPy's Multirotor, integrated in one cheap step), its battery and the wind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rotorpy.vehicles.hummingbird_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

from advise_ros.core.units import Vector

Array = NDArray[np.float64]
Body = dict[str, Array]

# The Hummingbird with the motors and the attitude loop of a larger craft, as ArduCopter flies: slow enough
# that control held for 25 ms is well damped, and midpoint steps of 25 ms stay within a millimetre of a fine
# integration over a flight.
PARAMETERS: dict[str, Any] = {**quad_params, 'tau_m': 0.03, 'kp_att': 150.0, 'kd_att': 24.0, 'motor_noise_std': 0.0}
# RotorPy's: below it the craft stands on the ground.
CONTACT_Z_M = 0.001
HOVER_ROTOR_RAD_S = float(np.sqrt(PARAMETERS['mass'] * 9.81 / (4 * PARAMETERS['k_eta'])))


def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def times(rows: Sequence[Vector], by: Vector) -> Vector:
    """A matrix of three rows times a vector."""
    x, y, z = by
    first, second, third = (row[0] * x + row[1] * y + row[2] * z for row in rows)
    return first, second, third


def rotation(quaternion: Sequence[float]) -> tuple[Vector, Vector, Vector]:
    """Rows of the matrix that turns a vector of the body into the world.

    Args:
        quaternion: [i, j, k, w], of any length but 0.
    """
    i, j, k, w = quaternion
    s = 2.0 / (i * i + j * j + k * k + w * w)
    return (
        (1.0 - s * (j * j + k * k), s * (i * j - k * w), s * (i * k + j * w)),
        (s * (i * j + k * w), 1.0 - s * (i * i + k * k), s * (j * k - i * w)),
        (s * (i * k - j * w), s * (j * k + i * w), 1.0 - s * (i * i + j * j)),
    )


class Airframe(Multirotor):  # type: ignore[misc]  # RotorPy has no types
    """RotorPy's forces, moments and attitude loop; the step is the midpoint rule.

    RotorPy's own `step` calls solve_ivp, which costs more than the physics, and draws motor noise from
    numpy's global state, which no seed of ours reaches. The forces are computed in plain numbers: on vectors of
    three, numpy's calls take ten times as long as the arithmetic.
    """

    def __init__(self, parameters: dict[str, Any] | None = None) -> None:
        super().__init__(parameters or PARAMETERS, control_abstraction='cmd_ctatt', enable_ground=True)
        self._rotors = [tuple(place) for place in self.rotor_geometry.tolist()]
        self._turns = [float(way) for way in self.rotor_dir]
        self._inertia, self._inverse = self.inertia.tolist(), self.inv_inertia.tolist()

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

    def get_cmd_motor_speeds(self, state: Body, control: dict[str, Any]) -> Array:
        """RotorPy's attitude loop: what the rotors are to turn with, rad/s, (4,).

        Args:
            state, control: as of `step`.
        """
        now, wanted = rotation(state['q'].tolist()), rotation(control['cmd_q'].tolist())
        apart = [cross(row, other) for row, other in zip(wanted, now, strict=True)]
        p, q, r = state['w'].tolist()
        x, y, z = (0.5 * self.kp_att * sum(one[axis] for one in apart) for axis in range(3))
        moment = times(self._inertia, (x - self.kd_att * p, y - self.kd_att * q, z - self.kd_att * r))
        held = cross((p, q, r), times(self._inertia, (p, q, r)))
        wrench = np.array([control['cmd_thrust'], *(m + h for m, h in zip(moment, held, strict=True))])
        squares = self.TM_to_f @ wrench / self.k_eta
        speeds: Array = np.sign(squares) * np.sqrt(np.abs(squares))
        return speeds

    def _s_dot_fn(self, t: float, s: Array, cmd_rotor_speeds: Array) -> Array:
        """RotorPy's derivative of its state (20,) by constant commands to the rotors (4,)."""
        _, _, z, vx, vy, vz, i, j, k, w, p, q, r, east, north, up, *speeds = s.tolist()
        to_world = rotation((i, j, k, w))
        to_body: Any = tuple(zip(*to_world, strict=True))
        force, moment = self._wrench((p, q, r), speeds, times(to_body, (vx - east, vy - north, vz - up)))
        fx, fy, fz = times(to_world, force)
        fz -= self.mass * self.g
        if z <= CONTACT_Z_M:  # The ground bears what would press the craft into it.
            fz = max(fz, 0.0)
        mx, my, mz = (m - c for m, c in zip(moment, cross((p, q, r), times(self._inertia, (p, q, r))), strict=True))
        return np.array([
            vx, vy, vz, fx / self.mass, fy / self.mass, fz / self.mass,
            0.5 * (w * p - k * q + j * r), 0.5 * (k * p + w * q - i * r), 0.5 * (w * r + i * q - j * p),
            -0.5 * (i * p + j * q + k * r),
            *times(self._inverse, (mx, my, mz)), 0.0, 0.0, 0.0,
            *((wanted - now) / self.tau_m for wanted, now in zip(cmd_rotor_speeds.tolist(), speeds, strict=True)),
        ])

    def _wrench(self, turning: Vector, speeds: list[float], air: Vector) -> tuple[Vector, Vector]:
        """RotorPy's force and moment on the body, in its frame, by its turning, its rotors and the air that it meets."""
        ax, ay, az = air
        speed = math.sqrt(ax * ax + ay * ay + az * az)
        fx, fy, fz = -speed * self.c_Dx * ax, -speed * self.c_Dy * ay, -speed * self.c_Dz * az
        mx = my = mz = 0.0
        for place, way, omega in zip(self._rotors, self._turns, speeds, strict=True):
            around = cross(turning, place)
            lx, ly, lz = ax + around[0], ay + around[1], az + around[2]
            lift = self.k_eta * omega * omega + self.k_h * (lx * lx + ly * ly) - omega * self.k_z * lz
            drag_x, drag_y, flap = -omega * self.k_d * lx, -omega * self.k_d * ly, self.k_flap * omega
            tx, ty, tz = cross(place, (drag_x, drag_y, lift))
            fx, fy, fz = fx + drag_x, fy + drag_y, fz + lift
            mx, my, mz = mx + tx - flap * ly, my + ty + flap * lx, mz + tz + way * self.k_m * omega * omega
        return (fx, fy, fz), (mx, my, mz)


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

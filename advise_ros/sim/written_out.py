"""RotorPy's equations of motion for one quadcopter, written out in plain numbers.

RotorPy's own are made for many shapes of craft: on three numbers, numpy's and scipy's overhead is nine tenths of
their cost. These are the same terms in the same units; a test holds them against RotorPy's. All vectors are
sequences of floats; R is the rotation matrix from the body (FLU) to ENU, row by row.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

Floats = Sequence[float]
# x, v (3 each), q (4, [i, j, k, w]), w, wind (3 each), rotor speeds (4), as RotorPy packs a state.
Packed = list[float]

ON_GROUND_M = 0.001


def rotation(quaternion: Floats) -> tuple[float, ...]:
    """The nine entries of R, row by row, of a quaternion of any length."""
    i, j, k, w = quaternion
    ii, jj, kk, ww = i * i, j * j, k * k, w * w
    scale = 1.0 / (ii + jj + kk + ww)
    ij, ik, jk, iw, jw, kw = i * j, i * k, j * k, i * w, j * w, k * w
    return (
        (ii - jj - kk + ww) * scale, 2.0 * (ij - kw) * scale, 2.0 * (ik + jw) * scale,
        2.0 * (ij + kw) * scale, (jj - ii - kk + ww) * scale, 2.0 * (jk - iw) * scale,
        2.0 * (ik - jw) * scale, 2.0 * (jk + iw) * scale, (kk - ii - jj + ww) * scale,
    )


@dataclass(frozen=True)
class Craft:
    """Four rotors in the plane of the centre of mass, principal axes of inertia along the body's.

    Attributes:
        rotors: position forward and left, metres, and direction of turning (1 or -1) of each.
        inertia: about the body's axes, kg m2.
        drag: of the frame on each axis, N s2/m2.
        k_eta, k_m, k_d, k_z, k_h: RotorPy's rotor coefficients: thrust, yaw moment, drag, inflow, lift.
        kp_att, kd_att: gains of the attitude loop.
        forces_of: rotor forces from thrust and moments, (4, 4).
    """

    mass: float
    gravity_m_s2: float
    tau_m: float
    rotors: tuple[tuple[float, float, float], ...]
    inertia: tuple[float, float, float]
    drag: tuple[float, float, float]
    k_eta: float
    k_m: float
    k_d: float
    k_z: float
    k_h: float
    kp_att: float
    kd_att: float
    forces_of: tuple[tuple[float, ...], ...]

    @classmethod
    def of(cls, model: Any) -> Craft:
        """The numbers of a RotorPy Multirotor without flapping and products of inertia."""
        rotors = tuple(
            (float(at[0]), float(at[1]), float(turn)) for at, turn in zip(model.rotor_geometry, model.rotor_dir, strict=True)
        )
        names = ('mass', 'tau_m', 'k_eta', 'k_m', 'k_d', 'k_z', 'k_h', 'kp_att', 'kd_att')
        return cls(
            gravity_m_s2=float(model.g), rotors=rotors, inertia=(model.Ixx, model.Iyy, model.Izz),
            drag=(model.c_Dx, model.c_Dy, model.c_Dz), forces_of=tuple(map(tuple, model.TM_to_f.tolist())),
            **{name: float(getattr(model, name)) for name in names},
        )

    def rates(self, state: Floats, wanted_rotor_rad_s: Floats) -> Packed:
        """Time derivative of a packed state."""
        vx, vy, vz = state[3:6]
        qi, qj, qk, qw = state[6:10]
        p, q, r = state[10:13]
        speeds = state[16:20]
        turned = rotation(state[6:10])
        force, moment = self._wrench((p, q, r), speeds, self._airspeed(turned, (vx, vy, vz), state[13:16]))
        east, north, up = (turned[row] * force[0] + turned[row + 1] * force[1] + turned[row + 2] * force[2] for row in (0, 3, 6))
        up -= self.mass * self.gravity_m_s2
        if state[2] <= ON_GROUND_M and up < 0.0:
            up = 0.0
        ix, iy, iz = self.inertia
        return [
            vx, vy, vz, east / self.mass, north / self.mass, up / self.mass,
            0.5 * (qw * p - qk * q + qj * r), 0.5 * (qk * p + qw * q - qi * r),
            0.5 * (qi * q - qj * p + qw * r), -0.5 * (qi * p + qj * q + qk * r),
            (moment[0] - (iz - iy) * q * r) / ix, (moment[1] - (ix - iz) * r * p) / iy, (moment[2] - (iy - ix) * p * q) / iz,
            0.0, 0.0, 0.0, *((wanted - now) / self.tau_m for wanted, now in zip(wanted_rotor_rad_s, speeds, strict=True)),
        ]

    @staticmethod
    def _airspeed(turned: Floats, velocity: Floats, wind: Floats) -> tuple[float, float, float]:
        """Velocity through the air in the body's axes."""
        x, y, z = velocity[0] - wind[0], velocity[1] - wind[1], velocity[2] - wind[2]
        return (
            turned[0] * x + turned[3] * y + turned[6] * z, turned[1] * x + turned[4] * y + turned[7] * z,
            turned[2] * x + turned[5] * y + turned[8] * z,
        )

    def _wrench(
        self, rates: tuple[float, float, float], speeds: Floats, airspeed: tuple[float, float, float],
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Force and moment of rotors and air in the body's axes."""
        (p, q, r), (ax, ay, az) = rates, airspeed
        through = -math.sqrt(ax * ax + ay * ay + az * az)
        fx, fy, fz = (through * drag * part for drag, part in zip(self.drag, airspeed, strict=True))
        mx = my = mz = 0.0
        for (x, y, turn), speed in zip(self.rotors, speeds, strict=True):
            east, north, up = ax - r * y, ay + r * x, az + p * y - q * x
            hx, hy = -speed * self.k_d * east, -speed * self.k_d * north
            lift = self.k_eta * speed * speed + self.k_h * (east * east + north * north) - speed * self.k_z * up
            fx, fy, fz = fx + hx, fy + hy, fz + lift
            mx, my, mz = mx + y * lift, my - x * lift, mz + x * hy - y * hx + turn * self.k_m * speed * speed
        return (fx, fy, fz), (mx, my, mz)

    def rotor_speeds(self, thrust_n: float, wanted: Floats, quaternion: Floats, rates: Floats) -> Packed:
        """Rotor speeds that give a thrust and turn the body towards a wanted attitude; unlimited, as RotorPy's."""
        now, goal = rotation(quaternion), rotation(wanted)
        roll, pitch, yaw = (
            0.5 * sum(goal[row + a] * now[row + b] - now[row + a] * goal[row + b] for row in (0, 3, 6))
            for a, b in ((2, 1), (0, 2), (1, 0))
        )
        p, q, r = rates
        ix, iy, iz = self.inertia
        asked = (
            thrust_n,
            -ix * (self.kp_att * roll + self.kd_att * p) + (iz - iy) * q * r,
            -iy * (self.kp_att * pitch + self.kd_att * q) + (ix - iz) * r * p,
            -iz * (self.kp_att * yaw + self.kd_att * r) + (iy - ix) * p * q,
        )
        forces = [sum(share * part for share, part in zip(row, asked, strict=True)) for row in self.forces_of]
        return [math.copysign(math.sqrt(abs(force) / self.k_eta), force) for force in forces]

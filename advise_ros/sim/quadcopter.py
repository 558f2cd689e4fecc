"""The flying craft: state and target in, next state out. No clock, no socket, no random state."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from advise_ros.sim import airframe, control
from advise_ros.sim.airframe import Airframe, Body, Wind
from advise_ros.sim.control import ControlLimits, Reference, Target

Array = NDArray[np.float64]

Command = dict[str, Array | float]

CONTACT_M = 0.01
NO_ERROR = np.zeros(3)


class State(NamedTuple):
    """The craft at one instant; the arrays are never written to.

    The body is the truth; the autopilot flies by its estimate, and the reference is in the estimate's frame.
    """

    body: Body
    reference: Reference
    gust_m_s: Array
    # Estimate minus truth, (3,) each.
    position_error_m: Array = NO_ERROR
    velocity_error_m_s: Array = NO_ERROR

    @property
    def position_enu_m(self) -> Array:
        return self.body['x']

    @property
    def velocity_enu_m_s(self) -> Array:
        return self.body['v']

    @property
    def altitude_m(self) -> float:
        return float(self.body['x'][2])

    @property
    def estimated_position_enu_m(self) -> Array:
        """Where the autopilot believes itself."""
        at = self.body['x']
        return at if self.position_error_m is NO_ERROR else at + self.position_error_m

    @property
    def estimated_velocity_enu_m_s(self) -> Array:
        velocity = self.body['v']
        return velocity if self.velocity_error_m_s is NO_ERROR else velocity + self.velocity_error_m_s

    @property
    def estimated_altitude_m(self) -> float:
        return float(self.body['x'][2] + self.position_error_m[2])

    @property
    def touches_ground(self) -> bool:
        return self.altitude_m <= CONTACT_M

    @property
    def roll_pitch_yaw_rad(self) -> tuple[float, float, float]:
        """Angles of the FLU body in ENU, turned about z, then y, then x."""
        return euler(self.body['q'])


def euler(quaternion: Array) -> tuple[float, float, float]:
    """Roll, pitch and yaw [rad], turned about z, then y, then x.

    Args:
        quaternion: (4,) as [i, j, k, w].
    """
    i, j, k, w = (float(part) for part in quaternion)
    roll = np.arctan2(2 * (w * i + j * k), 1 - 2 * (i * i + j * j))
    pitch = np.arcsin(min(max(2 * (w * j - k * i), -1.0), 1.0))
    yaw = np.arctan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))
    return float(roll), float(pitch), float(yaw)


@dataclass(frozen=True)
class Quadcopter:
    """A craft with its limits and its weather."""

    limits: ControlLimits = field(default_factory=ControlLimits)
    wind: Wind = field(default_factory=Wind)
    step_s: float = 0.025
    airframe: Airframe = field(default_factory=Airframe)

    def parked(self, east_m: float = 0.0, north_m: float = 0.0) -> State:
        """Standing on the ground with stopped motors, nose to the north.

        Args:
            east_m, north_m: where.
        """
        body = airframe.at_rest((east_m, north_m, 0.0))
        return State(body, control.at_rest(body['x'], euler(body['q'])[2]), np.zeros(2))

    def step(self, state: State, target: Target | None, noise: Array) -> State:
        """The state one step later.

        Args:
            state: now.
            target: what to do; None: motors off.
            noise: standard normal, (2,), for the gusts.
        """
        gust = self.wind.next_gust(state.gust_m_s, noise, self.step_s)
        if target is None and state.touches_ground:
            return self._standing(state, gust)
        return self._flying(state, target, gust)

    def _standing(self, state: State, gust: Array) -> State:
        _, _, yaw = euler(state.body['q'])
        if not state.body['v'].any() and not state.body['rotor_speeds'].any():
            return state._replace(gust_m_s=gust)
        body = airframe.at_rest((float(state.body['x'][0]), float(state.body['x'][1]), 0.0))
        body['q'] = np.array([0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)])
        return state._replace(body=body, reference=control.at_rest(state.estimated_position_enu_m, yaw), gust_m_s=gust)

    def _flying(self, state: State, target: Target | None, gust: Array) -> State:
        body = {**state.body, 'wind': self.wind.at(gust)}
        if target is None:
            command: Command = {'cmd_thrust': 0.0, 'cmd_q': body['q']}
            reference = control.at_rest(state.estimated_position_enu_m, euler(body['q'])[2])
        else:
            command, reference = self._commanded(state, target)
        return state._replace(body=self.airframe.step(body, command, self.step_s), reference=reference, gust_m_s=gust)

    def _commanded(self, state: State, target: Target) -> tuple[Command, Reference]:
        body, position, velocity = state.body, state.estimated_position_enu_m, state.estimated_velocity_enu_m_s
        if target.cascade:
            reference = control.carried(state.reference, target, position, velocity, self.step_s)
        else:
            reference = control.advance(state.reference, target, position, self.limits, self.step_s)
        if state.touches_ground:  # What the ground holds back must not build up for the moment of lift-off.
            reference = reference._replace(position_enu_m=position, integral_m_s2=np.zeros(3))
        if target.cascade:
            thrust, reference = control.cascaded_acceleration(reference, target, self.limits, self.step_s)
        else:
            thrust, reference = control.thrust_acceleration(reference, position, velocity, self.step_s)
        up = Airframe.rotate_k(body['q'])
        force = self.airframe.mass * float(thrust @ up)
        return {'cmd_thrust': max(force, 0.0), 'cmd_q': control.attitude(thrust, reference.yaw_enu_rad)}, reference

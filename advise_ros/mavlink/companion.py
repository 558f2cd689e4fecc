"""Our side of a MAVLink link as a pure machine: messages and monotonic time in, messages and status out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from advise_ros.config import MavlinkBridgeConfig
from advise_ros.core.units import Vector
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.ardupilot import ArduPilot
from advise_ros.mavlink.estimator import Estimator
from advise_ros.mavlink.machine import Machine
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.px4 import Px4Machine
from advise_ros.mavlink.rates import RateWatch
from advise_ros.mavlink.requests import Goal, GoalRequest
from advise_ros.mavlink.timesync import Timesync
from advise_ros.mavlink.vehicle import Address, Motion, Vehicle

HEARTBEAT_S = 1.0
# Longest wait for the autopilot's word before a request is said to be under way.
REPLY_S = 3.0


class Status(NamedTuple):
    """The vehicle as others see it; the fields of advise_msgs/VehicleStatus."""

    autopilot: str
    mode: str
    connected: bool
    ready: bool
    armed: bool
    in_air: bool
    commandable: bool
    waiting_for: str
    text: str
    owner: str = ''
    failsafe: str = ''


@dataclass(frozen=True)
class Settings:
    """Times are on the monotonic clock."""

    system_id: int = MavlinkBridgeConfig.system_id
    component_id: int = MavlinkBridgeConfig.component_id
    target_system: int = MavlinkBridgeConfig.target_system
    pose_rate_hz: float = MavlinkBridgeConfig.pose_rate_hz
    heartbeat_timeout_s: float = MavlinkBridgeConfig.heartbeat_timeout_s
    ready_timeout_s: float = MavlinkBridgeConfig.ready_timeout_s


MACHINES: dict[int, type[Machine]] = {mav.AUTOPILOT_ARDUPILOT: ArduPilot, mav.AUTOPILOT_PX4: Px4Machine}


class Companion:
    """Finds the autopilot, keeps its messages coming and carries out what is asked of it."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.vehicle = Vehicle(
            settings.heartbeat_timeout_s, own_system=settings.system_id, own_component=settings.component_id,
            wanted_system=settings.target_system,
        )
        self._machine: Machine | None = None
        self._open: GoalRequest | None = None
        self._heartbeat_s = -math.inf
        self._rates = RateWatch(self.vehicle)
        self.timesync = Timesync()
        self._estimator, self._reboots = Estimator(), 0
        self._was_connected = False
        self._link_problem = ''
        self._resting = ''

    def observe(self, message: Message, at_s: float, address: Address | None = None) -> bool:
        """Take a message in; False if it is not from our autopilot.

        Args:
            message: of any sender.
            at_s: steady time of arrival.
            address: its sender's, None on a link that has none.
        """
        motion = self.vehicle.motion
        ours = self.vehicle.observe(message, at_s, address)
        if ours and message.get_msgId() == mav.TIMESYNC:
            self.timesync.take(message, at_s)
        if ours:
            self._judge_position(message, motion, at_s)
        if ours and self._machine is None and self.vehicle.autopilot in MACHINES:
            self._machine = MACHINES[self.vehicle.autopilot](self.vehicle, self._settings.ready_timeout_s)
        if ours and self._machine is not None:
            self._machine.observe(message, at_s)
        return ours

    def _judge_position(self, message: Message, before: Motion | None, at_s: float) -> None:
        if self.vehicle.reboots != self._reboots:
            self._estimator, self._reboots = Estimator(), self.vehicle.reboots
        self._estimator.take(message, at_s)
        if self.vehicle.motion is not None and self.vehicle.motion is not before:
            self._estimator.moved(self.vehicle.motion)
        self.vehicle.doubt = self._estimator.doubt(at_s)

    def step(self, now_s: float, link_problem: str = '') -> list[Message]:
        """What to send now; call it after messages and at least ten times a second.

        Args:
            now_s: steady time.
            link_problem: why the link may carry nothing, '' if it does.
        """
        self._link_problem = link_problem
        out = self._own_heartbeat(now_s)
        connected = self.vehicle.connected(now_s)
        if self._was_connected and not connected:
            self._lose_link()
        self._was_connected = connected
        if connected and self._machine is not None:
            out += self._rates.due(self._wanted(self._machine), now_s)
            self.vehicle.forget_silent(now_s)
            out += self._machine.step(now_s)
            out += self.timesync.due(now_s)
            round_trip_s = self.timesync.round_trip_s(now_s)
            self.vehicle.round_trip_s = math.inf if round_trip_s is None else round_trip_s
        self._answer_late(now_s)
        return out

    def _own_heartbeat(self, now_s: float) -> list[Message]:
        if now_s - self._heartbeat_s < HEARTBEAT_S:
            return []
        self._heartbeat_s = now_s
        machine = self._machine
        return [mav.heartbeat(as_ground_station=machine is not None and machine.texts_to_ground_stations_only)]

    def _lose_link(self) -> None:
        self._rates.forget()
        self.timesync.forget()
        self.vehicle.received_at_s.clear()
        # Its mode may have changed meanwhile: only a new heartbeat shows it, whatever else comes first.
        self.vehicle.heartbeat_at_s = -math.inf
        if self._machine is not None:
            self._machine.lose_link()

    def _wanted(self, machine: Machine) -> tuple[tuple[int, float], ...]:
        rate_hz = self._settings.pose_rate_hz
        return ((mav.LOCAL_POSITION_NED, rate_hz), (mav.ATTITUDE, rate_hz), *machine.wanted())

    def _answer_late(self, now_s: float) -> None:
        request = self._open
        if request is not None and request.reply is None and now_s - request.begun_s > REPLY_S:
            request.answer(True, f'{request.goal.value} is under way; waiting for: {self.status(now_s).waiting_for}')

    # -- requests ----------------------------------------------------------------------------
    def ask(self, goal: Goal, now_s: float, altitude_m: float = 0.0) -> GoalRequest:
        """Begin a goal; its reply is set at once or by a later step, within REPLY_S.

        Args:
            goal: what is asked for.
            now_s: steady time.
            altitude_m: of a take-off, above home.
        """
        request = GoalRequest(goal, now_s, altitude_m)
        if self._machine is None or not self.vehicle.connected(now_s):
            request.answer(False, f'{goal.value} refused: {self._no_link()}')
            return request
        if self._resting and goal in (Goal.ARM, Goal.TAKEOFF, Goal.TAKE_OVER):
            request.answer(False, f'{goal.value} refused: {self._resting}')
            return request
        self._open = request
        self._machine.ask(request)
        return request

    def _no_link(self) -> str:
        what = 'the link to the autopilot is lost' if self.vehicle.target else 'no autopilot has answered'
        return f'{what} ({self.hindrance})' if self.hindrance else what

    @property
    def hindrance(self) -> str:
        """What is wrong with the link or with what arrives on it, '' if nothing is known."""
        return '; '.join(reason for reason in (self._link_problem, '' if self.vehicle.target else self.vehicle.unfit) if reason)

    # -- status ------------------------------------------------------------------------------
    def commandable(self, now_s: float) -> bool:
        """Whether velocity setpoints reach the vehicle and are obeyed.

        Args:
            now_s: steady time.
        """
        linked = self._machine is not None and self.vehicle.connected(now_s) and not self._resting
        return linked and self._machine is not None and self._machine.commandable

    @property
    def progressing(self) -> bool:
        """A goal is under way, and what it waits for is its own effect: no reason to worry."""
        return self._machine is not None and self._machine.progressing

    def setpoint(self, velocity_enu_m_s: Vector, yaw_rate_rad_s: float, now_s: float, doubt: str = '') -> Message | None:
        """What makes it fly a velocity, or stand where that is zero; None while nothing must be sent.

        Args:
            velocity_enu_m_s, yaw_rate_rad_s: what is to be flown.
            now_s: steady time.
            doubt: why the position is not to be trusted (then it stands by zero velocity alone), '' if it is.
        """
        if self._machine is None or not self.commandable(now_s) or self.vehicle.target is None:
            return None
        if not all(math.isfinite(value) for value in (*velocity_enu_m_s, yaw_rate_rad_s)):
            velocity_enu_m_s, yaw_rate_rad_s = (0.0, 0.0, 0.0), 0.0  # NaN is a stop on one autopilot and a loss on another.
        return self._machine.setpoint(self.vehicle.target, velocity_enu_m_s, yaw_rate_rad_s, now_s, doubt)

    def farewell(self, now_s: float) -> list[Message]:
        """What to send before we leave: a vehicle that we fly shall stand.

        Args:
            now_s: steady time.
        """
        flown = self._machine is not None and self.vehicle.connected(now_s) and not self._resting
        return self._machine.farewell(now_s) if flown and self._machine is not None else []

    def rest(self, why: str, now_s: float) -> list[Message]:
        """What makes the vehicle stand; until `resume` nothing arms or moves it, but for a landing and disarming.

        Args:
            why: shown while it rests.
            now_s: steady time.
        """
        out = self.farewell(now_s)
        self._resting = why
        if self._machine is not None:
            self._machine.let_go()
        return out

    def resume(self) -> None:
        """End a rest."""
        self._resting = ''

    def status(self, now_s: float) -> Status:
        """The vehicle's status.

        Args:
            now_s: steady time.
        """
        vehicle, machine = self.vehicle, self._machine
        connected = vehicle.connected(now_s)
        if machine is None or not connected:
            return Status(
                vehicle.name, machine.mode if machine else '', connected, ready=False, armed=vehicle.armed,
                in_air=vehicle.in_air, commandable=False, waiting_for=f'heartbeat: {self._no_link()}', text=vehicle.text,
                owner=machine.owner if machine else '', failsafe=machine.failsafe if machine else '',
            )
        return Status(
            vehicle.name, machine.mode, connected, ready=machine.ready, armed=vehicle.armed, in_air=vehicle.in_air,
            commandable=machine.commandable and not self._resting,
            waiting_for=self._resting or self._waiting_for(machine), text=vehicle.text, owner=machine.owner,
            failsafe=machine.failsafe,
        )

    def _waiting_for(self, machine: Machine) -> str:
        """With what may be wrong with the link, if nothing comes of what was asked for."""
        waiting, silent = machine.waiting_for, self.vehicle.health is None
        return f'{waiting} ({self._link_problem})' if waiting and silent and self._link_problem else waiting

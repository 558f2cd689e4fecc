"""The vehicle's MAVLink face: decoded messages in, messages out. No socket, no clock but the simulated one."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.sim import setpoints, telemetry
from advise_ros.sim.failsafe import GROUND_STATION_SYSTEM_ID, GroundStationFailsafe
from advise_ros.sim.modes import Mode
from advise_ros.sim.parameters import Parameters
from advise_ros.sim.telemetry import Streams
from advise_ros.sim.vehicle import Outcome, Vehicle

Message = Any
COMPONENT_ID = 1
FORCE = 21196  # the magic number that arms or disarms without checks
MAX_TEXT = 50

ACCEPTED, DENIED, UNSUPPORTED, FAILED = (
    mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_FAILED,
)


class Command(NamedTuple):
    """A COMMAND_LONG or COMMAND_INT with its seven parameters."""

    number: int
    params: tuple[float, ...]


class Autopilot:
    """ArduCopter as a companion sees it. Feed it with `receive`, move it with `step`; both give messages to send."""

    def __init__(self, config: SimulatorConfig, rng: np.random.Generator) -> None:
        self.vehicle = Vehicle(config, rng)
        self.system_id = config.system_id
        self._streams = Streams()
        self._parameters = Parameters(config)
        self._failsafe = GroundStationFailsafe()
        self._handlers: dict[str, Callable[[Message], list[Message]]] = {
            'COMMAND_LONG': self._on_command_long,
            'COMMAND_INT': self._on_command_int,
            'SET_MODE': self._on_set_mode,
            'SET_POSITION_TARGET_LOCAL_NED': self._on_setpoint,
            'HEARTBEAT': self._on_heartbeat,
            'PARAM_REQUEST_LIST': lambda _: self._parameters.everything(),
            'PARAM_REQUEST_READ': lambda message: self._parameters.read(message.param_id, message.param_index),
            'PARAM_SET': self._on_param_set,
            'TIMESYNC': self._on_timesync,
        }
        self._commands: dict[int, Callable[[Command], tuple[int, list[Message]]]] = {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            mavlink.MAV_CMD_DO_SET_MODE: self._do_set_mode,
            mavlink.MAV_CMD_NAV_TAKEOFF: lambda command: self._told(self.vehicle.take_off(command.params[6])),
            mavlink.MAV_CMD_NAV_LAND: lambda _: self._mode(Mode.LAND),
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _: self._mode(Mode.RTL),
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
        }

    def step(self) -> list[Message]:
        """One tick; returns what is due to be sent."""
        self.vehicle.step()
        self._watch_ground_station()
        texts = [_text(text) for text in self.vehicle.take_texts()]
        return texts + self._built(self._streams.due(self.vehicle.now_ns))

    def receive(self, message: Message) -> list[Message]:
        """Replies to a message; none to one that is for another system."""
        handler = self._handlers.get(message.get_type())
        if handler is None or not self._for_us(message):
            return []
        return handler(message)

    def _for_us(self, message: Message) -> bool:
        system = getattr(message, 'target_system', 0)
        component = getattr(message, 'target_component', 0)
        return system in (0, self.system_id) and component in (0, COMPONENT_ID)

    def _built(self, message_ids: list[int]) -> list[Message]:
        built = (telemetry.BUILDERS[message_id](self.vehicle) for message_id in message_ids)
        return [message for message in built if message is not None]

    def _watch_ground_station(self) -> None:
        mode = self._failsafe.wanted(self._parameters['FS_GCS_ENABLE'], self._parameters['FS_GCS_TIMEOUT'], self.vehicle.now_s)
        if mode is not None and self.vehicle.armed:
            self.vehicle.say(f'Ground station lost: {mode.name}')
            self._mode(mode)

    def _on_heartbeat(self, message: Message) -> list[Message]:
        if message.get_srcSystem() == GROUND_STATION_SYSTEM_ID:
            self._failsafe.hear(self.vehicle.now_s)
        return []

    def _on_param_set(self, message: Message) -> list[Message]:
        replies = self._parameters.set(message.param_id, message.param_value)
        self.vehicle.flight.timeout_s = self._parameters['GUID_TIMEOUT']
        return replies

    def _on_timesync(self, message: Message) -> list[Message]:
        asked = message.tc1 == 0
        return [mavlink.MAVLink_timesync_message(self.vehicle.now_ns, message.ts1)] if asked else []

    def _on_setpoint(self, message: Message) -> list[Message]:
        state = self.vehicle.state
        east, north, up = (float(part) for part in state.position_enu_m)
        self.vehicle.follow(setpoints.decode(message, (east, north, up), state.roll_pitch_yaw_rad[2]))
        return []

    def _on_command_long(self, message: Message) -> list[Message]:
        params = tuple(float(getattr(message, f'param{n}')) for n in range(1, 8))
        return self._run(Command(message.command, params), message)

    def _on_command_int(self, message: Message) -> list[Message]:
        first = (float(getattr(message, f'param{n}')) for n in range(1, 5))
        params = (*first, float(message.x), float(message.y), float(message.z))
        return self._run(Command(message.command, params), message)

    def _on_set_mode(self, message: Message) -> list[Message]:
        command = Command(mavlink.MAVLINK_MSG_ID_SET_MODE, (float(message.base_mode), float(message.custom_mode)))
        result, replies = self._do_set_mode(command)
        return [*replies, _ack(command.number, result, message)]

    def _run(self, command: Command, message: Message) -> list[Message]:
        handler = self._commands.get(command.number)
        result, replies = (UNSUPPORTED, []) if handler is None else handler(command)
        return [*replies, _ack(command.number, result, message)]

    def _told(self, outcome: Outcome) -> tuple[int, list[Message]]:
        severity = mavlink.MAV_SEVERITY_INFO if outcome.accepted else mavlink.MAV_SEVERITY_WARNING
        texts = [_text(outcome.text, severity)] if outcome.text else []
        return (ACCEPTED if outcome.accepted else FAILED), texts

    def _arm_disarm(self, command: Command) -> tuple[int, list[Message]]:
        force = command.params[1] == FORCE
        if command.params[0] == 1.0:
            return self._told(self.vehicle.arm(force=force))
        if command.params[0] == 0.0:
            return self._told(self.vehicle.disarm(force=force))
        return DENIED, []

    def _do_set_mode(self, command: Command) -> tuple[int, list[Message]]:
        flags, number = _integer(command.params[0]), _integer(command.params[1])
        if flags is None or number is None or not flags & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return DENIED, []
        return self._mode(number)

    def _mode(self, number: int) -> tuple[int, list[Message]]:
        before = self.vehicle.mode
        result, replies = self._told(self.vehicle.set_mode(number))
        if self.vehicle.mode is not before:
            # The new mode is seen with the next tick, a moment after the ACK.
            self._streams.hurry(mavlink.MAVLINK_MSG_ID_HEARTBEAT, self.vehicle.now_ns)
        return result, replies

    def _set_interval(self, command: Command) -> tuple[int, list[Message]]:
        message_id, interval_us = _integer(command.params[0]), command.params[1]
        if message_id not in telemetry.BUILDERS:
            return self._told(Outcome(False, f'No message with id {command.params[0]:g} to send'))
        if not math.isfinite(interval_us) or interval_us < -1.0:
            return DENIED, []
        if interval_us > 0.0:
            self._streams.set(message_id, max(round(interval_us * 1000), 1), self.vehicle.now_ns)
        elif message_id != mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._streams.stop(message_id)
        return ACCEPTED, []

    def _request_message(self, command: Command) -> tuple[int, list[Message]]:
        message_id = _integer(command.params[0])
        if message_id not in telemetry.BUILDERS:
            return self._told(Outcome(False, f'No message with id {command.params[0]:g} to send'))
        return ACCEPTED, self._built([message_id])


def _integer(value: float) -> int | None:
    return int(value) if math.isfinite(value) else None


def _ack(number: int, result: int, message: Message) -> Message:
    return mavlink.MAVLink_command_ack_message(
        number, result, 0, 0, message.get_srcSystem(), message.get_srcComponent(),
    )


def _text(text: str, severity: int = mavlink.MAV_SEVERITY_INFO) -> Message:
    return mavlink.MAVLink_statustext_message(severity, text.encode()[:MAX_TEXT])

"""A vehicle's MAVLink face, what all autopilots share: messages in, messages out. No socket, no clock but the simulated one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.core.units import NS
from advise_ros.sim import telemetry
from advise_ros.sim.geography import latitude_longitude_e7
from advise_ros.sim.missions import MissionManners, MissionStore
from advise_ros.sim.parameters import AutopilotParameters
from advise_ros.sim.setpoints import Setpoint
from advise_ros.sim.streams import Streams
from advise_ros.sim.vehicle import RequestOutcome, SimulatedVehicle

Message = Any
COMPONENT_ID = 1
FORCE = 21196  # the magic number that arms or disarms without checks
MAX_TEXT = 50

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = (
    mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED, mavlink.MAV_RESULT_DENIED,
    mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_FAILED,
)


class ReceivedCommand(NamedTuple):
    """A COMMAND_LONG or COMMAND_INT with its seven parameters."""

    number: int
    params: tuple[float, ...]


class TelemetryChannel:
    """One link: what is sent on it by itself, and whether anybody, or a ground station, has spoken there."""

    def __init__(self) -> None:
        self.streams = Streams()
        self.ground_station = self.spoken_to = False


class Autopilot(ABC):
    """An autopilot as its peers see it. Feed it with `receive`, move it with `step`; both give messages to send.

    Every link has its own message rates, and answers go to the link that asked.

    Args:
        vehicle: what flies.
        parameters: what PARAM_* messages are about.
        system_id: its MAVLink system.
    """

    # The result of a request that the vehicle does not take now.
    refusal = FAILED
    mission_manners: ClassVar[MissionManners]
    builders: ClassVar[Mapping[int, Callable[[Any], Message | None]]] = telemetry.BUILDERS

    def __init__(self, vehicle: SimulatedVehicle, parameters: AutopilotParameters, system_id: int) -> None:
        self.vehicle = vehicle
        self.system_id = system_id
        self._parameters = parameters
        self._channels = [TelemetryChannel()]
        self._asking = self._channels[0]
        self._text_id = 0
        self._reboots = False
        mission = MissionStore(self.mission_manners, latitude_longitude_e7((0.0, 0.0, 0.0)), lambda: self.vehicle.now_ns / NS)
        self._handlers: dict[str, Callable[[Message], list[Message]]] = {
            'COMMAND_LONG': self._on_command_long,
            'COMMAND_INT': self._on_command_int,
            'SET_POSITION_TARGET_LOCAL_NED': self._on_setpoint,
            'HEARTBEAT': self._on_heartbeat,
            'PARAM_REQUEST_LIST': lambda _: self._parameters.everything(),
            'PARAM_REQUEST_READ': lambda message: self._parameters.read(message.param_id, message.param_index),
            'PARAM_SET': self._on_param_set,
            'TIMESYNC': self._on_timesync,
            **mission.handlers(),
        }
        self._commands: dict[int, Callable[[ReceivedCommand], tuple[int, list[Message]]]] = {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            mavlink.MAV_CMD_DO_SET_MODE: self._do_set_mode,
            mavlink.MAV_CMD_NAV_TAKEOFF: self._take_off,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
        }

    # -- what differs ------------------------------------------------------------------------
    @abstractmethod
    def _do_set_mode(self, command: ReceivedCommand) -> tuple[int, list[Message]]: ...

    @abstractmethod
    def _take_off(self, command: ReceivedCommand) -> tuple[int, list[Message]]: ...

    @abstractmethod
    def _setpoint(self, message: Message) -> Setpoint | None:
        """What a setpoint asks for; None if it counts for nothing."""

    @abstractmethod
    def _parameters_changed(self) -> None:
        """Take over what PARAM_SET set."""

    @abstractmethod
    def _watch(self) -> None:
        """Failsafes, once a tick."""

    @abstractmethod
    def _on_heartbeat(self, message: Message) -> list[Message]:
        """Note a peer's heartbeat."""

    # -- in and out --------------------------------------------------------------------------
    def step(self) -> list[Message]:
        """One tick; returns what is due to be sent on the first link."""
        return self.step_all()[0]

    def step_all(self) -> list[list[Message]]:
        """One tick; returns what is due to be sent, by link."""
        if self._reboots:
            self._boot()
        self.vehicle.step()
        self._watch()
        texts = self.vehicle.take_texts()
        return [self._due(channel, texts) for channel in self._channels]

    def _due(self, channel: TelemetryChannel, texts: list[str]) -> list[Message]:
        self._asking = channel
        said = [part for text in texts for part in self._text(text)]
        return said + self._built(channel.streams.due(self.vehicle.now_ns))

    def add_channel(self) -> int:
        """One more link; returns its number."""
        self._channels.append(TelemetryChannel())
        return len(self._channels) - 1

    @property
    def _streams(self) -> Streams:
        """Of the link that is being served."""
        return self._asking.streams

    def _boot(self) -> None:
        """The clock starts at zero; parameters stay, what was asked for on the links is forgotten."""
        self._reboots = False
        self.vehicle.boot()
        self._channels = [TelemetryChannel() for _ in self._channels]
        self._parameters_changed()

    def receive(self, message: Message, channel: int = 0) -> list[Message]:
        """Replies to a message of a link; none to one that is for another system."""
        self._asking = self._channels[channel]
        self._asking.spoken_to = True
        handler = self._handlers.get(message.get_type())
        if handler is None or not self._for_us(message):
            return []
        return handler(message)

    def _for_us(self, message: Message) -> bool:
        system = getattr(message, 'target_system', 0)
        component = getattr(message, 'target_component', 0)
        return system in (0, self.system_id) and component in (0, COMPONENT_ID)

    def _built(self, message_ids: list[int]) -> list[Message]:
        built = (self.builders[message_id](self.vehicle) for message_id in message_ids)
        return [message for message in built if message is not None]

    def _text(self, text: str, severity: int = mavlink.MAV_SEVERITY_INFO) -> list[Message]:
        """STATUSTEXT, in chunks if it is long."""
        chunks = [text.encode()[at:at + MAX_TEXT] for at in range(0, len(text.encode()), MAX_TEXT)]
        self._text_id += len(chunks) > 1
        number = self._text_id if len(chunks) > 1 else 0
        return [mavlink.MAVLink_statustext_message(severity, part, number, at) for at, part in enumerate(chunks)]

    def _reply(self, outcome: RequestOutcome) -> tuple[int, list[Message]]:
        severity = mavlink.MAV_SEVERITY_INFO if outcome.accepted else mavlink.MAV_SEVERITY_WARNING
        return (ACCEPTED if outcome.accepted else self.refusal), self._text(outcome.text, severity)

    # -- messages ----------------------------------------------------------------------------
    def _on_param_set(self, message: Message) -> list[Message]:
        replies = self._parameters.set(message.param_id, message.param_value)
        self._parameters_changed()
        return replies

    def _on_timesync(self, message: Message) -> list[Message]:
        asked = message.tc1 == 0
        return [mavlink.MAVLink_timesync_message(self.vehicle.now_ns, message.ts1)] if asked else []

    def _on_setpoint(self, message: Message) -> list[Message]:
        setpoint = self._setpoint(message)
        if setpoint is not None:
            self.vehicle.follow(setpoint)
        return []

    def _on_command_long(self, message: Message) -> list[Message]:
        params = tuple(float(getattr(message, f'param{n}')) for n in range(1, 8))
        return self._run(ReceivedCommand(message.command, params), message)

    def _on_command_int(self, message: Message) -> list[Message]:
        first = (float(getattr(message, f'param{n}')) for n in range(1, 5))
        params = (*first, float(message.x), float(message.y), float(message.z))
        return self._run(ReceivedCommand(message.command, params), message)

    def _run(self, command: ReceivedCommand, message: Message) -> list[Message]:
        handler = self._commands.get(command.number)
        result, replies = (UNSUPPORTED, []) if handler is None else handler(command)
        return [*replies, ack(command.number, result, message)]

    # -- commands ----------------------------------------------------------------------------
    def _arm_disarm(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        force = command.params[1] == FORCE
        if command.params[0] == 1.0:
            return self._reply(self.vehicle.arm(force=force))
        if command.params[0] == 0.0:
            return self._reply(self.vehicle.disarm(force=force))
        return DENIED, []

    def _mode(self, number: int) -> tuple[int, list[Message]]:
        return self._reply(self.vehicle.set_mode(number))

    def _set_interval(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        message_id, interval_us = integer(command.params[0]), command.params[1]
        if message_id is None or message_id not in self.builders:
            return FAILED, self._text(f'No message with id {command.params[0]:g} to send')
        if not math.isfinite(interval_us) or interval_us < -1.0:
            return DENIED, []
        if interval_us > 0.0:
            self._streams.set(message_id, max(round(interval_us * 1000), 1), self.vehicle.now_ns)
        elif message_id != mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            self._streams.stop(message_id)
        return ACCEPTED, []

    def _reboot(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        if self.vehicle.armed or command.params[0] != 1.0:
            return self.refusal, []
        self._reboots = True
        return ACCEPTED, []

    def _request_message(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        message_id = integer(command.params[0])
        if message_id is None or message_id not in self.builders:
            return FAILED, self._text(f'No message with id {command.params[0]:g} to send')
        return ACCEPTED, self._built([message_id])


def integer(value: float) -> int | None:
    """A parameter that holds a number of something, or None."""
    return int(value) if math.isfinite(value) else None


def ack(number: int, result: int, message: Message) -> Message:
    """COMMAND_ACK to the sender of the message."""
    return mavlink.MAVLink_command_ack_message(number, result, 0, 0, message.get_srcSystem(), message.get_srcComponent())

"""ArduCopter's way to take commands, in GUIDED."""

from __future__ import annotations

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.sim import failsafe, missions, parameters, setpoints
from advise_ros.sim.autopilot import ACCEPTED, DENIED, Autopilot, Message, ReceivedCommand, ack, integer
from advise_ros.sim.failsafe import GROUND_STATION_SYSTEM_ID, GroundStationFailsafe
from advise_ros.sim.geography import metres_from_degrees
from advise_ros.sim.modes import Mode
from advise_ros.sim.setpoints import Setpoint
from advise_ros.sim.vehicle import SimulatedVehicle

# What REQUEST_DATA_STREAM is about.
STREAMED = (
    mavlink.MAVLINK_MSG_ID_SYS_STATUS, mavlink.MAVLINK_MSG_ID_GPS_RAW_INT, mavlink.MAVLINK_MSG_ID_ATTITUDE,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
)
# FENCE_ACTION; 0 only reports.
FENCE_ACTIONS = {1: Mode.RTL, 2: Mode.LAND, 3: Mode.RTL, 4: Mode.BRAKE}


class ArduCopter(Autopilot):
    """ArduCopter as a companion sees it."""

    mission_manners = missions.ARDUPILOT

    def __init__(self, config: SimulatorConfig, rng: np.random.Generator) -> None:
        super().__init__(SimulatedVehicle(config, rng), parameters.of_arducopter(config), config.system_id)
        self._failsafe = GroundStationFailsafe()
        self._parameters_changed()
        self._handlers['SET_MODE'] = self._on_set_mode
        self._handlers['REQUEST_DATA_STREAM'] = self._on_data_stream
        self._commands[mavlink.MAV_CMD_NAV_LAND] = lambda _: self._mode(Mode.LAND)
        self._commands[mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH] = lambda _: self._mode(Mode.RTL)
        self._commands[mavlink.MAV_CMD_DO_CHANGE_SPEED] = self._change_speed
        self._commands[mavlink.MAV_CMD_RUN_PREARM_CHECKS] = self._prearm_checks

    def _watch(self) -> None:
        mode = self._failsafe.wanted(self._parameters['FS_GCS_ENABLE'], self._parameters['FS_GCS_TIMEOUT'], self.vehicle.now_s)
        if mode is not None and self.vehicle.armed:
            self.vehicle.say(f'Ground station lost: {mode.name}')
            self.vehicle.failsafe_acted = True
            self._mode(mode)
        if self.vehicle.crosses_fence() and (action := FENCE_ACTIONS.get(round(self._parameters['FENCE_ACTION']))):
            self.vehicle.say('Fence Breached')
            self._mode(action)

    def _mode(self, number: int) -> tuple[int, list[Message]]:
        """A new mode is reported at once, by a heartbeat out of turn; PX4 waits for the next one."""
        before = self.vehicle.mode
        result = super()._mode(number)
        if self.vehicle.mode is not before:
            for channel in self._channels:
                channel.streams.hurry(mavlink.MAVLINK_MSG_ID_HEARTBEAT, self.vehicle.now_ns)
        return result

    def _on_heartbeat(self, message: Message) -> list[Message]:
        if message.get_srcSystem() == GROUND_STATION_SYSTEM_ID:
            self._failsafe.heartbeat(self.vehicle.now_s)
            self.vehicle.failsafe_acted = False
        return []

    def _parameters_changed(self) -> None:
        self.vehicle.flight.timeout_s = self._parameters['GUID_TIMEOUT']
        values, flight, vehicle = self._parameters.values, self.vehicle.flight, self.vehicle
        flight.return_altitude_m, flight.return_slope = values['RTL_ALT'] / 100.0, values['RTL_CONE_SLOPE']
        vehicle.fence = failsafe.fence_of_arducopter(values)
        flight.ceiling_m = vehicle.fence.height_m - values['FENCE_MARGIN']
        vehicle.satellites = bool(values['SIM_GPS1_ENABLE']) and not values['SIM_GPS_DISABLE']
        north, east = (values[f'SIM_GPS1_GLTCH_{axis}'] + values[f'SIM_GPS_GLITCH_{axis}'] for axis in 'XY')
        vehicle.satellite_shift_m = metres_from_degrees(north, east)

    def _setpoint(self, message: Message) -> Setpoint | None:
        state = self.vehicle.state
        east, north, up = (float(part) for part in state.estimated_position_enu_m)
        setpoint = setpoints.decode(message, (east, north, up), state.roll_pitch_yaw_rad[2])
        return setpoint if self._within_fence(setpoint) else None

    def _within_fence(self, setpoint: Setpoint) -> bool:
        """A position beyond the autopilot's own fence is ignored, without a word."""
        if setpoint.position_enu_m is None:
            return True
        east, north, up = setpoint.position_enu_m
        home = self.vehicle.flight.home_m
        return not self.vehicle.fence.outside(east - home[0], north - home[1], up)

    def _change_speed(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        """Binds only if it comes after the first position, and only until the next velocity."""
        if self.vehicle.flight.seeks and command.params[1] > 0.0:
            self.vehicle.flight.position_speed_m_s = command.params[1]
        return ACCEPTED, []

    def _on_set_mode(self, message: Message) -> list[Message]:
        command = ReceivedCommand(mavlink.MAVLINK_MSG_ID_SET_MODE, (float(message.base_mode), float(message.custom_mode)))
        result, replies = self._do_set_mode(command)
        return [*replies, ack(command.number, result, message)]

    def _on_data_stream(self, message: Message) -> list[Message]:
        """The old way to ask for all of them at one rate, as MAVProxy does; it undoes what others asked for."""
        if message.req_stream_id != mavlink.MAV_DATA_STREAM_ALL:
            return []
        for message_id in STREAMED:
            if message.start_stop and message.req_message_rate:
                self._streams.set(message_id, round(1e9 / message.req_message_rate), self.vehicle.now_ns)
            else:
                self._streams.stop(message_id)
        return []

    def _do_set_mode(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        flags, number = integer(command.params[0]), integer(command.params[1])
        if flags is None or number is None or not flags & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return DENIED, []
        return self._mode(number)

    def _take_off(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        return self._reply(self.vehicle.take_off(command.params[6]))

    def _prearm_checks(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        missing = self.vehicle.missing()
        return ACCEPTED, self._text(f'PreArm: {missing}', mavlink.MAV_SEVERITY_CRITICAL) if missing else []

"""PX4's way to take commands, in OFFBOARD."""

from __future__ import annotations

import math

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from advise_ros.config import SimulatorConfig
from advise_ros.sim import failsafe, missions, parameters, px4_telemetry, setpoints
from advise_ros.sim.autopilot import (
    ACCEPTED,
    DENIED,
    FAILED,
    REJECTED,
    Autopilot,
    Message,
    ReceivedCommand,
    TelemetryChannel,
    integer,
)
from advise_ros.sim.geography import ORIGIN_ALTITUDE_M
from advise_ros.sim.modes import Px4Mode
from advise_ros.sim.px4_vehicle import Px4Vehicle
from advise_ros.sim.setpoints import Setpoint
from advise_ros.sim.telemetry import AddressedTimesync

FEWEST_SATELLITES = 4
ASKS_TIME_NS = 100_000_000


class SimulatedPx4(Autopilot):
    """PX4 as a companion sees it: OFFBOARD lives by the stream, and texts are for ground stations only."""

    refusal = REJECTED
    builders = px4_telemetry.BUILDERS
    mission_manners = missions.PX4

    def __init__(self, config: SimulatorConfig, rng: np.random.Generator) -> None:
        self._px4 = Px4Vehicle(config, rng)
        super().__init__(self._px4, parameters.of_px4(config), config.system_id)
        self._handlers['MANUAL_CONTROL'] = self._on_sticks
        self._commands[mavlink.MAV_CMD_DO_CHANGE_SPEED] = lambda _: (ACCEPTED, [])  # It has no effect.
        self._commands[mavlink.MAV_CMD_NAV_LAND] = lambda _: self._mode(Px4Mode.LAND)
        self._commands[mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH] = lambda _: self._mode(Px4Mode.RTL)
        self._parameters_changed()

    def _text(self, text: str, severity: int = mavlink.MAV_SEVERITY_INFO) -> list[Message]:
        """To others it sends events, which few programs can read."""
        return super()._text(text, severity) if self._asking.ground_station else []

    def _due(self, channel: TelemetryChannel, texts: list[str]) -> list[Message]:
        """It asks its peers for their time, too."""
        asks = self.vehicle.now_ns // ASKS_TIME_NS > (self.vehicle.now_ns - self.vehicle.step_ns) // ASKS_TIME_NS
        time = [mavlink.MAVLink_timesync_message(0, self.vehicle.now_ns)] if asks and channel.spoken_to else []
        return [*super()._due(channel, texts), *time]

    def _on_timesync(self, message: Message) -> list[Message]:
        """It names the peer that it answers."""
        peer = message.get_srcSystem(), message.get_srcComponent()
        return [AddressedTimesync(reply.tc1, reply.ts1, *peer) for reply in super()._on_timesync(message)]

    def _watch(self) -> None:
        self._px4.watch_losses()

    def _on_heartbeat(self, message: Message) -> list[Message]:
        if message.type == mavlink.MAV_TYPE_GCS:
            self._px4.ground_station_s, self._asking.ground_station = self.vehicle.now_s, True
        return []

    def _on_sticks(self, message: Message) -> list[Message]:
        self._px4.sticks_s = self.vehicle.now_s
        return []

    def _parameters_changed(self) -> None:
        self.vehicle.flight.timeout_s = self._parameters['COM_OF_LOSS_T']
        self._px4.flight.fastest_m_s = fastest = self._parameters['MPC_XY_VEL_MAX']
        for slower in ('MPC_XY_CRUISE', 'MPC_VEL_MANUAL'):  # For good, as the real one.
            self._parameters.values[slower] = min(self._parameters[slower], fastest)
        self._px4.flight.return_altitude_m = self._parameters['RTL_RETURN_ALT']
        self._px4.fence = failsafe.fence_of_px4(self._parameters.values)
        self._px4.fence_action = round(self._parameters['GF_ACTION'])
        self._px4.satellites = self._parameters['SIM_GPS_USED'] >= FEWEST_SATELLITES
        self._px4.offboard_loss_action = round(self._parameters['COM_OBL_RC_ACT'])
        self._px4.sticks_exceptions = round(self._parameters['COM_RCL_EXCEPT'])
        self._px4.ground_station_loss_action = round(self._parameters['NAV_DLL_ACT'])

    def _setpoint(self, message: Message) -> Setpoint | None:
        setpoint, why = setpoints.decode_px4(message, self.vehicle.state.roll_pitch_yaw_rad[2])
        if why:
            self.vehicle.say(why)
        return setpoint

    def _set_interval(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        if command.params[0] == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
            return FAILED, []
        return super()._set_interval(command)

    def _arm_disarm(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        return (DENIED, []) if command.params[2] != 0.0 else super()._arm_disarm(command)

    def _do_set_mode(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        flags, main, sub = (integer(value) for value in command.params[:3])
        if flags is None or main is None or sub is None or command.params[3] != 0.0:
            return DENIED, []
        if not flags & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return DENIED, []
        return self._mode(main << 16 | sub << 24)

    def _take_off(self, command: ReceivedCommand) -> tuple[int, list[Message]]:
        """The altitude is above mean sea level, not above the ground."""
        if command.params[1] != 0.0 and not math.isnan(command.params[1]):
            return DENIED, []
        above_sea_m = command.params[6]
        above_ground_m = None if math.isnan(above_sea_m) else above_sea_m - ORIGIN_ALTITUDE_M
        return self._reply(self._px4.take_off_to(above_ground_m))

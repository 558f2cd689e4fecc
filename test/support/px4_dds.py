"""STAND-IN: a scripted PX4 behind the topics of its uXRCE-DDS client, as px4_msgs 1.17 has them.

It behaves as badly as the real one was seen to, and by DDS worse than by MAVLink: a TrajectorySetpoint moves it in every
mode. Import it after `support.foreign_messages.PX4.load()`.
"""

from __future__ import annotations

import math
import time
from collections import deque
from typing import Any

from px4_msgs.msg import (
    BatteryStatus,
    OffboardControlMode,
    TrajectorySetpoint,
    VehicleCommand,
    VehicleCommandAck,
    VehicleLandDetected,
    VehicleLocalPosition,
    VehicleOdometry,
    VehicleStatus,
)
from rclpy.clock import Clock, ClockType
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.messages import dialect
from support.graph import Graph
from support.scripted_px4 import LAND, LOITER, OFFBOARD, ScriptedPx4

RTL = 0x05040000
NAV_STATES = {OFFBOARD: 14, LOITER: 4, LAND: 18, RTL: 5}
WRITES = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
READS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=2, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE,
)
TURN_S = 0.02
# A busy machine makes its time go slowly, and not the stream a lost one.
LONGEST_TURN_S = 0.1
# With time synchronisation on (UXRCE_DDS_SYNCT) its stamps are the agent's: since 1970.
EPOCH_US = 1_790_000_000_000_000
# Topic -> seconds between messages.
PERIODS_S = {
    'vehicle_local_position_v1': TURN_S, 'vehicle_odometry': TURN_S, 'vehicle_status_v1': 0.2, 'vehicle_land_detected': 0.2,
    'battery_status_v1': 1.0,
}


class Px4OnDds:
    """A copter in the test's own node, in real time.

    Attributes:
        silent: topics without their version that are not published.
        late_s: positions are sent so long after they were true.
        resets: the estimator's reset counter.
        valid: whether the estimator stands by its position.
        setpoints: those that came, with the mode that was flown.
        signs_of_life: how many OffboardControlMode came.
        commands: VehicleCommands that came.
    """

    def __init__(self, graph: Graph, copter: ScriptedPx4, *, prefix: str = '') -> None:
        self.copter, self._graph, self._node = copter, graph, graph.node
        self.silent: set[str] = set()
        self.late_s, self.resets, self.valid = 0.0, 0, True
        self.setpoints: list[tuple[TrajectorySetpoint, int]] = []
        self.signs_of_life = 0
        self.commands: list[VehicleCommand] = []
        kinds = {
            'vehicle_local_position_v1': VehicleLocalPosition, 'vehicle_odometry': VehicleOdometry,
            'vehicle_status_v1': VehicleStatus, 'vehicle_land_detected': VehicleLandDetected, 'battery_status_v1': BatteryStatus,
            'vehicle_command_ack': VehicleCommandAck,
        }
        node = self._node
        self._publishers = {name: node.create_publisher(kind, f'{prefix}fmu/out/{name}', WRITES) for name, kind in kinds.items()}
        self._subscriptions = [
            node.create_subscription(kind, f'{prefix}fmu/in/{name}', take, READS)
            for name, kind, take in (
                ('offboard_control_mode', OffboardControlMode, self._on_life),
                ('trajectory_setpoint', TrajectorySetpoint, self._on_setpoint),
                ('vehicle_command', VehicleCommand, self._on_command),
            )
        ]
        self._due_s = dict.fromkeys(PERIODS_S, 0.0)
        self._under_way: deque[tuple[float, str, Any]] = deque()
        self._said = (0, False)
        self._last_s = time.monotonic()
        self._timer = node.create_timer(TURN_S, self._turn, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        """It falls silent for good."""
        self._graph.in_node_thread(self._close)

    def _close(self) -> None:
        self._timer.cancel()
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._publishers.clear()
        self._subscriptions.clear()

    @property
    def readers(self) -> int:
        """How many subscriptions there are to what it publishes."""
        return sum(publisher.get_subscription_count() for publisher in self._publishers.values())

    @property
    def outside_offboard(self) -> list[TrajectorySetpoint]:
        """Setpoints that came while it flew another mode: the real one follows them."""
        return [setpoint for setpoint, mode in list(self.setpoints) if mode != OFFBOARD]

    # -- what comes --------------------------------------------------------------------------
    def _on_life(self, message: OffboardControlMode) -> None:
        assert message.timestamp == 0 and (message.position or message.velocity) and not message.acceleration
        self.signs_of_life += 1
        self.copter.live()

    def _on_setpoint(self, message: TrajectorySetpoint) -> None:
        assert not any(map(math.isfinite, [*message.acceleration, *message.jerk, message.yaw]))
        self.setpoints.append((message, self.copter.mode))
        place = [None if math.isnan(value) else float(value) for value in message.position]
        self.copter.aim(place, tuple(0.0 if math.isnan(value) else float(value) for value in message.velocity))
        self._graph.notify()

    def _on_command(self, message: VehicleCommand) -> None:
        assert message.from_external
        self.commands.append(message)
        params = [getattr(message, f'param{n}') for n in range(1, 8)]
        for answer in self.copter.receive(dialect.MAVLink_command_long_message(
                message.target_system, message.target_component, message.command, 0, *params)):
            if answer.get_type() == 'COMMAND_ACK':
                self._publish('vehicle_command_ack', VehicleCommandAck(
                    timestamp=self._now_us, command=answer.command, result=answer.result,
                    target_system=message.source_system, target_component=message.source_component, from_external=True))

    # -- what it says ------------------------------------------------------------------------
    @property
    def _now_us(self) -> int:
        return EPOCH_US + round(self.copter.time_s * 1e6)

    def _turn(self) -> None:
        now_s = time.monotonic()
        passed_s, self._last_s = min(LONGEST_TURN_S, now_s - self._last_s), now_s
        self.copter.step(passed_s)
        changed = (self.copter.mode, self.copter.armed) != self._said
        self._said = self.copter.mode, self.copter.armed
        for name, period_s in PERIODS_S.items():
            if now_s >= self._due_s[name] or (changed and name == 'vehicle_status_v1'):
                self._due_s[name] = now_s + period_s
                late_s = self.late_s if 'position' in name or 'odometry' in name else 0.0
                self._under_way.append((now_s + late_s, name, getattr(self, f'_{name.removesuffix("_v1")}')()))
        for due in [due for due in self._under_way if due[0] <= now_s]:
            self._under_way.remove(due)
            self._publish(due[1], due[2])

    def _publish(self, name: str, message: Any) -> None:
        if name.removesuffix('_v1') not in self.silent:
            self._publishers[name].publish(message)

    def _vehicle_local_position(self) -> VehicleLocalPosition:
        north, east, down = self.copter.position_ned
        vx, vy, vz = self.copter.velocity_ned if self.copter.altitude_m > 0.01 else (0.0, 0.0, 0.0)
        return VehicleLocalPosition(
            timestamp=self._now_us, xy_valid=self.valid, z_valid=self.valid, v_xy_valid=self.valid, v_z_valid=self.valid,
            x=float(north), y=float(east), z=float(down), vx=float(vx), vy=float(vy), vz=float(vz), heading=0.0, xy_global=True,
            eph=0.5, epv=0.5)

    def _vehicle_odometry(self) -> VehicleOdometry:
        nose_east = [math.cos(math.pi / 4), 0.0, 0.0, math.sin(math.pi / 4)]
        return VehicleOdometry(
            timestamp=self._now_us, pose_frame=1, position=[float(value) for value in self.copter.position_ned], q=nose_east,
            velocity_frame=1, velocity=[float(value) for value in self.copter.velocity_ned], reset_counter=self.resets)

    def _vehicle_status(self) -> VehicleStatus:
        copter = self.copter
        mute = not copter.armed and copter.mode == OFFBOARD and not copter.streaming
        return VehicleStatus(
            timestamp=self._now_us, arming_state=2 if copter.armed else 1, nav_state=NAV_STATES[copter.mode],
            nav_state_user_intention=NAV_STATES[copter.commanded], failsafe=copter.failsafe, vehicle_type=1, system_type=2,
            system_id=copter.system_id, component_id=1, pre_flight_checks_pass=copter.ready and not mute)

    def _vehicle_land_detected(self) -> VehicleLandDetected:
        return VehicleLandDetected(timestamp=self._now_us, landed=self.copter.landed_state == mav.ON_GROUND)

    def _battery_status(self) -> BatteryStatus:
        return BatteryStatus(timestamp=self._now_us, connected=True, voltage_v=12.6, current_a=5.0, remaining=0.8)

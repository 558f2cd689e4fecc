"""The node that flies demonstrations like a person with errors."""

from __future__ import annotations

import sys
import time

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger

from advise_msgs.msg import VehicleStatus
from advise_ros import exits
from advise_ros.config import PilotConfig
from advise_ros.core.errors import InputError
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.flight.mission import Ask, Mission, MissionStage
from advise_ros.core.flight.pilot_flight import PilotFlight
from advise_ros.core.flight.vehicle_state import VehicleState
from advise_ros.core.people.known_site import Site, site_of
from advise_ros.core.people.simulated_pilot import SimulatedPilot
from advise_ros.core.units import ZERO
from advise_ros.nodes.route_grid import grid_of
from advise_ros.recording.wishfile import load_wish
from advise_ros.ros import qos, run
from advise_ros.ros.configured import ConfiguredNode
from advise_ros.ros.convert import vehicle_from_msg
from advise_ros.ros.diagnostics import ERROR, OK, WARN, Diagnostics
from advise_ros.ros.flying import (
    NEWEST_POSE,
    PoseGate,
    between_poses_ns,
    velocity_command,
)
from advise_ros.ros.receivers import Receivers
from advise_ros.ros.simulated_clock import ClockWatch

MISSION_PERIOD_S = 0.25
# A recorder that there is replies to recorder/stop in this time, on a busy machine too.
RECORDER_PATIENCE_S = 2.0
DIAGNOSTICS_DEPTH = 100
# Of zero velocity while no pose comes (steady time).
WATCHDOG_HZ = 20.0


class PilotNode(ConfiguredNode):
    """Flies demonstrations of the route through cmd_vel, with a person's mistakes, and then ends.

    For each of `flights`: waits until the vehicle is ready, takes off by mavlink_bridge/takeoff, flies from cell
    to cell as section 4 of the ADVISE paper has its pilots do (in some states the same mistake again
    and again, elsewhere random wrong moves), flies home over free cells after the final waypoint and lands by
    mavlink_bridge/land. Its right ways go round the cells of wish_file; its mistakes may lead into them. After
    max_moves it gives up: it ends the recording by recorder/stop, where there is one, and flies home. With
    handle_vehicle false somebody else takes off and lands. It never commands while vehicle_status.commandable is false.

    Takes `pose` (PoseStamped, frame map) and `vehicle_status`; publishes one `cmd_vel` (TwistStamped, frame map)
    for each pose, with that pose's stamp, and `pilot/status` (std_msgs/String), one sentence at every change.
    Before its first move it holds until the nodes of heard_by say on `/diagnostics` that its commands arrive.
    Exits 0 when all flights are done, 1 when one could not be flown.

    Example: ros2 run advise_ros pilot --ros-args -p grid_file:=config/grid_6x6.yaml -p flights:=3
    Next: `ask` or `console` shows what the drone wants to know about what was flown; `expert` answers like a person.
    """

    def __init__(self) -> None:
        super().__init__('pilot')
        self.config = self.load(PilotConfig)
        self._grid = grid_of(self, self.config)
        self._site = site_of(self._grid, load_wish(self.config.wish_file, self._grid))
        self._settings = self.config.seek_settings()
        self._mission = Mission(self.config.flights, self.config.handle_vehicle, self.config.vehicle_timeout_s)
        self._home: int | None = None
        self._flight: PilotFlight | None = None
        self._vehicle: VehicleState | None = None
        self._gate, self._time = PoseGate(), ClockWatch(self)
        self._pose_at_s = time.monotonic()
        self._announced = ''
        self._gave_up_at_s: float | None = None
        self._stop_reply: Future | None = None
        self._receivers = self._nodes_to_hear()
        self._audible_s: float | None = None
        self.exit_code = exits.OK
        self._diagnostics = Diagnostics(self)
        self._make_entities()

    def _nodes_to_hear(self) -> Receivers:
        space = self.get_namespace().rstrip('/')
        names = [name.strip() for name in self.config.heard_by.split(',') if name.strip()]
        return Receivers([f'{space}/{name}' for name in names], self.resolve_topic_name('cmd_vel'))

    def _make_entities(self) -> None:
        self._commands = self.create_publisher(TwistStamped, 'cmd_vel', qos.COMMAND)
        self._statuses = self.create_publisher(String, 'pilot/status', qos.latched())
        self._asks = {ask: self.create_client(Trigger, f'mavlink_bridge/{ask.value}') for ask in Ask}
        self._recorder_stop = self.create_client(Trigger, 'recorder/stop')
        self.create_subscription(VehicleStatus, 'vehicle_status', self._on_vehicle, qos.latched())
        self.create_subscription(PoseStamped, 'pose', self._on_pose, NEWEST_POSE)
        if self._receivers.missing:
            self.create_subscription(DiagnosticArray, '/diagnostics', self._receivers.on_diagnostics, DIAGNOSTICS_DEPTH)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(MISSION_PERIOD_S, self._on_mission, clock=steady)
        self._watchdog = self.create_timer(1.0 / WATCHDOG_HZ, self._on_watchdog, clock=steady)
        self._watchdog.cancel()  # It runs in flight: waiting costs nothing.

    # -- the vehicle -------------------------------------------------------------------------
    def _on_vehicle(self, message: VehicleStatus) -> None:
        self._vehicle = vehicle_from_msg(message)
        self._advance_mission()

    def _advance_mission(self) -> None:
        before = self._mission.stage
        self._mission.obstacle = self._time.problem
        ask = self._mission.advance(self._vehicle, time.monotonic())
        if ask is not None:
            self._call(ask)
        if before != self._mission.stage:
            self._enter(self._mission.stage)
        self._announce(self._sentence())
        if self._mission.over:
            self._finish()

    def _call(self, ask: Ask) -> None:
        client = self._asks[ask]
        if not client.service_is_ready():
            self._mission.unanswered(time.monotonic())
            return
        client.call_async(Trigger.Request()).add_done_callback(self._on_reply)

    def _on_reply(self, future: Future) -> None:
        reply = future.result()
        self._mission.replied(reply.success, reply.message, time.monotonic())
        if not reply.success:
            self.get_logger().warning(f'refused: {reply.message}')

    def _enter(self, stage: MissionStage) -> None:
        if stage == MissionStage.FLYING:
            self._pose_at_s = time.monotonic()
            choose = flight_choices(self._site, self.config, self._mission.flight)
            self._flight = PilotFlight(self._grid, choose.action, self._settings, self.config.max_moves, self._home)
            self._gave_up_at_s, self._stop_reply = None, None
            self._watchdog.reset()
        else:
            self._flight = None
            self._watchdog.cancel()

    def _finish(self) -> None:
        """Leave: the process ends with the node."""
        if self._mission.stage == MissionStage.FAILED:
            self.exit_code = exits.VERDICT_NO
            self.get_logger().error(self._mission.failure)
        rclpy.try_shutdown()

    # -- flying ------------------------------------------------------------------------------
    def _on_pose(self, message: PoseStamped) -> None:
        if self._flight is None:
            self._gate.restart()
        pose = self._gate.take(message, self.get_clock().now().nanoseconds)
        if pose is None:
            return
        self._pose_at_s = time.monotonic()
        if self._flight is not None and self._vehicle is not None and self._vehicle.commandable:
            self._fly(self._flight, pose)

    def _fly(self, flight: PilotFlight, pose: Pose) -> None:
        if not self._is_received() or (flight.gave_up and not self._recorder_has_published()):
            self._commands.publish(velocity_command(ZERO, pose.stamp_ns))
            return
        try:
            velocity = flight.step(pose)
        except InputError as problem:
            self._mission.fail(str(problem))
            velocity = ZERO
        self._commands.publish(velocity_command(velocity, pose.stamp_ns))
        self._home = flight.home
        if flight.finished:
            route = f'{flight.ending} after {flight.moves} moves in {flight.seconds:.0f} s'
            self.get_logger().info(f'flight {self._mission.flight}: {route}; home')
            self._mission.flown(time.monotonic())
            self._enter(self._mission.stage)
            self._advance_mission()
        self._announce(self._sentence())

    def _is_received(self) -> bool:
        """A recorder that has not matched this publisher yet would miss its first moves."""
        if not self._receivers.missing:
            return True
        now_s = time.monotonic()
        if self._audible_s is None:
            self._audible_s = now_s
        self._receivers.sent()
        if now_s - self._audible_s <= self.config.heard_timeout_s:
            return False
        missing = ', '.join(sorted(self._receivers.missing))
        self.get_logger().warning(f'{missing} did not count the commands within {self.config.heard_timeout_s:g} s; it flies on')
        self._receivers.missing.clear()
        return True

    def _recorder_has_published(self) -> bool:
        """The way home is no demonstration: a recorder that listens ends it first; hold until it has."""
        now_s = time.monotonic()
        if self._gave_up_at_s is None:
            self._gave_up_at_s = now_s
        if self._stop_reply is None and self._recorder_stop.service_is_ready():
            self._stop_reply = self._recorder_stop.call_async(Trigger.Request())
        replied = self._stop_reply is not None and self._stop_reply.done()
        return replied or now_s - self._gave_up_at_s > RECORDER_PATIENCE_S

    # -- steady time -------------------------------------------------------------------------
    def _on_watchdog(self) -> None:
        if self._flight is not None and time.monotonic() - self._pose_at_s > self.config.pose_timeout_s:
            self._hold()

    def _on_mission(self) -> None:
        missing_s = time.monotonic() - self._pose_at_s
        if self._flight is not None and missing_s > self.config.vehicle_timeout_s:
            self._mission.fail(f'no pose came for {missing_s:.0f} s')
        self._advance_mission()
        silent = 'no pose arrives' if missing_s > self.config.pose_timeout_s else ''
        said = self._time.problem or (silent and (self._gate.problem or silent))
        level = ERROR if self._mission.failure else WARN if said else OK
        self._diagnostics.set(level, self._mission.failure or said or self._announced, {'poses refused': self._gate.refused})

    def _hold(self) -> None:
        if self._vehicle is not None and self._vehicle.commandable:
            stamp_ns = between_poses_ns(self.get_clock().now().nanoseconds)
            self._commands.publish(velocity_command(ZERO, stamp_ns))

    def _sentence(self) -> str:
        """Where the pilot is, for people."""
        mission, flight = self._mission, self._flight
        if mission.over:
            return mission.failure or mission.stage.value
        sentence = f'flight {mission.flight} of {mission.flights}: {mission.stage.value}'
        if mission.stage == MissionStage.WAITING and mission.obstacle:
            return f'{sentence}; {mission.obstacle}'
        if mission.stage == MissionStage.WAITING and self._vehicle is not None and self._vehicle.waiting_for:
            sentence += f' ({self._vehicle.waiting_for})'
        if flight is not None and self._audible_s is not None and self._receivers.missing:
            return f'{sentence}, holding until {", ".join(sorted(self._receivers.missing))} receives the commands'
        if flight is None or flight.state is None:
            return sentence
        if flight.ending:
            return f'{sentence} home, {flight.ending}'
        cell = list(self._grid.xy(self._grid.cell_of(flight.state)))
        waypoint = list(self._grid.xy(self._grid.waypoints[self._grid.next_waypoint(flight.state)]))
        return f'{sentence}, cell {cell}, next waypoint {waypoint}, move {flight.moves}'

    def _announce(self, sentence: str) -> None:
        if sentence != self._announced:
            self._announced = sentence
            self._statuses.publish(String(data=sentence))


def flight_choices(site: Site, config: PilotConfig, flight: int) -> SimulatedPilot:
    """The simulated pilot of a flight: its mistakes follow from the seed, its noise from seed and flight."""
    rng = np.random.default_rng(config.seed)
    demonstrator = SimulatedPilot(site.grid, config.noise_rate, config.mistake_share, rng, right=site.right)
    rng.bit_generator.state = np.random.default_rng((config.seed, flight)).bit_generator.state
    return demonstrator


def main() -> None:
    sys.exit(run.run_node(PilotNode, PilotConfig))


if __name__ == '__main__':
    main()

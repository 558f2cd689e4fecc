"""The node that flies the learnt policy."""

from __future__ import annotations

import sys
import time
from functools import partial
from typing import NamedTuple

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.task import Future
from std_srvs.srv import Trigger

from advise_msgs.action import Fly
from advise_msgs.msg import Policy, VehicleStatus
from advise_ros.config import PolicyConfig
from advise_ros.core.flight.leg_follower import Pose
from advise_ros.core.flight.policy_flight import FlightPhase, PolicyFlight
from advise_ros.core.flight.vehicle_state import why_no_commands
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS, ZERO
from advise_ros.nodes.route_grid import grid_if_named
from advise_ros.ros import qos, run
from advise_ros.ros.convert import vehicle_from_msg
from advise_ros.ros.deadline import Deadline
from advise_ros.ros.diagnostics import OK, WARN
from advise_ros.ros.flight_publisher import FlightPublisher
from advise_ros.ros.flying import NEWEST_POSE, between_poses_ns, velocity_command
from advise_ros.ros.managed import ManagedNode
from advise_ros.ros.readiness import GoalPatience, GoalRefusal, Readiness

# After a flight zero velocity is sent for this long, then nothing: another node may fly.
HOLD_S, DIAGNOSE_PERIOD_S = 1.0, 0.5
ENDS_AS_WANTED = (FlightPhase.SUCCEEDED, FlightPhase.CANCELED)
# Those that nobody asked for are errors of the action.
ERROR_CODES = {
    FlightPhase.BUDGET_SPENT: Fly.Result.BUDGET_SPENT, FlightPhase.BLOCKED: Fly.Result.BLOCKED,
    FlightPhase.STOPPED: Fly.Result.STOPPED, FlightPhase.LOST: Fly.Result.LOST,
}
# Of zero velocity while it holds (steady time).
WATCHDOG_HZ = 50.0


class Flying(NamedTuple):
    """A flight under way and the goal that began it."""

    flight: PolicyFlight
    policy_version: int
    began_ns: int
    goal: ServerGoalHandle
    ended: Future


class PolicyNode(ManagedNode):
    """Flies the learnt policy: velocity commands from cell centre to cell centre at constant altitude.

    Takes `pose` (PoseStamped, frame map), `advise/policy` (advise_msgs/Policy) and, where a bridge
    publishes it, `vehicle_status`. While it flies, it publishes one `cmd_vel` (TwistStamped, frame map) for
    each pose, with that pose's stamp, and `policy/status` (advise_msgs/FlightStatus) at every change. When poses
    stop it commands zero velocity until they return. After a flight it holds for a second and is silent.

    A flight succeeds at the centre of the final waypoint, all others visited in order before. It fails in a
    blocked cell, off the grid, when the steps of its budget are spent, or (stop_on_loop) as soon as a state
    comes back, because the policy then repeats itself. It is stopped when the vehicle takes no commands any more, or
    when no pose came for give_up_s beyond pose_timeout_s; a flight that has ended never goes on by itself. It begins
    with the way to the centre of the present cell, from at most start_reach_m off the grid. A goal that cannot be
    flown is accepted and aborted at once; why stands in its result (error_code, error_msg) and in `policy/status`.

    Action: `policy/fly` (advise_msgs/action/Fly). Service: `policy/stop` (std_srvs/Trigger), hold now.
    Both leave the vehicle in the air.

    A managed node: while it is not active it commands nothing and refuses to fly; to deactivate it in flight
    holds the vehicle and ends the flight.

    Example: ros2 run advise_ros policy --ros-args -p grid_file:=config/grid_6x6.yaml -p speed_m_s:=2.0
    Next: take off and fly by T and f in `ask`, on the page of `console`, or by
      ros2 action send_goal --feedback policy/fly advise_msgs/action/Fly "{start_cell: -1}"
    """

    def __init__(self) -> None:
        super().__init__('policy')
        self.config = self.load(PolicyConfig)
        self._forget(None)
        self._flying: Flying | None = None
        self._patience = GoalPatience(self._missing)
        self._hold_until_s = 0.0
        self.diagnostics.meter('pose')
        self._make_entities()
        self.autostart(wanted=self.config.autostart)

    def _forget(self, grid: Grid | None) -> None:
        """Forget all that was received so far."""
        self._ready = Readiness(self, self.config, grid)
        self._policies, self._poses = self._ready.policies, self._ready.poses
        self._pose_missing = False

    def _make_entities(self) -> None:
        self._commands = self.create_publisher(TwistStamped, 'cmd_vel', qos.COMMAND)
        self._flight_publisher = FlightPublisher(self)
        self.create_service(Trigger, 'policy/stop', self._on_stop)
        self._action = ActionServer(
            self, Fly, 'policy/fly', _begun_on_acceptance, callback_group=ReentrantCallbackGroup(),
            goal_callback=self._on_goal, handle_accepted_callback=self._on_accepted, cancel_callback=self._on_cancel,
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSE_PERIOD_S, self._diagnose, clock=steady)
        self._watchdog = self.create_timer(1.0 / WATCHDOG_HZ, self._on_watchdog, clock=steady)
        self._watchdog.cancel()  # It runs while there is something to hold or to wait for: idle costs nothing.
        self._silence = Deadline(self, self.config.pose_timeout_s, self._on_silence)

    # -- life cycle --------------------------------------------------------------------------
    def open_up(self) -> None:
        self._forget(grid_if_named(self, self.config))
        self._silence.wait(self.config.pose_timeout_s)
        self.listen(Policy, 'advise/policy', self._on_policy, qos.latched())
        self.listen(VehicleStatus, 'vehicle_status', self._on_vehicle, qos.latched())
        self.listen(PoseStamped, 'pose', self._on_pose, NEWEST_POSE)

    def changed(self, names: frozenset[str]) -> None:
        self._policies.config = self.config

    def end(self) -> None:
        self._end(FlightPhase.STOPPED, 'the policy node was deactivated; the vehicle holds', wanted=True)
        self._patience.give_up()
        self._watchdog.cancel()
        self._hold_until_s = 0.0

    # -- what is flown -----------------------------------------------------------------------
    def _on_policy(self, message: Policy) -> None:
        self._policies.put(message)
        if self._policies.problem:
            self.get_logger().warning(self._policies.problem)

    def _on_vehicle(self, message: VehicleStatus) -> None:
        self._ready.vehicle = vehicle = vehicle_from_msg(message)
        if not vehicle.commandable:
            self._end(FlightPhase.STOPPED, f'the vehicle takes no commands any more ({why_no_commands(vehicle)})')

    def _on_pose(self, message: PoseStamped, info: dict[str, int]) -> None:
        if self._flying is None:
            self._poses.restart()
        pose = self._poses.take(message, info)
        if pose is None:
            return
        self.diagnostics.tick('pose')
        if self._flying is not None:
            self._silence.came(self._poses.waited_s)
            self._advance(self._flying, pose)

    def _advance(self, flying: Flying, pose: Pose) -> None:
        """One command for one pose."""
        flight = flying.flight
        if self._pose_missing:
            self._pose_missing = False
            self.get_logger().info(f'flight {self._flight_publisher.status.flight_id}: poses are back, it goes on')
        velocity = flight.step(pose)
        self._commands.publish(velocity_command(velocity, pose.stamp_ns))
        if flight.phase.over:
            self._end(flight.phase, flight.message)
        elif self._flight_publisher.update(flight, flight.phase, flight.message, pose.stamp_ns):
            self._feed_back(flying)

    def _feed_back(self, flying: Flying) -> None:
        flight, next_waypoint = flying.flight, self._flight_publisher.status.next_waypoint
        flying.goal.publish_feedback(Fly.Feedback(state=flight.state, next_waypoint=next_waypoint, steps=flight.steps))

    @property
    def _stamp_ns(self) -> int:
        """Of the newest pose."""
        return self._poses.pose.stamp_ns if self._poses.pose else 0

    def _end(self, phase: FlightPhase, message: str, *, wanted: bool = False) -> None:
        """Hold, publish the status, and let the action's result go out; `wanted`: somebody asked for it."""
        flying = self._flying
        if flying is None:
            return
        flying.flight.end(phase, message)
        if phase in (FlightPhase.CANCELED, FlightPhase.STOPPED):
            self._publish_zero()
        self._flight_publisher.update(flying.flight, phase, message, self._stamp_ns)
        self._flying, self._hold_until_s = None, time.monotonic() + HOLD_S
        self._silence.cancel()
        self._watchdog.reset()
        said = f'flight {self._flight_publisher.status.flight_id}: {phase.name}, {message}'
        if wanted or phase in ENDS_AS_WANTED:
            self.get_logger().info(said)
        else:
            self.get_logger().warning(said)
        flying.ended.set_result(self._result(flying))

    def _result(self, flying: Flying) -> Fly.Result:
        flight = flying.flight
        return Fly.Result(
            success=flight.phase == FlightPhase.SUCCEEDED, phase=int(flight.phase),
            flight_id=self._flight_publisher.status.flight_id,
            policy_version=flying.policy_version, steps=flight.steps, waypoints_reached=flight.waypoints_reached,
            seconds=(self._stamp_ns - flying.began_ns) / NS, message=flight.message,
            error_code=ERROR_CODES.get(flight.phase, Fly.Result.NONE),
            error_msg=flight.message if flight.phase in ERROR_CODES else '',
        )

    # -- requests ----------------------------------------------------------------------------
    def _missing(self, goal: Fly.Goal) -> GoalRefusal | None:
        """What a goal waits a moment for; None when all is there."""
        return self._ready.missing(goal)

    def _refusal(self, goal: Fly.Goal) -> GoalRefusal | None:
        """Why a flight can't begin now; None when it can."""
        if not self.active:
            return GoalRefusal(Fly.Result.NOT_ACTIVE, self.why_idle)
        if self._flying is not None:
            return GoalRefusal(Fly.Result.FLIES_ALREADY, 'a flight is under way; cancel it or call policy/stop')
        return self._ready.refusal(goal)

    async def _on_goal(self, goal: Fly.Goal) -> GoalResponse:
        if self.active and self._missing(goal):  # What the client has seen may still be on its way to this node.
            self._watchdog.reset()
            await self._patience.wait(goal)
        return GoalResponse.ACCEPT  # A rejection has no words: what cannot be flown is aborted at once, as in Nav2.

    def _on_accepted(self, goal: ServerGoalHandle) -> None:
        if (refusal := self._refusal(goal.request)) is not None:
            goal.execute(partial(self._refuse, refusal))
            return
        flight = PolicyFlight(self._policies.plan(goal.request), self.config.seek_settings())
        self._flying = Flying(flight, self._policies.version, self._stamp_ns, goal, Future())
        self._pose_missing = False
        self._silence.came()
        self._flight_publisher.begin(flight, self._policies.version, self._stamp_ns)
        self.get_logger().info(f'flight {self._flight_publisher.status.flight_id} of policy {self._policies.version} begins')
        goal.execute(partial(self._execute, self._flying.ended))
        self._feed_back(self._flying)

    def _refuse(self, refusal: GoalRefusal, goal: ServerGoalHandle) -> Fly.Result:
        self.get_logger().warning(f'policy/fly is refused: {refusal.message}')
        self._flight_publisher.refuse(refusal.message)
        goal.abort()
        return Fly.Result(message=refusal.message, error_code=refusal.error_code, error_msg=refusal.message)

    async def _execute(self, ended: Future, goal: ServerGoalHandle) -> Fly.Result:
        result: Fly.Result = await ended
        if result.success:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return result

    def _on_cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        if self._flying is None or self._flying.goal is not goal:
            return CancelResponse.REJECT
        self._end(FlightPhase.CANCELED, 'canceled; the vehicle holds', wanted=True)
        return CancelResponse.ACCEPT

    def _on_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        if self._flying is None:
            response.message = 'no flight was under way'
        else:
            self._end(FlightPhase.STOPPED, 'stopped by policy/stop; the vehicle holds', wanted=True)
            response.message = f'flight {self._flight_publisher.status.flight_id} is stopped; the vehicle holds'
        return response

    # -- steady time -------------------------------------------------------------------------
    def _on_silence(self) -> None:
        """No pose for too long: zero velocity at once, and on until poses return."""
        if self._flying is None:
            return
        self._pose_missing = True
        self._publish_zero()
        self._watchdog.reset()
        self._report_hold(self._flying.flight)

    def _report_hold(self, flight: PolicyFlight) -> None:
        reason = self._poses.problem or f'no pose for {self.config.pose_timeout_s:g} s'
        if self._flight_publisher.update(flight, flight.phase, f'holding: {reason}', self._stamp_ns):
            self.get_logger().warning(f'flight {self._flight_publisher.status.flight_id}: holding: {reason}')

    def _on_watchdog(self) -> None:
        now_s = time.monotonic()
        if self._pose_missing and self._poses.age_s > self.config.pose_timeout_s + self.config.give_up_s:
            why = self._poses.problem or f'no pose for {self._poses.age_s:.1f} s'
            self._end(FlightPhase.STOPPED, f'{why}; the flight is given up and does not go on by itself')
        holds = self._pose_missing if self._flying is not None else now_s < self._hold_until_s
        if holds:
            self._publish_zero()
        if holds and self._flying is not None:
            self._report_hold(self._flying.flight)
        self._patience.look(now_s)
        if not holds and not self._patience.waits:
            self._watchdog.cancel()

    def _publish_zero(self) -> None:
        stamp_ns = between_poses_ns(self.get_clock().now().nanoseconds)
        self._commands.publish(velocity_command(ZERO, stamp_ns))

    def _diagnose(self) -> None:
        said = self._ready.complaint
        values = {
            'phase': FlightPhase(self._flight_publisher.status.phase).name, 'policy version': self._policies.version,
            'flights': self._flight_publisher.status.flight_id, 'poses refused': self._poses.refused,
        }
        self.diagnostics.set(WARN if said else OK, said or ('flying' if self._flying else 'ready to fly'), values)


def _begun_on_acceptance(goal: ServerGoalHandle) -> Fly.Result:
    raise AssertionError('a flight begins when its goal is accepted')


def main() -> None:
    sys.exit(run.run_node(PolicyNode, PolicyConfig))


if __name__ == '__main__':
    main()

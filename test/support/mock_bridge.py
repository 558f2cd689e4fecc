"""A stand-in for simulator and bridge inside the test's own node: cmd_vel in, pose and vehicle_status out."""

from __future__ import annotations

import time
from collections import deque

from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from std_srvs.srv import Trigger

from advise_msgs.msg import VehicleStatus
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS, ZERO, Vector
from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_from_ns, stamp_to_ns
from support.graph import Graph
from support.vehicle import LazyVehicle

TURN_S = 0.01
# A vehicle that moves by a command older than this (simulated time) waits for the next one, as the simulator's does,
# but so long (steady time) that a busy machine does not make it fly on blindly.
LEAD_NS = int(0.3 * NS)
LONGEST_WAIT_S = 1.0


class MockBridge:
    """Moves a LazyVehicle by the commands that arrive; time runs `speedup` times as fast, in steps of 0.1 s.

    Attributes:
        commands: every command heard, with its stamp.
        poses: every position sent, by its stamp in ns.
        sending: poses go out; set it to False to cut them off.
        delay_ticks: each pose goes out so many turns (TURN_S) after it was true.
        refusal: what the services answer, empty to accept.
        takeoffs, landings: calls accepted.
        strange: commands heard while the vehicle took none.
    """

    def __init__(
        self, graph: Graph, grid: Grid, *, speedup: float = 10.0, status: bool = True, in_air: bool = True, wall: bool = False,
    ) -> None:
        """`wall`: stamps are of the wall clock, as our bridge's are: how late a pose is can be seen by them."""
        self._graph, self._grid = graph, grid
        east, north = grid.centre_enu_m(grid.waypoints[-1])
        self.vehicle = LazyVehicle([east, north, grid.altitude_m if in_air else 0.0])
        self.in_air, self.ready, self.frame_id = in_air, True, 'map'
        self.sending, self.refusal = True, ''
        self.delay_ticks = 0
        self.takeoffs = self.landings = 0
        self.commands: list[TwistStamped] = []
        self.poses: dict[int, Vector] = {}
        self.strange: list[TwistStamped] = []
        self.now_ns = NS
        self._under_way: deque[PoseStamped] = deque()
        self._command: Vector = ZERO
        self._answered_ns = 0
        self._waiting_since_s: float | None = None
        self._step_s, self._wall = TURN_S * speedup, wall
        node = graph.node
        self._poses = node.create_publisher(PoseStamped, 'pose', qos.SENSOR)
        self._statuses = node.create_publisher(VehicleStatus, 'vehicle_status', qos.latched()) if status else None
        node.create_subscription(TwistStamped, 'cmd_vel', self._on_command, qos.COMMAND)
        node.create_service(Trigger, 'mavlink_bridge/takeoff', self._on_takeoff)
        node.create_service(Trigger, 'mavlink_bridge/land', self._on_land)
        self.publish_status()
        self._timer = node.create_timer(TURN_S, self._turn, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def publish_status(self, **changes: object) -> None:
        """Tell the vehicle's state; `changes` override fields of the message."""
        message = VehicleStatus(**{
            'autopilot': 'mock', 'mode': 'GUIDED', 'connected': True, 'ready': self.ready, 'armed': self.in_air,
            'in_air': self.in_air, 'commandable': self.in_air, **changes,
        })
        if self._statuses is not None:
            self._statuses.publish(message)

    def _on_command(self, message: TwistStamped) -> None:
        (self.commands if self.in_air else self.strange).append(message)
        linear = message.twist.linear
        self._command = (linear.x, linear.y, linear.z)
        self._answered_ns = stamp_to_ns(message.header.stamp)
        self._graph.notify()

    def _on_takeoff(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._switch(response, in_air=True)

    def _on_land(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._switch(response, in_air=False)

    def slow_down(self, speedup: float) -> None:
        """Another speed from now on."""
        self._step_s = TURN_S * speedup

    def _switch(self, response: Trigger.Response, *, in_air: bool) -> Trigger.Response:
        response.success, response.message = not self.refusal, self.refusal or 'accepted'
        if response.success:
            self.takeoffs, self.landings = self.takeoffs + in_air, self.landings + (not in_air)
            self.in_air = in_air
            self.vehicle.position[2] = self._grid.altitude_m if in_air else 0.0
            self._command = ZERO
            self.publish_status()
        return response

    def _waits(self) -> bool:
        """The command that moves the vehicle is old: its sender gets some time to answer the last position."""
        blind = self.in_air and self._command != ZERO and self.now_ns - self._answered_ns > LEAD_NS
        since_s = self._waiting_since_s or time.monotonic()
        waits = blind and time.monotonic() - since_s < LONGEST_WAIT_S
        self._waiting_since_s = since_s if waits else None
        return waits

    def _turn(self) -> None:
        if self._waits():
            return
        for _ in range(5):
            self.vehicle.advance(self._command if self.in_air else ZERO, self._step_s / 5)
        self.now_ns = time.time_ns() if self._wall else self.now_ns + round(self._step_s * NS)
        if self.sending:
            self.publish_pose()

    def publish_pose(self) -> None:
        message = PoseStamped()
        message.header.frame_id = self.frame_id
        message.header.stamp = stamp_from_ns(self.now_ns)
        at = message.pose.position
        at.x, at.y, at.z = self.poses[self.now_ns] = tuple(self.vehicle.position)
        self._under_way.append(message)
        while len(self._under_way) > self.delay_ticks:
            self._poses.publish(self._under_way.popleft())

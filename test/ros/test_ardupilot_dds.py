"""The guard beside ArduPilot's DDS, as the launch file starts it; ArduPilot is a STAND-IN with its names, types and profiles.

What it does stands in ArduPilot's libraries/AP_DDS: poses 30 times a second in ENU from home, called base_link; velocities in
`map` or `base_link`, any other frame ignored; profiles best effort, volatile, depth 5.
"""

from __future__ import annotations

import time
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from advise_ros.ros import qos
from advise_ros.ros.convert import stamp_from_ns
from support.flying import velocity
from support.graph import Graph
from support.launching import launch_file, nodes
from support.paths import ROOT

GRID = str(ROOT / 'config' / 'grid_6x6.yaml')
AP_DDS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE,
)
PERIOD_S, LONGEST_TURN_S = 0.033, 0.1


class ArduPilotOnDds:
    """Flies the last velocity, at once; in GUIDED and armed.

    Attributes:
        position: east, north, up of home.
        silent: publishes no poses.
        clock_ns: its clock; time since boot before the GPS has the time.
        ignored: commands in a frame that it does not take.
    """

    def __init__(self, graph: Graph, prefix: str) -> None:
        self.position, self.velocity = [5.0, 5.0, 5.0], (0.0, 0.0, 0.0)
        self.commands: list[TwistStamped] = []
        self.ignored: list[TwistStamped] = []
        self.silent = False
        self.clock_ns = time.time_ns
        self._last_s = time.monotonic()
        node = graph.node
        self._notify = graph.notify
        self._poses = node.create_publisher(PoseStamped, f'{prefix}/pose/filtered', AP_DDS)
        node.create_subscription(TwistStamped, f'{prefix}/cmd_vel', self._on_command, AP_DDS)
        node.create_timer(PERIOD_S, self._turn, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_command(self, message: TwistStamped) -> None:
        if message.header.frame_id not in ('map', 'base_link'):
            self.ignored.append(message)
            return
        assert message.header.frame_id == 'map', 'base_link would be flown along the nose'
        linear = message.twist.linear
        self.velocity = linear.x, linear.y, linear.z
        self.commands.append(message)
        self._notify()

    def _turn(self) -> None:
        now_s = time.monotonic()
        passed_s, self._last_s = min(LONGEST_TURN_S, now_s - self._last_s), now_s
        self.position = [at + speed * passed_s for at, speed in zip(self.position, self.velocity, strict=True)]
        message = PoseStamped()
        message.header.frame_id, message.header.stamp = 'base_link', stamp_from_ns(self.clock_ns())
        message.pose.position.x, message.pose.position.y, message.pose.position.z = self.position
        message.pose.orientation.w = 1.0
        if not self.silent:
            self._poses.publish(message)


@pytest.mark.parametrize('prefix', ['ap', 'ap/v1'])
def test_commands_pass_the_guard_in_the_frame_and_profile_that_it_takes(graph: Graph, prefix: str) -> None:
    guard = nodes(launch_file(), backend='ardupilot_dds', dds_prefix=prefix)['guard']
    given = {'grid_file': GRID, 'pose_frame': guard.parameters[1]['pose_frame']}
    vehicle = ArduPilotOnDds(graph, prefix)
    graph.start('guard', params=given, remaps=dict(guard.remappings))
    commands = graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)
    poses, diagnostics = graph.listen('guard/pose', PoseStamped, qos.SENSOR), graph.listen('/diagnostics', DiagnosticArray)

    def until(condition: Any, what: str, east: float = 1.0) -> None:
        def asked() -> bool:
            commands.publish(velocity(east, 0.0))
            return bool(vehicle.commands) and bool(condition())

        graph.wait_until(asked, what=what)

    def stands(words: str) -> bool:
        said = any(s.name == '/guard' and words in s.message for a in diagnostics[-3:] for s in a.status)
        return said and vehicle.velocity == (0.0, 0.0, 0.0)

    until(lambda: vehicle.velocity == (1.0, 0.0, 0.0), 'flight east')
    assert {pose.header.frame_id for pose in poses} == {'map'}, 'for recorder and policy'
    until(lambda: vehicle.position[0] > 11.0, 'a position near the fence at 12 m', east=3.0)
    until(lambda: abs(vehicle.velocity[0]) < 0.2, 'the fence', east=3.0)
    assert vehicle.position[0] < 12.0
    until(lambda: vehicle.velocity[0] == -1.0, 'the way back', east=-1.0)
    vehicle.silent = True
    until(lambda: stands('pose older than'), 'a stop without poses', east=-1.0)
    vehicle.silent = False
    until(lambda: vehicle.velocity[0] == -1.0, 'flight when poses come again', east=-1.0)
    vehicle.clock_ns = time.monotonic_ns
    until(lambda: stands('is use_sim_time the same everywhere'), 'a stop while its clock has no time', east=-1.0)
    assert not vehicle.ignored

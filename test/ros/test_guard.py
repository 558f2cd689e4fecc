"""The guard's process between a pilot and a bridge of somebody else's."""

from __future__ import annotations

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from std_srvs.srv import Trigger

from advise_ros.ros import qos
from support.flying import pose, velocity
from support.graph import Graph
from support.launching import launch_file, nodes
from support.paths import ROOT

GRID = str(ROOT / 'config' / 'grid_6x6.yaml')


class Pilot:
    """Publishes poses and commands through MAVROS' names."""

    def __init__(self, graph: Graph, **params: object) -> None:
        remaps = {'pose': '/mavros/local_position/pose', 'guard/cmd_vel': '/mavros/setpoint_velocity/cmd_vel'}
        self.process = graph.start('guard', params=params, remaps=remaps)
        self._graph = graph
        graph.listen('/diagnostics', DiagnosticArray)
        self.flown = graph.listen('/mavros/setpoint_velocity/cmd_vel', TwistStamped, qos.COMMAND)
        self._poses = graph.publisher('/mavros/local_position/pose', PoseStamped, qos.SENSOR)
        self._commands = graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)

    def fly(self, at: PoseStamped, command: TwistStamped) -> None:
        self._poses.publish(at)
        self._commands.publish(command)

    def drift(self, at: PoseStamped) -> None:
        self._poses.publish(at)

    def until(self, at: PoseStamped, command: TwistStamped, wanted: tuple[float, float, float]) -> None:
        """Repeat until the guard lets exactly `wanted` through."""
        def seen() -> bool:
            self.fly(at, command)
            return bool(self.flown) and as_tuple(self.flown[-1]) == pytest.approx(wanted, abs=1e-9)

        self._graph.wait_until(seen, what=f'a checked command {wanted}')


def as_tuple(command: TwistStamped) -> tuple[float, float, float]:
    linear = command.twist.linear
    return linear.x, linear.y, linear.z


def said(graph: Graph, words: str) -> None:
    graph.wait_for('/diagnostics', DiagnosticArray, lambda a: any(s.name == '/guard' and words in s.message for s in a.status))


def test_passes_limits_refuses_and_stops_when_the_pilot_falls_silent(graph: Graph) -> None:
    pilot = Pilot(graph, grid_file=GRID)
    inside = pose(5.0, 5.0, 5.0)
    pilot.until(inside, velocity(1.0, 0.5), (1.0, 0.5, 0.0))
    assert pilot.flown[-1].header.frame_id == 'map'
    pilot.until(inside, velocity(30.0, 40.0), (1.8, 2.4, 0.0))
    said(graph, 'speed limited to 3 m/s')
    pilot.until(pose(20.0, 5.0, 5.0), velocity(1.0, 0.0), (0.0, 0.0, 0.0))
    said(graph, 'pose refused: it jumped 15.0 m')
    pilot.until(pose(20.0, 5.0, 5.0), velocity(-1.0, 0.0, 0.5), (-1.0, 0.0, 0.0))
    said(graph, 'outside the fence (8.0 m in plan): only motion back inward is flown')
    pilot.until(inside, velocity(1.0, 0.0, frame='base_link'), (0.0, 0.0, 0.0))
    said(graph, "its frame is 'base_link'")
    pilot.until(inside, velocity(float('nan'), 0.0), (0.0, 0.0, 0.0))
    said(graph, 'not finite')
    pilot.until(inside, velocity(1.0, 0.0), (1.0, 0.0, 0.0))
    said(graph, 'commands pass')
    graph.wait_until(lambda: as_tuple(pilot.flown[-1]) == (0.0, 0.0, 0.0), what='zero after silence')
    said(graph, 'command older than 0.5 s')
    assert pilot.process.terminate() == 0


def test_outside_the_fence_it_brings_the_vehicle_back_when_the_pilot_is_gone_and_logs_it_once(graph: Graph) -> None:
    pilot = Pilot(graph, grid_file=GRID)
    for east in (11.2, 11.8, 12.5):  # It is carried out; the fence is at 12 m.
        pilot.until(pose(east, 5.0, 5.0), velocity(-1.0, 0.0), (-1.0, 0.0, 0.0))

    def brought(east: float, wanted: tuple[float, float, float]) -> None:
        def seen() -> bool:
            pilot.drift(pose(east, 5.0, 5.0))
            return as_tuple(pilot.flown[-1]) == pytest.approx(wanted)

        graph.wait_until(seen, what=f'{wanted} without a command')

    brought(12.5, (-0.5, 0.0, 0.0))
    said(graph, 'outside the fence (0.5 m in plan): it is brought back inside')
    brought(11.4, (0.0, 0.0, 0.0))
    said(graph, 'command older than 0.5 s')

    def logged(words: str) -> None:
        def seen() -> bool:
            pilot.drift(pose(11.4, 5.0, 5.0))
            return words in pilot.process.text

        graph.wait_until(seen, what=f"'{words}' in the log")

    logged('the return inside the fence is over after')
    assert graph.call(Trigger, 'guard/stop').success
    brought(12.5, (0.0, 0.0, 0.0))
    said(graph, 'stopped until released: somebody asked for it')
    logged('stopped until released')
    for words in ('it is brought back inside', 'the return inside the fence is over after', 'guard]: stopped until released'):
        assert pilot.process.text.count(words) == 1, pilot.process.text


def test_without_a_fence_it_flies_only_when_asked_to_and_says_so(graph: Graph) -> None:
    refused = graph.run('guard')
    assert refused.popen.returncode == 2
    assert "there is no fence; name one by 'grid_file' or 'fence_polygon', or fly without by fence:=off" in refused.text
    pilot = Pilot(graph, fence=False)  # As ROS reads `-p fence:=off`.
    said(graph, 'waiting for cmd_vel; the fence is off (fence:=off)')
    pilot.until(pose(500.0, 5.0, 5.0), velocity(1.0, 0.0), (1.0, 0.0, 0.0))


@pytest.mark.parametrize(('params', 'words'), [
    ({'max_speed_m_s': -1.0}, "parameter 'max_speed_m_s' is -1.0"),
    ({'grid_file': '/no/such/grid.yaml'}, '/no/such/grid.yaml'),
    ({'max_sped_m_s': 1.0}, "did you mean 'max_speed_m_s'?"),
])
def test_wrong_parameters_end_it_in_one_sentence(graph: Graph, params: dict[str, object], words: str) -> None:
    process = graph.run('guard', params=params)
    assert process.popen.returncode == 2
    assert words in process.text
    assert 'Traceback' not in process.text


def test_stop_and_release_and_the_pose_in_the_frame_map(graph: Graph) -> None:
    pilot = Pilot(graph, fence_polygon='0,0 10,0 10,10 0,10', fence_low_m=1.0, fence_high_m=9.0, pose_frame='base_link')
    poses = graph.listen('guard/pose', PoseStamped, qos.SENSOR)
    inside = pose(5.0, 5.0, 5.0)
    inside.header.frame_id = 'base_link'  # As ArduPilot's DDS labels its ENU pose.
    pilot.until(inside, velocity(1.0, 0.0), (1.0, 0.0, 0.0))
    graph.wait_until(lambda: poses, what='a pose')
    assert poses[-1].header.frame_id == 'map'
    assert graph.call(Trigger, 'guard/stop').success
    pilot.until(inside, velocity(1.0, 0.0), (0.0, 0.0, 0.0))
    said(graph, 'stopped until released: somebody asked for it')
    assert graph.call(Trigger, 'guard/release').message == 'released; it was stopped: somebody asked for it'
    pilot.until(inside, velocity(1.0, 0.0), (1.0, 0.0, 0.0))
    assert not graph.call(Trigger, 'guard/release').success


def test_a_fence_without_altitudes_is_refused(graph: Graph) -> None:
    process = graph.run('guard', params={'fence_polygon': '0,0 10,0 10,10'})
    assert process.popen.returncode == 2
    assert "fence_polygon has no altitudes; set 'fence_low_m' and 'fence_high_m', or 'grid_file'" in process.text


@pytest.mark.parametrize(('arguments', 'topics', 'frame'), [
    ({'backend': 'mavros'}, ('mavros/local_position/pose', 'mavros/setpoint_velocity/cmd_vel'), 'map'),
    ({'backend': 'ardupilot_dds', 'dds_prefix': 'ap/v1'}, ('ap/v1/pose/filtered', 'ap/v1/cmd_vel'), 'base_link'),
])
def test_as_the_launch_file_starts_it_it_meets_mavros_and_ardupilots_dds(
    graph: Graph, arguments: dict[str, str], topics: tuple[str, str], frame: str,
) -> None:
    """Both tell positions at best effort; ArduPilot hears commands so.

    `launch_ros` puts the slash before namespaces.
    """
    asked = nodes(launch_file(str(ROOT)), namespace='drone1', **arguments)['guard']
    file, own = asked.parameters
    graph.start('guard', own, dict(asked.remappings), args=['--ros-args', '--params-file', file], namespace=f'/{asked.namespace}')
    flown = graph.listen(f'/drone1/{topics[1]}', TwistStamped, qos.SENSOR)
    told = graph.listen('/drone1/guard/pose', PoseStamped, qos.SENSOR)
    poses = graph.publisher(f'/drone1/{topics[0]}', PoseStamped, qos.SENSOR)
    commands = graph.publisher('/drone1/cmd_vel', TwistStamped, qos.COMMAND)

    def flies() -> bool:
        at = pose(5.0, 5.0, 5.0)
        at.header.frame_id = frame
        poses.publish(at)
        commands.publish(velocity(1.0, 0.5))
        return bool(told) and any(as_tuple(command) == (1.0, 0.5, 0.0) for command in flown)

    graph.wait_until(flies, what='a command through the guard')
    assert {at.header.frame_id for at in told} == {'map'}
    assert {command.header.frame_id for command in flown} == {'map'}  # What ArduPilot takes for east, north, up.

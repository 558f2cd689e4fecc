"""The bridge on PX4's uXRCE-DDS topics, messages of px4_msgs on the wire; PX4 is a STAND-IN (support/px4_dds.py)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from sensor_msgs.msg import BatteryState
from std_srvs.srv import Trigger

from advise_msgs.msg import VehicleStatus
from advise_ros.ros import qos
from support.flying import velocity
from support.foreign_messages import PX4
from support.graph import Graph
from support.processes import Process
from support.scripted_px4 import LAND, LOITER, OFFBOARD, ScriptedPx4

GRID = str(Path(__file__).parents[2] / 'config' / 'grid_6x6.yaml')


@pytest.fixture(name='px4')
def stand_in(graph: Graph) -> Iterator[Any]:
    PX4.load()
    from support.px4_dds import Px4OnDds

    px4 = Px4OnDds(graph, ScriptedPx4(drift_ned=(0.2, -0.2, 0.1)))
    yield px4
    px4.close()


def start(graph: Graph, **params: object) -> Process:
    given = {'url': 'px4_dds:', 'grid_file': GRID, 'takeoff_altitude_m': 3.0, 'heartbeat_timeout_s': 1.0, **params}
    return graph.start('mavlink_bridge', params=given, env=PX4.environment(graph.env))


def status_of(graph: Graph, predicate: Callable[[VehicleStatus], Any], **kwargs: Any) -> VehicleStatus:
    return graph.wait_for('vehicle_status', VehicleStatus, predicate, qos=qos.latched(), **kwargs)


def change(graph: Graph, name: str, label: str) -> bool:
    wanted = ChangeState.Request(transition=Transition(label=label))
    return bool(graph.call(ChangeState, f'{name}/change_state', wanted).success)


def take_off(graph: Graph) -> Any:
    status_of(graph, lambda s: s.ready, new=True)
    reply = graph.call(Trigger, 'mavlink_bridge/takeoff')
    assert reply.success, reply.message
    status_of(graph, lambda s: s.commandable, new=True)
    return graph.publisher('cmd_vel', TwistStamped, qos.COMMAND)


def holds_a_place(px4: Any) -> bool:
    return bool(px4.setpoints) and all(map(math.isfinite, px4.setpoints[-1][0].position))


def test_a_whole_flight_and_another_after_it(graph: Graph, px4: Any) -> None:
    copter = px4.copter
    bridge = start(graph)
    commands = take_off(graph)
    assert (copter.asked_without_stream, copter.mode) == (0, OFFBOARD)
    assert copter.altitude_m == pytest.approx(3.0, abs=0.5)

    graph.wait_until(lambda: holds_a_place(px4), what='a place to hold')
    begun = len(px4.setpoints)
    graph.wait_until(lambda: len(px4.setpoints) > begun + 60, what='three seconds of holding')
    assert math.dist(copter.position_ned, px4.setpoints[begun][0].position) < 1.0, 'by velocity alone it drifts'

    commands.publish(velocity(1.0, 0.0, 0.0))
    graph.wait_until(lambda: any(s.velocity[1] == 1.0 for s, _ in list(px4.setpoints)), what='east, the second axis of NED')
    flown = next(s for s, _ in px4.setpoints if s.velocity[1] == 1.0)
    assert (flown.velocity[0], math.isnan(flown.position[0])) == (0.0, True)
    graph.wait_until(lambda: holds_a_place(px4), what='holding after the command went stale')
    pose = graph.wait_for('pose', PoseStamped, lambda p: p.pose.position.x > 0.2, qos=qos.SENSOR)
    assert pose.header.frame_id == 'map'
    assert pose.pose.orientation.w == pytest.approx(1.0)  # The nose points east.
    battery = graph.wait_for('battery_state', BatteryState, lambda b: b.voltage > 0.0, qos=qos.SENSOR)
    assert (battery.voltage, battery.percentage) == pytest.approx((12.6, 0.8))

    def pushed() -> bool:
        commands.publish(velocity(-2.0, 0.0))
        return copter.position_ned[1] < -1.0

    graph.wait_until(pushed, what='a position near the fence at -2 m')
    graph.wait_until(lambda: holds_a_place(px4), what='holding before the fence')
    assert copter.position_ned[1] > -2.0

    assert graph.call(Trigger, 'mavlink_bridge/land').success
    status_of(graph, lambda s: not s.armed and s.mode == 'OFFBOARD', new=True)
    streamed = px4.signs_of_life
    status_of(graph, lambda s: s.ready, new=True)
    take_off(graph)
    assert px4.signs_of_life > streamed
    assert not px4.outside_offboard, 'PX4 takes setpoints by DDS in any mode'
    assert bridge.terminate() == 0
    graph.wait_until(lambda: copter.mode == LOITER, what='a hold when the bridge ends')


def test_who_takes_the_mode_has_the_vehicle(graph: Graph, px4: Any) -> None:
    start(graph)
    commands = take_off(graph)
    px4.copter.set_mode(LOITER)  # A ground station.
    status = status_of(graph, lambda s: s.mode == 'LOITER', new=True)
    assert (status.owner, status.commandable) == ('others', False)
    assert 'LOITER was set by someone else' in status.waiting_for
    alive, setpoints = px4.signs_of_life, len(px4.setpoints)
    commands.publish(velocity(1.0, 0.0))
    status_of(graph, lambda s: s.mode == 'LOITER', new=True)  # A second later:
    assert (px4.signs_of_life, len(px4.setpoints)) == (alive, setpoints), 'a stream that goes on would bring OFFBOARD back'
    assert graph.call(Trigger, 'mavlink_bridge/take_over').success
    status_of(graph, lambda s: s.commandable, new=True)
    assert change(graph, 'mavlink_bridge', 'deactivate')
    graph.wait_until(lambda: px4.copter.mode == LOITER, what='a hold by a bridge that is deactivated')
    assert change(graph, 'mavlink_bridge', 'cleanup')
    graph.wait_until(lambda: not px4.readers, what='the end of its subscriptions')
    for label in ('configure', 'activate'):
        assert change(graph, 'mavlink_bridge', label)
    status_of(graph, lambda s: s.in_air and s.mode == 'LOITER', new=True)
    assert graph.call(Trigger, 'mavlink_bridge/take_over').success
    status_of(graph, lambda s: s.commandable, new=True)
    px4.copter.fail(LAND)
    failing = status_of(graph, lambda s: s.failsafe, new=True)
    assert (failing.failsafe, failing.commandable) == ('LAND', False)
    assert px4.copter.asked_without_stream == 0


def test_a_position_that_is_not_to_be_trusted_moves_nothing(graph: Graph, px4: Any) -> None:
    px4.copter.drift_ned = (0.0, 0.0, 0.0)  # It would come to the ground meanwhile.
    start(graph, takeoff_altitude_m=4.0)
    diagnostics = graph.listen('/diagnostics', DiagnosticArray)
    commands = take_off(graph)

    def newest() -> Any:
        commands.publish(velocity(0.3, 0.0))
        return px4.setpoints[-1][0]

    def doubted_after(trouble: Callable[[], None], words: str) -> None:
        graph.wait_until(lambda: float(newest().velocity[1]) > 0.2, what=f'flight before: {words}')
        before = len(diagnostics)
        trouble()
        graph.wait_until(
            lambda: not newest().velocity.any() and not any(map(math.isfinite, newest().position)), what=f'a stop: {words}')
        graph.wait_until(lambda: newest() and any(words in s.message for a in diagnostics[before:] for s in a.status), what=words)

    def reset() -> None:
        px4.resets += 1

    def trusted(*, valid: bool) -> None:
        px4.valid = valid

    def late(late_s: float) -> None:
        px4.late_s = late_s

    doubted_after(reset, 'the estimator was reset (number 1)')
    doubted_after(lambda: trusted(valid=False), 'pose older than')
    trusted(valid=True)
    doubted_after(lambda: px4.silent.add('vehicle_odometry'), 'pose older than')  # A reset would not be seen any more.
    px4.silent.clear()
    doubted_after(lambda: late(1.5), 'late')
    late(0.0)
    graph.wait_until(lambda: float(newest().velocity[1]) > 0.2, what='flight when positions come in time')
    px4.silent.add('vehicle_status')
    lost = status_of(graph, lambda s: not s.connected, new=True)
    assert 'the link to the autopilot is lost' in lost.waiting_for
    assert not px4.outside_offboard


def test_what_is_missing_is_said(graph: Graph, px4: Any) -> None:
    from px4_msgs.msg import VehicleStatus as Px4Status

    from support.px4_dds import WRITES

    without = graph.start('mavlink_bridge', params={'url': 'px4_dds:', 'fence': 'off'})
    assert without.wait_exit() == 2
    assert "error: parameter 'url': px4_msgs is not there: install it" in without.text

    px4.silent.add('vehicle_land_detected')
    start(graph)
    waiting = status_of(graph, lambda s: 'nothing comes on' in s.waiting_for)
    assert 'pre-arm check (nothing comes on /fmu/out/vehicle_land_detected)' in waiting.waiting_for
    second = graph.node.create_publisher(Px4Status, 'fmu/out/vehicle_status_v1', WRITES)
    crowded = status_of(graph, lambda s: 'several publish' in s.waiting_for)
    assert 'fmu/out/vehicle_status_v1: give each PX4 a namespace of its own' in crowded.waiting_for
    graph.node.destroy_publisher(second)
    px4.close()
    graph.node.create_publisher(Px4Status, 'fmu/out/vehicle_status_v4', WRITES)
    other = status_of(graph, lambda s: 'vehicle_status_v4' in s.waiting_for)
    assert 'px4_msgs here is for /fmu/out/vehicle_status_v1: build the px4_msgs of its release' in other.waiting_for

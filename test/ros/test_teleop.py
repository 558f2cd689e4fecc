"""teleop in a terminal of its own (a pseudo-terminal), against a vehicle of plain arithmetic."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from sensor_msgs.msg import Joy
from std_srvs.srv import Trigger

from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.ros import qos
from support.graph import Graph
from support.mock_bridge import MockBridge
from support.policies import square
from support.processes import ros_arguments
from support.typist import Typist

UP, RIGHT = b'\x1b[A', b'\x1bOC'


@pytest.fixture
def typist(graph: Graph, tmp_path: Path) -> Iterator[Typist]:
    path = tmp_path / 'grid.yaml'
    path.write_text(yaml.safe_dump({'grid': grid_to_mapping(square())}))
    typist = Typist(graph, 'teleop', *ros_arguments({'grid_file': str(path)}, {}, ''), size=(50, 300))
    try:
        yield typist
    finally:
        typist.close()


def test_in_the_air_t_takes_over_what_others_fly(graph: Graph, typist: Typist) -> None:
    bridge = MockBridge(graph, square(), in_air=True)
    taken: list[bool] = []

    def take_over(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        taken.append(True)
        response.success, response.message = True, 'taken over'
        return response

    graph.node.create_service(Trigger, 'mavlink_bridge/take_over', take_over)
    bridge.publish_status(owner='others', waiting_for='mavlink_bridge/take_over: RTL was set by someone else', commandable=False)
    typist.wait_to_see('others fly it, t takes over (RTL was set by someone else)')
    graph.wait_until(lambda: (typist.type(b't', look_on=True), taken)[1])
    assert not bridge.takeoffs


def test_a_gamepad_flies_until_it_is_silent_or_held(graph: Graph, typist: Typist) -> None:
    bridge = MockBridge(graph, square(), in_air=True)
    joy = graph.publisher('joy', Joy, qos.COMMAND)

    def pushed() -> bool:
        joy.publish(Joy(axes=[-0.9, 0.5, 0.0, 0.0, 0.0]))
        return any(c.twist.linear.x for c in bridge.commands)

    typist.wait_to_see('flying')
    graph.wait_until(pushed, what='commands of the gamepad')
    assert {c.twist.linear.y for c in bridge.commands} == {0.0}, 'a diagonal is the direction wanted most'
    graph.wait_until(lambda: bridge.commands[-1].twist.linear.x == 0.0, what='zero velocity without a message')
    typist.type(b' ')
    sent = len(bridge.commands)
    graph.wait_until(lambda: len(bridge.commands) > sent + 3, what='zeros of hold')
    sent = len(bridge.commands)
    graph.wait_until(lambda: (pushed(), len(bridge.commands) > sent + 5)[1], what='zeros beside a pressed stick')
    assert not any(c.twist.linear.x for c in bridge.commands[sent:])


def test_keys_fly_record_and_land(graph: Graph, typist: Typist) -> None:
    grid = square()
    bridge = MockBridge(graph, grid, speedup=5.0, in_air=False)
    recorded: list[str] = []

    def recorder(name: str) -> None:
        def reply(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            recorded.append(name)
            response.success = True
            return response

        graph.node.create_service(Trigger, f'recorder/{name}', reply)

    recorder('start')
    recorder('stop')
    typist.wait_to_see('ready, t takes off')
    graph.wait_until(lambda: (typist.type(b't', look_on=True), bridge.takeoffs)[1])
    typist.wait_to_see('cell [0, 0], next waypoint [2, 0]')
    typist.type(b'r')
    typist.wait_to_see('RECORDING')
    graph.wait_until(lambda: (typist.type(RIGHT, look_on=True), typist.sees('cell [2, 0], next waypoint [2, 2]'))[1])
    assert bridge.commands[-1].header.frame_id == 'map'
    moving = [c.twist.linear for c in bridge.commands if c.twist.linear.x]
    assert moving and all((v.x, v.y, v.z) == (1.0, 0.0, 0.0) for v in moving)
    graph.wait_until(lambda: bridge.commands[-1].twist.linear.x == 0.0, what='zero velocity after the key')
    typist.type(UP)
    graph.wait_until(lambda: any(c.twist.linear.y == 1.0 for c in bridge.commands))
    typist.type(b'w')
    graph.wait_until(lambda: any(c.twist.linear.z == 0.5 for c in bridge.commands))
    typist.type(b' ')
    graph.wait_until(lambda: bridge.commands[-1].twist.linear.z == 0.0)
    typist.type(b'r')
    graph.wait_until(lambda: recorded == ['start', 'stop'])
    typist.type(b'l')
    graph.wait_until(lambda: bridge.landings)
    typist.type(b'q')
    assert typist.ends() == 0
    assert typist.settings() == typist.before


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_the_terminal_is_put_back(graph: Graph, typist: Typist, number: int) -> None:
    typist.wait_to_see('no pose yet')
    assert typist.settings() != typist.before
    typist.popen.send_signal(number)
    assert typist.ends() == 0
    assert typist.settings() == typist.before


def test_without_a_terminal_it_says_so(graph: Graph) -> None:
    teleop = graph.run('teleop')
    assert teleop.popen.returncode == 2
    assert 'standard input is no terminal' in teleop.text
    assert 'Traceback' not in teleop.text

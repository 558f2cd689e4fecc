"""teleop in a terminal of its own (a pseudo-terminal), against a vehicle of plain arithmetic."""

import os
import pty
import signal
import subprocess
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from std_srvs.srv import Trigger

from advise_ros.recording.gridfile import grid_to_mapping
from support.graph import Graph
from support.mock_bridge import MockBridge
from support.policies import square
from support.processes import executable, ros_arguments

UP, RIGHT = b'\x1b[A', b'\x1bOC'


class Typist:
    """teleop in a pseudo-terminal; `screen` is all that it wrote there."""

    def __init__(self, graph: Graph, params: dict[str, object]) -> None:
        self._graph = graph
        self._master, self._slave = pty.openpty()
        os.set_blocking(self._master, False)
        self.before = termios.tcgetattr(self._slave)
        self.screen = ''
        self.popen = subprocess.Popen(
            [executable('teleop'), *ros_arguments(params, {}, '')], env=graph.env, start_new_session=True,
            stdin=self._slave, stdout=self._slave, stderr=self._slave,
        )

    def sees(self, text: str) -> bool:
        try:
            while chunk := os.read(self._master, 65536):
                self.screen += chunk.decode(errors='replace')
        except BlockingIOError:
            pass
        assert self.popen.poll() in (None, 0), self.screen
        return text in self.screen

    def wait_to_see(self, text: str) -> None:
        self.screen = ''
        self._graph.wait_until(lambda: self.sees(text), what=f'{text!r} on the screen')

    def type(self, keys: bytes) -> None:
        os.write(self._master, keys)

    def settings(self) -> list[object]:
        return termios.tcgetattr(self._slave)

    def close(self) -> None:
        if self.popen.poll() is None:
            self.popen.kill()
        self.popen.wait(10)
        os.close(self._master)
        os.close(self._slave)


@pytest.fixture
def typist(graph: Graph, tmp_path: Path) -> Iterator[Typist]:
    path = tmp_path / 'grid.yaml'
    path.write_text(yaml.safe_dump({'grid': grid_to_mapping(square())}))
    typist = Typist(graph, {'grid_file': str(path)})
    try:
        yield typist
    finally:
        typist.close()


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
    graph.wait_until(lambda: (typist.type(b't'), bridge.takeoffs)[1])
    typist.wait_to_see('cell [0, 0], next waypoint [2, 0]')
    typist.type(b'r')
    typist.wait_to_see('RECORDING')
    graph.wait_until(lambda: (typist.type(RIGHT), typist.sees('cell [2, 0], next waypoint [2, 2]'))[1])
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
    assert typist.popen.wait(10) == 0
    assert typist.settings() == typist.before


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_the_terminal_is_put_back(graph: Graph, typist: Typist, number: int) -> None:
    typist.wait_to_see('no pose yet')
    assert typist.settings() != typist.before
    typist.popen.send_signal(number)
    assert typist.popen.wait(10) == 0
    assert typist.settings() == typist.before


def test_without_a_terminal_it_says_so(graph: Graph) -> None:
    teleop = graph.run('teleop')
    assert teleop.popen.returncode == 2
    assert 'standard input is no terminal' in teleop.text
    assert 'Traceback' not in teleop.text

"""The test harness itself: what it promises must hold, or the tests that build on it prove little."""

import os
import re
import signal
import sys
import threading
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from std_srvs.srv import Trigger

from advise_ros.ros.background import BackgroundSpin
from support.graph import Graph
from support.parameters import parameter
from support.paths import ROOT
from support.processes import Process, living_in_group, ros_arguments

GRID = str(ROOT / 'config' / 'grid_6x6.yaml')
# Executable -> what it has to be given; teleop needs a terminal, and test_teleop.py starts it in one.
NODES: dict[str, dict[str, str | int]] = {
    'advise': {'grid_file': GRID}, 'console': {'port': 0}, 'expert': {}, 'guard': {'fence': 'off'},
    'logger': {'bag': '{tmp_path}/bag'}, 'mavlink_bridge': {'url': 'udpin:127.0.0.1:{free_udp_port}', 'fence': 'off'},
    'pilot': {'grid_file': GRID}, 'policy': {}, 'recorder': {'grid_file': GRID}, 'simulator': {},
}

ECHO = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger
rclpy.init()
node = Node('echo')
back = node.create_publisher(String, 'back', 10)
node.create_subscription(String, 'forth', back.publish, 10)
node.create_service(Trigger, 'hello', lambda request, response: Trigger.Response(success=True, message='here'))
try:
    rclpy.spin(node)
except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    pass
"""


def test_topics_and_services_reach_a_process_and_back(graph: Graph) -> None:
    echo = graph.start_command('echo', [sys.executable, '-c', ECHO])
    back = graph.listen('back', String)
    forth = graph.publisher('forth', String, QoSProfile(depth=10))
    graph.wait_until(lambda: graph.node.count_publishers('back') == 1)
    assert graph.call(Trigger, 'hello').message == 'here'
    for word in ('one', 'two', 'three'):
        forth.publish(String(data=word))
    assert graph.wait_for('back', String, lambda m: m.data == 'three').data == 'three'
    assert [m.data for m in back] == ['one', 'two', 'three']
    assert echo.running


def test_a_process_that_fails_ends_the_wait_with_its_last_lines(graph: Graph) -> None:
    graph.start_command('broken', [sys.executable, '-c', 'import sys; sys.exit("error: no such grid")'])
    with pytest.raises(AssertionError, match=r'while waiting for a String on never(.|\n)*error: no such grid'):
        graph.wait_for('never', String)
    graph.processes[0].wait_exit()  # Known now, so it does not fail this test.


def test_what_does_not_stop_is_killed_and_told_of(graph: Graph) -> None:
    deaf = 'import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); print("on", flush=True); time.sleep(60)'
    process = graph.start_command('deaf', [sys.executable, '-c', deaf])
    graph.wait_until(lambda: process.out == ['on'])
    assert 'did not stop' in process.end(patience_s=0.3)
    assert not living_in_group(process.pid)


def test_children_that_are_left_behind_are_killed_and_told_of(graph: Graph) -> None:
    parent = 'import subprocess; subprocess.Popen(["sleep", "60"]); print("on", flush=True)'
    process = graph.start_command('parent', [sys.executable, '-c', parent])
    graph.wait_until(lambda: not process.running)
    assert 'left processes' in process._end_children(patience_s=0.2)
    assert not living_in_group(process.pid)


def test_parameters_keep_their_types_on_the_command_line() -> None:
    words = ros_arguments({'url': 'udpin:127.0.0.1:1', 'rate_hz': 20.0, 'on': True, 'text': '12'}, {'pose': 'p2'}, '/a')
    assert words == [
        '--ros-args', '-p', 'url:="udpin:127.0.0.1:1"', '-p', 'rate_hz:=20.0', '-p', 'on:=true', '-p', 'text:="12"',
        '-r', 'pose:=p2', '-r', '__ns:=/a',
    ]  # fmt: skip

def test_a_thread_that_spins_ends_before_its_executor(graph: Graph) -> None:
    """An executor that is shut down under a thread that waits in it makes the thread fail, which fails a test."""
    for number in range(20):
        node = Node(f'busy_{number}', context=graph.context, enable_rosout=False, start_parameter_services=False)
        executor = SingleThreadedExecutor(context=graph.context)
        executor.add_node(node)
        turned = threading.Event()
        node.create_timer(0.0005, turned.set)
        spin = BackgroundSpin(executor, node.get_name())
        assert turned.wait(20.0)
        spin.stop()
        assert node.get_name() not in {thread.name for thread in threading.enumerate()}
        node.destroy_node()


# -- forked and fresh -------------------------------------------------------------------------
def is_up(graph: Graph, name: str) -> None:
    assert parameter(graph, name, 'use_sim_time') is False


@pytest.mark.parametrize('fresh', [True, False])
@pytest.mark.parametrize('name', NODES)
def test_each_node_starts_and_ends(graph: Graph, tmp_path: Path, free_udp_port: int, name: str, fresh: bool) -> None:
    """A whole start of each executable, whatever other tests fork."""
    places = {'tmp_path': tmp_path, 'free_udp_port': free_udp_port}
    given = {key: value.format(**places) if isinstance(value, str) else value for key, value in NODES[name].items()}
    process = (graph.start_fresh if fresh else graph.start)(name, given)
    is_up(graph, name)
    server = Path(f'/proc/{process.pid}/cmdline').read_text().split('\0')
    assert any(word.endswith('forking.py') for word in server) != fresh
    assert process.terminate() == 0, process.describe()
    assert 'Traceback' not in process.text


def as_the_kernel_sees_it(process: Process) -> tuple[object, ...]:
    """Session, process group, signals, directory and streams of a process."""
    status = Path(f'/proc/{process.pid}/status').read_text()
    folder = Path(f'/proc/{process.pid}')
    return (
        os.getsid(process.pid) == process.pid, os.getpgid(process.pid) == process.pid,
        re.findall(r'^Sig(?:Blk|Ign|Cgt):.*$', status, re.MULTILINE), re.findall('^Umask:.*$', status, re.MULTILINE),
        (folder / 'cwd').readlink(), [(folder / 'fd' / str(number)).readlink().name.split(':')[0] for number in range(3)],
        len(list((folder / 'fd').iterdir())),
    )


def test_a_forked_node_differs_from_a_fresh_one_in_nothing_that_tests_look_at(graph: Graph) -> None:
    graph.start('guard', {'fence': 'off'}, remaps={'__node': 'before'})  # The forked one has an elder sister.
    is_up(graph, 'before')
    seen = []
    for start in (graph.start_fresh, graph.start):
        process = start('guard', {'fence': 'off'})
        graph.wait_for('/diagnostics', DiagnosticArray, lambda array: array.status[0].name == '/guard', new=True)
        there = as_the_kernel_sees_it(process)
        process.kill()
        killed = process.popen.returncode
        wrong = start('guard', args=['--sped'])
        seen.append((there, killed, wrong.wait_exit(), wrong.out, wrong.err))
    fresh, forked = seen
    assert forked == fresh
    assert forked[1:3] == (-signal.SIGKILL, 2)


def test_what_is_read_while_importing_is_never_shared(graph: Graph) -> None:
    graph.start('guard', {'fence': 'off'})
    process = graph.start('guard', {'fence': 'off'}, env={'OPENBLAS_NUM_THREADS': '1'}, remaps={'__node': 'alone'})
    is_up(graph, 'alone')
    assert b'OPENBLAS_NUM_THREADS=1' in Path(f'/proc/{process.pid}/environ').read_bytes()

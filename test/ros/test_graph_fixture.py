"""The test harness itself: what it promises must hold, or the tests that build on it prove little."""

import sys
import threading

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from std_srvs.srv import Trigger

from advise_ros.ros.background import BackgroundSpin
from support.graph import Graph
from support.processes import living_in_group, ros_arguments

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

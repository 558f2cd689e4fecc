"""The logger beside real publishers: nothing lost, profiles kept, clean ends, and no harm to others."""

import json
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import McapRecord, Message
from mcap.stream_reader import StreamReader
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String
from std_srvs.srv import Trigger

from advise_msgs.msg import LearnerStatus
from advise_ros.demo.options import share
from advise_ros.recording.bagrecords import RECORDS_TOPIC
from advise_ros.recording.messages import Bag
from advise_ros.recording.recover import is_whole
from advise_ros.ros import qos
from advise_ros.ros.subscriptions import RawSubscriptions, as_recorded
from support.graph import Graph
from support.processes import Process, executable, ros_arguments

ANY = ['geometry_msgs/msg/PoseStamped', 'advise_msgs/msg/LearnerStatus', 'std_msgs/msg/String']


def start(graph: Graph, bag: Path, **more: Any) -> Process:
    """A logger that is up: it tells of itself."""
    params = {'bag': str(bag), 'flush_s': 0.1, **more.pop('params', {})}
    logger = graph.start('logger', params=params, **more)
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: says(m, 'recording into'))
    return logger


def says(array: DiagnosticArray, words: str) -> bool:
    return any(status.name.endswith('/logger') and words in status.message for status in array.status)


def pose(number: int) -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id, message.header.stamp.sec = 'map', number
    return message


def poses(graph: Graph, numbers: range) -> None:
    """Publish poses with these numbers as stamps, after some with number 0 that make sure of the connection."""
    publisher = graph.publisher('pose', PoseStamped, qos.SENSOR)
    until(graph, lambda: publisher.publish(pose(0)), lambda counts: counts.get('/pose', 0) > 0)
    for number in numbers:
        publisher.publish(pose(number))


def until(graph: Graph, act: Callable[[], None], enough: Callable[[dict[str, int]], bool]) -> None:
    """Do something again and again until the logger's counts by topic are enough."""
    heard = graph.listen('/diagnostics', DiagnosticArray)

    def done() -> bool:
        act()
        status = next((s for array in reversed(heard) for s in array.status if s.name.endswith('/logger')), None)
        return status is not None and enough({pair.key: int(pair.value) for pair in status.values if pair.key.startswith('/')})

    graph.wait_until(done, what='the logger to count its messages')


def recorded(graph: Graph, topic: str, count: int) -> None:
    """Wait until the logger says that it has so many messages of a topic."""
    until(graph, lambda: None, lambda counts: counts.get(topic, 0) >= count)


def stop(logger: Process) -> int:
    logger.signal(signal.SIGINT)
    return logger.wait_exit()


def numbers(bag: Bag, topic: str) -> list[int]:
    """Numbers of the poses but those that made sure of the connection."""
    stamps = [bag.decode(message).header.stamp.sec for message in bag.on(topic)]
    return [number for number in stamps if number]


def test_a_session_is_recorded_whole(graph: Graph, tmp_path: Path) -> None:
    """Latched messages from before, poses, profiles and the parameters of nodes; SIGINT ends it."""
    graph.node.create_publisher(LearnerStatus, 'advise/status', qos.latched()).publish(LearnerStatus(message='before'))
    expert = graph.start('guard', {'fence': 'off'})
    logger = start(graph, tmp_path / 'bag')
    strange = graph.node.create_publisher(String, 'words', qos.latched())
    poses(graph, range(1, 101))
    recorded(graph, '/pose', 101)
    recorded(graph, '/advise/status', 1)
    graph.wait_until(lambda: b'parameters /guard' in (tmp_path / 'bag' / 'bag_0.mcap').read_bytes())
    assert expert.running
    assert stop(logger) == 0
    bag = Bag(tmp_path / 'bag', ANY)
    assert numbers(bag, '/pose') == list(range(1, 101))
    assert [bag.decode(message).message for message in bag.on('/advise/status')] == ['before']
    assert '/clock' not in bag.topics
    records = {record.name: record.values for record in bag.records}
    assert json.loads(records['parameters /guard']['max_speed_m_s']) == 3.0
    assert records['not recorded']['/words'] == 'std_msgs/msg/String' and strange is not None
    assert any('not recorded, as nobody asked for it by -p topics: ' in line and '/words' in line for line in logger.out)
    assert {'/pose', '/guard/cmd_vel', '/guard/pose', '/diagnostics'}.isdisjoint(records['not recorded'])
    assert json.loads(records['parameters /logger']['bag']) == str(tmp_path / 'bag')
    assert records['platform']['numpy']
    with AnyReader([tmp_path / 'bag']) as reader:
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
        offered = {connection.topic: connection.ext.offered_qos_profiles[0] for connection in reader.connections}
    assert offered['/advise/status'].durability is QosDurability.TRANSIENT_LOCAL
    assert offered['/pose'].reliability is QosReliability.BEST_EFFORT


def test_a_node_that_is_started_again_before_the_old_one_is_gone_gives_its_parameters_too(graph: Graph, tmp_path: Path) -> None:
    old = graph.start('guard', {'fence': 'off', 'max_speed_m_s': 1.0})
    logger = start(graph, tmp_path / 'bag')
    file = tmp_path / 'bag' / 'bag_0.mcap'
    graph.wait_until(lambda: file.read_bytes().count(b'parameters /guard') == 1)
    old.kill()
    graph.start('guard', {'fence': 'off', 'max_speed_m_s': 2.0})
    graph.wait_until(lambda: file.read_bytes().count(b'parameters /guard') == 2)
    assert stop(logger) == 0
    told = [record.values for record in Bag(tmp_path / 'bag', ANY).records if record.name == 'parameters /guard']
    assert [json.loads(values['max_speed_m_s']) for values in told] == [1.0, 2.0]


def test_topics_by_pattern_that_appear_later(graph: Graph, tmp_path: Path) -> None:
    """In the logger's namespace; what does not match and types that are not installed stay out."""
    logger = start(graph, tmp_path / 'bag', params={'topics': 'words/*, /elsewhere'}, namespace='/drone')
    for topic in ('/drone/words/one', '/elsewhere', '/drone/other'):
        publisher = graph.node.create_publisher(String, topic, qos.latched())
        publisher.publish(String(data=topic))
    recorded(graph, '/elsewhere', 1)
    recorded(graph, '/drone/words/one', 1)
    assert logger.terminate() == 0
    bag = Bag(tmp_path / 'bag', ANY)
    assert {message.topic: bag.decode(message).data for message in bag.messages} == {
        '/drone/words/one': '/drone/words/one', '/elsewhere': '/elsewhere',
    }


def test_a_name_that_is_remapped_is_recorded_where_it_leads(graph: Graph, tmp_path: Path) -> None:
    logger = start(graph, tmp_path / 'bag', params={'topics': 'words'}, remaps={'words': '/elsewhere/words'})
    publisher = graph.node.create_publisher(String, '/elsewhere/words', qos.latched())
    publisher.publish(String(data='there'))
    recorded(graph, '/elsewhere/words', 1)
    assert stop(logger) == 0
    assert list(Bag(tmp_path / 'bag', ANY).topics) == ['/elsewhere/words', RECORDS_TOPIC]


def test_a_publisher_with_a_weaker_profile_is_recorded_too(graph: Graph, tmp_path: Path) -> None:
    logger = start(graph, tmp_path / 'bag')
    weak = graph.node.create_publisher(LearnerStatus, 'advise/status', qos.SENSOR)
    graph.wait_until(lambda: weak.get_subscription_count() == 1, what='the logger to come down to what is offered')
    until(graph, lambda: weak.publish(LearnerStatus(message='weak')), lambda counts: counts.get('/advise/status', 0) > 0)
    assert stop(logger) == 0
    bag = Bag(tmp_path / 'bag', ANY)
    assert {bag.decode(message).message for message in bag.on('/advise/status')} == {'weak'}


def test_messages_of_several_topics_keep_the_order_of_their_arrival(graph: Graph, tmp_path: Path) -> None:
    logger = start(graph, tmp_path / 'bag', params={'topics': 'words/*'})
    publishers = [graph.node.create_publisher(String, f'words/{name}', qos.latched(500)) for name in 'cab']
    graph.wait_until(lambda: all(one.get_subscription_count() == 1 for one in publishers), what='the logger to match')
    for publisher in publishers:  # Each is heard before the order counts.
        publisher.publish(String(data='-1'))
    for topic in ('/words/a', '/words/b', '/words/c'):
        recorded(graph, topic, 1)
    for number in range(300):
        publishers[number % 3].publish(String(data=str(number)))
    recorded(graph, '/words/b', 101)
    assert stop(logger) == 0
    bag = Bag(tmp_path / 'bag', ANY)
    heard = [int(bag.decode(message).data) for message in bag.messages]
    assert [number for number in heard if number >= 0] == list(range(300))
    times = [message.log_time_ns for message in bag.messages]
    assert times == sorted(times)


def test_log_times_are_simulated_times(graph: Graph, tmp_path: Path) -> None:
    logger = start(graph, tmp_path / 'bag', params={'use_sim_time': True})
    clock = graph.publisher('/clock', Clock, QoSProfile(depth=10))
    publisher = graph.publisher('pose', PoseStamped, qos.SENSOR)
    heard = graph.listen('/diagnostics', DiagnosticArray)
    sent: list[int] = []

    def told(now: Clock) -> bool:
        clock.publish(now)
        return any(says(array, 'recording') and array.header.stamp == now.clock for array in heard)

    def send(number: int) -> None:
        sent.append(number)
        publisher.publish(pose(number))

    for second in (100, 200):
        graph.wait_until(partial(told, Clock(clock=Time(sec=second))), what='the logger to take up the time')
        before = len(sent)  # More than these: one at least is of this second.
        until(graph, partial(send, second), lambda counts, known=before: counts.get('/pose', 0) > known)
    assert stop(logger) == 0
    bag = Bag(tmp_path / 'bag', ANY)
    times = {(bag.decode(message).header.stamp.sec, message.log_time_ns) for message in bag.on('/pose')}
    assert {(100, 100 * 10**9), (200, 200 * 10**9)} <= times <= {(100, 100 * 10**9), (100, 200 * 10**9), (200, 200 * 10**9)}
    assert all(message.publish_time_ns > 10**18 for message in bag.on('/pose'))


def whole_records(file: Path) -> Iterator[McapRecord]:
    """Records of a file that ends in the middle of one."""
    with file.open('rb') as stream, suppress(EndOfFile):
        yield from StreamReader(stream).records


def test_what_was_flushed_survives_kill(graph: Graph, tmp_path: Path) -> None:
    logger = start(graph, tmp_path / 'bag')
    poses(graph, range(1, 51))
    recorded(graph, '/pose', 51)
    logger.kill()
    kept = sum(isinstance(record, Message) for record in whole_records(tmp_path / 'bag' / 'bag_0.mcap'))
    assert kept >= 51
    metadata = (tmp_path / 'bag' / 'metadata.yaml').read_text()
    assert 'name: /pose' in metadata


def test_a_full_disk_raises_one_alarm_and_harms_nobody(graph: Graph, tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk."""
    arguments = ros_arguments({'bag': str(tmp_path / 'bag'), 'flush_s': 0.1, 'compression': 'none'}, {}, '')
    alarms = graph.listen('/diagnostics', DiagnosticArray)
    logger = graph.start_command('logger', ['sh', '-c', 'ulimit -f 120; exec "$@"', 'sh', executable('logger'), *arguments])
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: says(m, 'recording into'))
    poses(graph, range(1, 501))
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: says(m, 'stopped: File too large; free some space'))
    graph.publisher('pose', PoseStamped, qos.SENSOR).publish(pose(501))
    said = {status.message for array in alarms for status in array.status if status.level == DiagnosticStatus.ERROR}
    assert len(said) == 1
    assert logger.running
    assert stop(logger) == 1
    assert sum('stopped' in line for line in logger.err) == 1  # All that it wrote is there only after its end.


@pytest.mark.parametrize(('params', 'words'), [
    ({'bag': ''}, "parameter 'bag' is empty"),
    ({'bag': '{tmp}'}, 'exists already; name a new directory'),
    ({'bag': '{tmp}/bag', 'flush_s': 0.0}, "parameter 'flush_s' is 0.0; allowed: 0.05 to 60"),
    ({'bag': '{tmp}/bag', 'compresion': 'none'}, "did you mean 'compression'"),
])  # fmt: skip
def test_wrong_parameters_are_one_sentence(graph: Graph, tmp_path: Path, params: dict[str, Any], words: str) -> None:
    values = {key: value.replace('{tmp}', str(tmp_path)) if isinstance(value, str) else value for key, value in params.items()}
    logger = graph.run('logger', params=values)
    assert logger.popen.returncode == 2
    errors = [line for line in logger.err if line.startswith('error: ')]
    assert len(errors) == 1 and words in errors[0]
    assert 'Traceback' not in '\n'.join(logger.err)


def test_what_services_tell_of_their_calls_is_recorded_once_it_is_turned_on(graph: Graph, tmp_path: Path) -> None:
    logger = start(graph, tmp_path / 'bag')
    grid = {'grid_file': str(share('grid_6x6.yaml'))}
    graph.start('recorder', params={**grid, 'service_introspection': 'contents'})
    topic = '/recorder/stop/_service_event'
    graph.wait_until(lambda: graph.node.count_subscribers(topic) == 1, what='the logger to hear of the service')
    until(graph, lambda: graph.call(Trigger, 'recorder/stop'), lambda counts: counts.get(topic, 0) > 1)
    assert stop(logger) == 0
    with (tmp_path / 'bag' / 'bag_0.mcap').open('rb') as stream:
        entries = list(make_reader(stream).iter_messages([topic]))
    found = [(schema.name, message.data) for schema, _, message in entries]
    assert all(channel.metadata['topic_type_hash'].startswith('RIHS01_') for _, channel, _ in entries)
    assert {name for name, _ in found} == {'std_srvs/srv/Trigger_Event'}
    told = [deserialize_message(data, Trigger.Event) for _, data in found]
    answers = [event.response[0] for event in told if len(event.response)]
    assert answers and 'nothing is being recorded' in answers[0].message and not answers[0].success
    assert all(any(event.info.client_gid) for event in told)
    with AnyReader([tmp_path / 'bag']) as reader:  # Others' readers are not put off by a type that they cannot read.
        assert any(connection.topic == topic for connection in reader.connections)


def test_files_are_split_by_size_and_time(graph: Graph, tmp_path: Path) -> None:
    logger = start(graph, tmp_path / 'bag', params={'split_s': 0.3})
    publisher = graph.publisher('pose', PoseStamped, qos.SENSOR)
    graph.wait_until(lambda: publisher.publish(pose(1)) or len(list((tmp_path / 'bag').glob('*.mcap'))) > 2)
    assert stop(logger) == 0
    with AnyReader([tmp_path / 'bag']) as reader:
        assert reader.message_count > 2
    assert Bag(tmp_path / 'bag', ANY).gaps == []
    assert {'bag_0.mcap', 'bag_1.mcap', 'bag_2.mcap'} <= {file.name for file in (tmp_path / 'bag').iterdir()}


def test_a_topic_that_begins_when_ros_is_gone_has_the_profile_that_was_asked_for(graph: Graph) -> None:
    context = Context()
    rclpy.init(context=context, domain_id=graph.domain_id, signal_handler_options=SignalHandlerOptions.NO)
    incoming = RawSubscriptions(Node('ended', context=context), [], {'pose': ('geometry_msgs/msg/PoseStamped', qos.SENSOR)})
    context.shutdown()
    assert incoming.offers('/pose') == [as_recorded(qos.SENSOR)]


def test_too_little_space_ends_the_bag_properly_and_raises_an_alarm(graph: Graph, tmp_path: Path) -> None:
    free_mib = shutil.disk_usage(tmp_path).free // 2**20
    params = {'bag': str(tmp_path / 'bag'), 'flush_s': 0.1, 'min_free_mib': min(2 * free_mib, 2**20)}
    logger = graph.start('logger', params=params)
    graph.wait_for('/diagnostics', DiagnosticArray, lambda m: says(m, 'are free on its disk'))
    assert logger.running and is_whole(tmp_path / 'bag' / 'bag_0.mcap')
    assert stop(logger) == 1
    assert sum('stopped: only' in line for line in logger.err) == 1


@pytest.mark.usefixtures('ros_env')
def test_what_came_last_is_recorded_when_the_ros_context_is_gone() -> None:
    """A signal ends the context at once, and the first message of a topic may still be on its way into the bag."""
    context = Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = Node('ending', context=context)
    incoming = RawSubscriptions(node, ['words'], {'words': ('std_msgs/msg/String', qos.latched())})
    context.try_shutdown()
    assert incoming.offers('/words') == [as_recorded(qos.latched())]
    node.destroy_node()

"""Recorded sessions in other people's tools, the layout for Foxglove, and the workflow in the docs."""

import json
import re

import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from std_srvs.srv import Trigger

from advise_msgs.srv import AnswerQuery, PreviewAnswer
from advise_ros.recording.messages import Bag
from advise_ros.ros.subscriptions import message_class
from advise_ros.ros.topics import RECORDED
from support.paths import ROOT

WHOLE = ('simulated_session', 'arducopter_session', 'contradictory_answers')


@pytest.mark.parametrize('name', WHOLE)
def test_shipped_sessions_open_in_rosbags_and_mcap_and_give_the_same(name: str) -> None:
    bag = ROOT / 'bags' / name
    ours = [one for one in Bag(bag, ['advise_msgs/msg/Policy']).messages if one.topic == '/advise/policy']
    with AnyReader([bag]) as reader:
        wanted = [connection for connection in reader.connections if connection.topic == '/advise/policy']
        theirs = [reader.deserialize(raw, c.msgtype).digest for c, _, raw in reader.messages(wanted)]
        assert reader.message_count == Bag(bag, []).count
    with next(bag.glob('*.mcap')).open('rb') as stream:
        found = make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages(['/advise/policy'])
        assert [message.digest for *_, message in found] == theirs
    assert len(theirs) == len(ours) >= 1


def test_the_session_of_all_nodes_keeps_what_publishers_offered() -> None:
    with AnyReader([ROOT / 'bags' / 'simulated_session']) as reader:
        offered = {c.topic: c.ext.offered_qos_profiles[0].durability.name for c in reader.connections}
    assert offered['/advise/policy'] == offered['/demonstration'] == 'TRANSIENT_LOCAL'
    assert offered['/pose'] == offered['/cmd_vel'] == 'VOLATILE'


def test_the_layout_names_what_there_is() -> None:
    layout = json.loads((ROOT / 'config' / 'foxglove.json').read_text())
    panels = layout['configById']
    assert set(re.findall(r'"((?:\w+|3D)!\w+)"', json.dumps(layout['layout']))) == set(panels)
    topics = {name for panel in panels.values() for name in panel.get('topics', {})}
    assert {topic.lstrip('/') for topic in topics} <= set(RECORDED)
    for name, service in (('answer', AnswerQuery), ('preview', PreviewAnswer), ('hold', Trigger), ('undo', Trigger)):
        request = json.loads(panels[f'CallService!{name}']['requestPayload'])
        assert set(request) == set(service.Request.get_fields_and_field_types())


def test_panels_of_the_layout_show_fields_that_there_are() -> None:
    panels = json.loads((ROOT / 'config' / 'foxglove.json').read_text())['configById']
    assert {name.split('!')[0] for name in panels} == {'3D', 'RawMessages', 'CallService', 'Plot'}
    plots = [panel for name, panel in panels.items() if name.startswith('Plot!')]
    paths = [panel['topicPath'] for panel in panels.values() if 'topicPath' in panel]
    paths += [one['value'] for plot in plots for one in (*plot['paths'], *([plot['xAxisPath']] if 'xAxisPath' in plot else []))]
    for path in paths:
        topic, *fields = path.lstrip('/').split('.')
        assert _has(message_class(RECORDED[topic][0])(), fields), path


# Displays of RViz's default plugins, and the type that each shows.
DISPLAYS = {
    'Map': 'nav_msgs/msg/OccupancyGrid', 'Path': 'nav_msgs/msg/Path', 'MarkerArray': 'visualization_msgs/msg/MarkerArray',
    'Marker': 'visualization_msgs/msg/Marker', 'Pose': 'geometry_msgs/msg/PoseStamped',
}


def test_the_view_of_rviz_shows_topics_that_there_are_by_profiles_that_match() -> None:
    view = yaml.safe_load((ROOT / 'config' / 'advise.rviz').read_text())['Visualization Manager']
    shown = [one for one in view['Displays'] if 'Topic' in one]
    assert {one['Class'].split('/')[1] for one in shown} == set(DISPLAYS)
    for display in shown:
        topic = display['Topic']
        kind, profile = RECORDED[topic['Value']]
        assert kind == DISPLAYS[display['Class'].split('/')[1]], display['Name']
        assert topic['Durability Policy'].upper().replace(' ', '_') == profile.durability.name, display['Name']
        assert topic['Reliability Policy'].upper().replace(' ', '_') == profile.reliability.name, display['Name']


def test_both_views_show_the_same_pictures() -> None:
    view = yaml.safe_load((ROOT / 'config' / 'advise.rviz').read_text())['Visualization Manager']
    layout = json.loads((ROOT / 'config' / 'foxglove.json').read_text())['configById']['3D!advise']['topics']
    displayed = {one['Topic']['Value'] for one in view['Displays'] if 'Topic' in one}
    assert displayed == {topic.lstrip('/') for topic in layout} - {'odom'}


def _has(message: object, fields: list[str]) -> bool:
    for name in fields:
        message = getattr(message, name, None)
    return message is not None


def test_the_workflow_in_the_docs_is_one() -> None:
    text = (ROOT / 'docs' / 'replay.md').read_text()
    (workflow,) = re.findall(r'```yaml\n(.*?)```', text, re.DOTALL)
    steps = yaml.safe_load(workflow)['jobs']['replay']['steps']
    assert any('./advise replay' in step.get('run', '') for step in steps)

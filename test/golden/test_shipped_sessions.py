"""The recorded sessions that ship replay, by the fixture that others use for theirs; and the fixture itself."""

import re
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader

from advise_ros.recording import platform
from advise_ros.recording.codec import Codec
from advise_ros.recording.definitions import definition
from advise_ros.recording.messages import Bag
from advise_ros.recording.writer import BagWriter
from advise_ros.replay.pytest_plugin import AdviseBag
from advise_ros.replay.session import QUERY_TYPE
from support.paths import ROOT
from support.session_bag import session_bag

pytest_plugins = ('pytester',)


# Sources are under work between two releases; what they compute must not change unseen.
OF_SOURCES = ('advise_ros', 'core')
AGAIN = 'the cores or the messages have changed: make the sessions again by ./advise python bags/make_sessions.py'


def test_replay(advise_bag: AdviseBag) -> None:
    """Equal byte for byte by the packages and on the kind of machine that the bags were made by, elsewhere equal in decisions."""
    report = advise_bag.check()
    stages = {stage.name: stage for stage in report.stages}
    assert min(stages[name].checked for name in ('demonstrations', 'policies', 'queries')) >= 1
    assert not report.session.missing, AGAIN
    here = platform.describe()
    if all(value == here[name] for name, value in report.session.made_on.items() if name not in OF_SOURCES):
        same, of = report.in_bytes
        assert same == of, f'{AGAIN}; {report.byte_verdict}'


def test_the_sessions_that_ship_are_these() -> None:
    names = ('simulated_session', 'arducopter_session', 'interrupted_session', 'contradictory_answers')
    readme = (ROOT / 'bags' / 'README.md').read_text()
    for name in names:
        assert (ROOT / 'bags' / name / 'metadata.yaml').is_file() and f'`{name}`' in readme
    assert sum(file.stat().st_size for file in (ROOT / 'bags').rglob('*') if file.is_file()) < 3e6


def notes(name: str) -> list[str]:
    return [note for stage in AdviseBag(ROOT / 'bags' / name).replay().stages for note in stage.notes]


@pytest.mark.parametrize('name', ['simulated_session', 'arducopter_session', 'contradictory_answers'])
def test_each_topic_is_played_as_it_was_offered(name: str) -> None:
    """`ros2 bag play` offers as volatile what a bag says nothing about, and nodes that want a latched topic get nothing of it."""
    with (ROOT / 'bags' / name / f'{name}_0.mcap').open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    offered = {channel.topic: yaml.safe_load(channel.metadata['offered_qos_profiles']) for channel in summary.channels.values()}
    assert all(offered.values())
    latched = [topic for topic, profiles in offered.items() if topic.endswith(('demonstration', 'policy', 'vehicle_status'))
               and profiles[0]['durability'] == 'transient_local']
    assert len(latched) == 3


def test_each_is_what_its_name_says() -> None:
    assert any('the recording was not finished' in note for note in notes('interrupted_session'))
    undecided = AdviseBag(ROOT / 'bags' / 'contradictory_answers').replay().session.on('advise/advice_log')
    said = [(list(one.value.preferred), list(one.value.avoided), set(one.value.states.tolist())) for one in undecided]
    assert any(a[0] == b[1] and a[2] & b[2] for a in said for b in said)
    assert AdviseBag(ROOT / 'bags' / 'simulated_session').replay().stages[-1].checked > 10


def test_a_bag_of_an_earlier_version_is_compared_by_its_decisions(tmp_path: Path) -> None:
    """Its questions have no fields that came later, and what it has must agree."""
    report = AdviseBag(of_earlier_version(ROOT / 'bags' / 'contradictory_answers', tmp_path / 'bag')).check()
    assert report.session.missing == ('AdviceQuery.disagreement', 'AdviceQuery.scarcity')
    assert 'equal decisions were asked' in report.asked and 'no AdviceQuery.disagreement' in report.asked
    stages = {stage.name: stage for stage in report.stages}
    assert stages['queries'].checked == stages['queries'].equal >= 5 and not stages['queries'].in_bytes
    assert stages['demonstrations'].in_bytes == stages['demonstrations'].checked


def of_earlier_version(bag: Path, target: Path) -> Path:
    """A copy whose AdviceQuery is as before U_c was divided further."""
    whole = Bag(bag, set(Bag(bag, ()).topics.values()))
    old, writer = Codec(), BagWriter(target)
    now = definition(QUERY_TYPE)
    before = now._replace(text=re.sub(r'^float32 (disagreement|scarcity)$', '', now.text, flags=re.MULTILINE), type_hash='')
    old.learn(QUERY_TYPE, 'ros2msg', before.text)
    topics = {
        topic: writer.add_topic(topic, before if kind == QUERY_TYPE else definition(kind)) for topic, kind in whole.topics.items()
    }
    for record in whole.records:
        if record.name != 'rosbag2':
            writer.add_record(record.name, record.values)
    for one in whole.messages:
        data = old.canonical(whole.decode(one), QUERY_TYPE) if one.type_name == QUERY_TYPE else one.data
        writer.write(topics[one.topic], one.log_time_ns, one.publish_time_ns, data)
    writer.close()
    return target


TEST = 'def test_session(advise_bag):\n    advise_bag.check()\n'


def test_each_bag_of_a_directory_is_a_test_case(pytester: pytest.Pytester) -> None:
    good, bad = session_bag(), session_bag()
    bad.entries[bad.where('/cmd_vel')[-6]][2].twist.linear.x += 1e-3
    good.write(pytester.path / 'recordings' / 'good')
    bad.write(pytester.path / 'recordings' / 'bad')
    pytester.makepyfile(TEST)
    arguments = ('-p', 'advise_ros.replay.pytest_plugin') if 'advise_ros' not in _entry_points() else ()
    result = pytester.runpytest_subprocess(*arguments, '-p', 'no:cacheprovider', '--advise-bags', 'recordings', '-v')
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(['*test_session?bad?*', '*does NOT follow*', 'commands: /cmd_vel at *expected*'])


def _entry_points() -> set[str]:
    from importlib.metadata import entry_points

    return {found.name for found in entry_points(group='pytest11')}


def test_a_directory_without_sessions_is_told(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(TEST)
    arguments = ('-p', 'advise_ros.replay.pytest_plugin') if 'advise_ros' not in _entry_points() else ()
    result = pytester.runpytest_subprocess(*arguments, '-p', 'no:cacheprovider')
    assert result.ret != 0
    result.stdout.fnmatch_lines(['*holds no recorded session; name another by --advise-bags*'])



"""A recorded session replays equal, and whatever is changed in its bag is found and named."""

import copy
import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from mcap.records import Channel, Metadata, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from rosbags.convert import convert

from advise_ros.commands import replay
from advise_ros.config import AdviseConfig
from advise_ros.recording.bagrecords import RECORDS_TOPIC
from advise_ros.recording.definitions import definition
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.replay import session
from support.paths import ROOT
from support.session_bag import GRID, SessionBag, session_bag

pytestmark = pytest.mark.usefixtures('learn_once')

Tamper = Callable[[SessionBag], None]


def verdict(bag: SessionBag, directory: Path) -> tuple[int, dict[str, dict], str]:
    """Exit code, stage -> values, and what was asked."""
    report = directory / 'report.json'
    code = replay.run([str(bag.write(directory / 'bag')), '--json', str(report)])
    values = json.loads(report.read_text())
    return code, {stage['name']: stage for stage in values['stages']}, values['asked']


def test_a_session_replays_byte_for_byte(bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, stages, asked = verdict(bag, tmp_path)
    assert (code, asked) == (0, 'bytes')
    assert all(stage['checked'] == stage['equal'] > 0 and not stage['difference'] for stage in stages.values())
    of_messages = {name for name, stage in stages.items() if stage['in_bytes'] == stage['checked']}
    assert of_messages == {'demonstrations', 'policies', 'queries', 'commands'}
    assert stages['policies']['checked'] == stages['queries']['checked'] == len(bag.where('/advise/policy')) == 3
    assert stages['demonstrations']['checked'] == stages['flight windows']['checked'] == 2
    pilots = len(bag.where('/cmd_vel')) - stages['commands']['checked']
    assert f'{pilots} commands of pilots' in stages['commands']['notes'][0]
    said = capsys.readouterr().out
    assert 'equal byte for byte' in said and 'follows from what the bag holds' in said


# -- somebody converted it -------------------------------------------------------------------------
FORMS = [('sqlite3', '', 'file'), ('mcap', '', 'file'), ('mcap', 'zstd', 'message')]


@pytest.mark.parametrize(('storage', 'compression', 'mode'), FORMS)
def test_a_converted_bag_replays_byte_for_byte_by_the_same_parameters(
    bag: SessionBag, tmp_path: Path, storage: str, compression: str, mode: str,
) -> None:
    """MOCK of `ros2 bag convert`: rosbags copies the messages, and like it no metadata records."""
    source, target = bag.write(tmp_path / 'bag'), tmp_path / 'converted'
    convert([source], target, storage, 9, compression or None, mode, None, None, [], [], [], [])
    assert not session.open_source(target).records
    report = tmp_path / 'report.json'
    assert replay.run([str(target), '--json', str(report)]) == 0
    assert json.loads(report.read_text())['asked'] == 'bytes'
    assert session.read_session(target).parameters == session.read_session(source).parameters


def test_a_bag_that_was_converted_without_its_records_says_so(
    bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    source, target = bag.write(tmp_path / 'bag'), tmp_path / 'converted'
    convert([source], target, 'sqlite3', 9, None, 'file', None, None, [RECORDS_TOPIC], [], [], [])
    assert replay.run([str(target)]) == 2
    assert 'if it was converted, replay the original, or convert /bag_records with it' in capsys.readouterr().err


# -- something was changed -------------------------------------------------------------------------
def move_pose_in_a_demonstration(bag: SessionBag) -> None:
    """Out of its cell, in the middle of the first flight."""
    index = bag.where('/pose')[40]
    bag.entries[index][2].pose.position.x += 20.0


def nudge_pose_of_the_policy(bag: SessionBag) -> None:
    """By a millimetre, in the last flight."""
    bag.entries[bag.where('/pose')[-5]][2].pose.position.y += 1e-3


def drop(topic: str, which: int) -> Tamper:
    def tamper(bag: SessionBag) -> None:
        del bag.entries[bag.where(topic)[which]]

    return tamper


def change(topic: str, which: int, field: str, index: int | None, value: object) -> Tamper:
    def tamper(bag: SessionBag) -> None:
        message = bag.entries[bag.where(topic)[which]][2]
        if index is None:
            setattr(message, field, value)
        else:
            getattr(message, field)[index] = value

    return tamper


def one_bit_of_a_value(bag: SessionBag) -> None:
    value = bag.entries[bag.where('/advise/policy')[2]][2].value
    value[5] = float(np.nextafter(np.float32(value[5]), np.float32(9)))


def watchdog_moves(bag: SessionBag) -> None:
    """A command between two poses of the policy's flight that is not zero."""
    index = bag.where('/cmd_vel')[-3]
    topic, log_time_ns, message = copy.deepcopy(bag.entries[index])
    message.header.stamp.nanosec += 1
    bag.entries.insert(index + 1, (topic, log_time_ns, message))


def faster_command(bag: SessionBag) -> None:
    bag.entries[bag.where('/cmd_vel')[-6]][2].twist.linear.x += 1e-9


TAMPERED = [
    (move_pose_in_a_demonstration, 'demonstrations', r'/demonstration at [\d.]+: .* is .*, expected '),
    (drop('/pose', 40), 'demonstrations', r'/demonstration at [\d.]+: audit.samples is \d+, expected \d+'),
    (change('/demonstration', 1, 'actions', 0, 3), 'demonstrations', r'/demonstration at [\d.]+: actions\[0\] is 3, expected \d'),
    (change('/demonstration', 0, 'end_reason', None, 2), 'demonstrations', r'end_reason is 2, expected 0'),
    (change('/demonstration', 0, 'states', 0, 999), 'demonstrations', r'/demonstration at [\d.]+: .* a state is outside 0 to 26'),
    (change('/demonstration', 1, 'end_reason', None, 77), 'demonstrations', r': 77 is not a valid EndReason'),
    (change('/advise/advice_log', 0, 'verdict', None, 9), 'policies', r'log_length is 1, expected at most 0'),
    (change('/policy/status', -1, 'phase', None, 99), 'flight statuses', r'/policy/status at [\d.]+: phase is 99, expected \d'),
    (drop('/demonstration', 1), 'policies', r'/advise/policy at [\d.]+: demonstrations is 2, expected at most 1'),
    (drop('/advise/policy', 1), 'policies', r'/advise/policy at [\d.]+: version is 3, expected 2'),
    (change('/advise/policy', 2, 'greedy', 4, 9), 'policies', r'/advise/policy at [\d.]+: greedy\[4\] is 9, expected \d'),
    (change('/advise/policy', 0, 'digest', None, '0' * 64), 'policies', r"digest is '0{64}', expected '[0-9a-f]{64}'"),
    (one_bit_of_a_value, 'policies', r'/advise/policy at [\d.]+: value\[5\] is \S+, expected \S+'),
    (drop('/advise/advice_log', 0), 'policies', r'log_length is 1, expected at most 0'),
    (change('/advise/advice_log', 0, 'preferred', 0, 2), 'policies', r'/advise/policy at [\d.]+: \S+ is .*, expected'),
    (drop('/advise/query', 1), 'queries', r'/advise/query at [\d.]+: nothing, expected query \d'),
    (change('/advise/query', 2, 'question', None, 'Why?'), 'queries', r"question is 'Why\?', expected '"),
    (change('/advise/query', 1, 'query_id', None, 7), 'queries', r'query_id is 7, expected 2'),
    (nudge_pose_of_the_policy, 'commands', r'/cmd_vel at [\d.]+: twist.linear.\w is \S+, expected \S+'),
    (faster_command, 'commands', r'/cmd_vel at [\d.]+: twist.linear.x is \S+, expected \S+'),
    (watchdog_moves, 'commands', r'/cmd_vel at [\d.]+: linear.\w is \S+, expected 0.0: no pose bears this stamp'),
    (change('/policy/status', -1, 'steps', None, 99), 'flight statuses', r'/policy/status at [\d.]+: steps is 99, expected \d+'),
    (change('/policy/status', 0, 'policy_version', None, 77), 'flight statuses', r'policy_version is 77, expected one of'),
]  # fmt: skip


@pytest.mark.parametrize(('tamper', 'stage', 'words'), TAMPERED, ids=[f'{n}-{case[1]}' for n, case in enumerate(TAMPERED)])
def test_what_was_changed_is_named(bag: SessionBag, tmp_path: Path, tamper: Tamper, stage: str, words: str) -> None:
    tamper(bag)
    code, stages, _ = verdict(bag, tmp_path)
    assert code == 1
    assert stages[stage]['equal'] < stages[stage]['checked']
    assert re.search(words, stages[stage]['difference']), stages[stage]['difference']


def test_a_message_that_was_cut_out_is_missed(bag: SessionBag, tmp_path: Path) -> None:
    """Even one that nothing else depends on: the logger numbers the messages of each topic."""
    path = bag.write(tmp_path / 'bag')
    cut_out(path / 'bag_0.mcap', '/cmd_vel', 3)
    report = tmp_path / 'report.json'
    assert replay.run([str(path), '--json', str(report)]) == 1
    stage = json.loads(report.read_text())['stages'][0]
    assert stage['name'] == 'messages kept' and stage['checked'] - stage['equal'] == 1
    assert re.fullmatch(r'/cmd_vel at log time [\d.]+: 1 messages before it are missing', stage['difference'])


def cut_out(path: Path, topic: str, sequence: int) -> None:
    """Write an MCAP file again without one message."""
    with path.open('rb') as stream:
        reader = list(StreamReader(stream).records)
    channels: dict[int, str] = {}
    with path.open('wb') as stream:
        writer = Writer(stream)
        writer.start('ros2', 'advise_ros')
        for record in reader:
            if isinstance(record, Schema) and not channels.get(-record.id):
                channels[-record.id] = record.name
                writer.register_schema(record.name, record.encoding, record.data)
            elif isinstance(record, Channel) and record.id not in channels:
                channels[record.id] = record.topic
                writer.register_channel(record.topic, record.message_encoding, record.schema_id, record.metadata)
            elif isinstance(record, Metadata):
                writer.add_metadata(record.name, record.metadata)
            elif isinstance(record, McapMessage) and (channels[record.channel_id], record.sequence) != (topic, sequence):
                writer.add_message(record.channel_id, record.log_time, record.data, record.publish_time, record.sequence)
        writer.finish()


# -- another machine -------------------------------------------------------------------------------
def test_elsewhere_equal_decisions_are_asked(bag: SessionBag, tmp_path: Path) -> None:
    bag.made_on['numpy'] = '1.26.0'
    one_bit_of_a_value(bag)
    code, stages, asked = verdict(bag, tmp_path)
    assert (code, asked) == (0, 'decisions')
    assert stages['policies']['equal'] == 3


def test_elsewhere_another_decision_still_differs(bag: SessionBag, tmp_path: Path) -> None:
    bag.made_on.clear()
    change('/advise/policy', 1, 'greedy', 2, 9)(bag)
    code, stages, _ = verdict(bag, tmp_path)
    assert code == 1
    assert 'greedy[2] is 9' in stages['policies']['difference']


def test_a_learner_that_was_started_again_replays(bag: SessionBag, tmp_path: Path) -> None:
    """Versions, questions and answers begin anew, and the first demonstration is there before all others."""
    last = bag.entries[-1][1]
    learnt = [entry for entry in bag.entries if entry[0].startswith('/advise/')]
    bag.entries += [(topic, last + 1 + log_time_ns, message) for topic, log_time_ns, message in learnt]
    code, stages, _ = verdict(bag, tmp_path)
    assert code == 0
    assert stages['policies']['checked'] == stages['queries']['checked'] == 6


def test_a_session_in_which_a_demonstration_was_taken_back_replays(tmp_path: Path) -> None:
    code, stages, _ = verdict(session_bag(take_back=True), tmp_path)
    assert (code, stages['policies']['checked'], stages['queries']['checked']) == (0, 4, 4)
    assert '1 demonstration was taken back by recorder/discard' in stages['demonstrations']['notes']


def forget_that_it_was_taken_back(bag: SessionBag) -> None:
    del bag.entries[bag.where('/demonstration')[-1]]


def test_the_taking_back_of_a_demonstration_that_was_cut_out_is_missed(tmp_path: Path) -> None:
    bag = session_bag(take_back=True)
    forget_that_it_was_taken_back(bag)
    code, stages, _ = verdict(bag, tmp_path)
    assert code == 1
    assert 'demonstrations is 3, expected at most 2' in stages['policies']['difference']


# -- bad input -------------------------------------------------------------------------------------
def error_of(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The one sentence on stderr; the exit code must be 2."""
    assert replay.run([str(argument) for argument in arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ''
    lines = captured.err.splitlines()
    assert len(lines) == 1 and lines[0].startswith('error: ')
    return lines[0]


def test_no_such_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert 'there is no such file' in error_of(capsys, tmp_path / 'none')


def test_not_a_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert 'it has no metadata.yaml and no .mcap or .db3 file' in error_of(capsys, tmp_path)
    (tmp_path / 'metadata.yaml').write_text('rosbag2: [')
    assert 'not one of rosbag2' in error_of(capsys, tmp_path)
    (tmp_path / 'text.mcap').write_text('this is a text, and a rather long one')
    said = error_of(capsys, tmp_path / 'text.mcap')
    assert 'holds nothing whole' in said and 'was read' not in said
    log = ROOT / 'bags' / 'arducopter_flight1.tlog'
    assert 'is a MAVLink telemetry log and no bag; discretise reads it' in error_of(capsys, log)


def test_of_a_bag_that_was_cut_off_what_is_whole_must_agree(bag: SessionBag, tmp_path: Path) -> None:
    file = bag.write(tmp_path / 'bag', chunk_bytes=4000) / 'bag_0.mcap'
    data, report = file.read_bytes(), tmp_path / 'report.json'
    for share in (0.5, 0.7, 0.9, 0.9999):
        file.write_bytes(data[: int(len(data) * share)])
        assert replay.run([str(tmp_path / 'bag'), '--json', str(report)]) == 0, share
        kept, *others = json.loads(report.read_text())['stages']
        assert 'the recording was not finished' in kept['notes'][0]
        assert others[0]['checked'] >= 1


def test_a_bag_of_which_nothing_is_left(
    bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    file = bag.write(tmp_path / 'bag') / 'bag_0.mcap'
    data = file.read_bytes()
    for length in (0, 30, 3000):
        file.write_bytes(data[:length])
        assert re.search('holds (nothing whole|no demonstrations)', error_of(capsys, tmp_path / 'bag'))


def test_a_flipped_byte_costs_a_chunk_and_is_found(bag: SessionBag, tmp_path: Path) -> None:
    file = bag.write(tmp_path / 'bag', chunk_bytes=4000) / 'bag_0.mcap'
    data, report = bytearray(file.read_bytes()), tmp_path / 'report.json'
    data[data.index(b'zstd', len(data) // 4) + 200] ^= 0x10
    file.write_bytes(data)
    assert replay.run([str(tmp_path / 'bag'), '--json', str(report)]) == 1
    kept = json.loads(report.read_text())['stages'][0]
    assert 'a chunk is damaged' in kept['notes'][0]
    assert re.search(r' at log time [\d.]+: \d+ messages before it are missing', kept['difference'])


def test_a_bag_without_parameters(bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag.nodes = ('recorder', 'advise')
    assert 'does not hold the parameters of /policy' in error_of(capsys, bag.write(tmp_path / 'bag'))


def test_a_bag_of_a_version_with_other_parameters(bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag.advise = replace(bag.advise, gamma=7.0)
    assert "parameters of /advise: parameter 'gamma' is 7.0; allowed" in error_of(capsys, bag.write(tmp_path / 'bag'))


@dataclass(frozen=True)
class EarlierAdviseConfig(AdviseConfig):
    """With parameters that there are no more."""

    clustering: str = 'k_means'
    method: str = 'own'


@pytest.mark.parametrize(('method', 'refused'), [('own', False), ('paper', True)])
def test_a_bag_says_when_it_was_learnt_in_a_way_that_is_gone(
    bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str], method: str, refused: bool,
) -> None:
    bag.advise = EarlierAdviseConfig(**asdict(bag.advise), method=method)
    path = bag.write(tmp_path / 'bag')
    if refused:
        assert "'method' was 'paper', which this version lacks" in error_of(capsys, path)
    else:
        assert replay.run([str(path)]) == 0


@pytest.fixture
def newer_policy(monkeypatch: pytest.MonkeyPatch) -> None:
    """The installed message has a field more than the bag's."""
    known = session.definition('advise_msgs/msg/Policy')
    newer = known._replace(text='float64 luck\n' + known.text)
    monkeypatch.setattr(session, 'definition', lambda name: newer if name == known.type_name else definition(name))


@pytest.mark.usefixtures('newer_policy')
def test_what_replay_cannot_do_without_must_be_there(
    bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(session, 'NEEDED', {'advise_msgs/msg/Policy': ('luck',)})
    assert "its advise_msgs/msg/Policy has no field 'luck'" in error_of(capsys, bag.write(tmp_path / 'bag'))


def test_no_demonstrations(bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag.entries = [entry for entry in bag.entries if entry[0] != '/demonstration']
    assert 'holds no demonstrations' in error_of(capsys, bag.write(tmp_path / 'bag'))


def test_another_grid(bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, grid = bag.write(tmp_path / 'bag'), tmp_path / 'grid.yaml'
    values = grid_to_mapping(GRID)
    grid.write_text(json.dumps({'grid': values}))
    assert replay.run([str(path), '--grid', str(grid)]) == 0
    capsys.readouterr()
    grid.write_text(json.dumps({'grid': {**values, 'altitude': 9.0}}))
    assert 'is on another grid' in error_of(capsys, path, '--grid', grid)


def test_another_namespace(bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert 'has no session in namespace' in error_of(capsys, bag.write(tmp_path / 'bag'), '--namespace', 'drone1')

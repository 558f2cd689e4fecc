"""Make the recorded sessions in this directory again.

usage: ./advise python bags/make_sessions.py [--to DIRECTORY] [NAME ...]

simulated_session is a run of the demo (some minutes), the others are made by the cores alone in seconds. Each is
replayed, and only one that follows byte for byte replaces what is there already. Run it again when what the cores
compute or the messages have changed. Needs the maker of the tests' sessions (test/support).

exit code: 0 all were made; 1 one did not replay byte for byte and was not taken
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from geometry_msgs.msg import PoseStamped, TwistStamped
from rosbags.highlevel import AnyReader

from advise_msgs.msg import VehicleStatus

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / 'test'))

from advise_ros.config import AdviseConfig  # noqa: E402
from advise_ros.core.advice.advice import Answer, Verdict  # noqa: E402
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of  # noqa: E402
from advise_ros.core.demonstrations.samples import Recording  # noqa: E402
from advise_ros.core.learning.session import Session  # noqa: E402
from advise_ros.core.people.simulated_expert import SimulatedExpert  # noqa: E402
from advise_ros.recording.bagrecords import RECORDS_TOPIC  # noqa: E402
from advise_ros.recording.definitions import definition  # noqa: E402
from advise_ros.recording.gridfile import load_grid  # noqa: E402
from advise_ros.recording.storage import open_source  # noqa: E402
from advise_ros.recording.tlog import read_tlog  # noqa: E402
from advise_ros.recording.writer import BagWriter  # noqa: E402
from advise_ros.replay.check import check  # noqa: E402
from advise_ros.ros import convert, convert_advice  # noqa: E402
from advise_ros.settings import learn_settings  # noqa: E402
from support.session_bag import GRID, SOURCE, SessionBag, session_bag  # noqa: E402

DEMO = ('--flights', '2', '--answers', '2', '--seed', '3')
# The records are written again; diagnostics, the battery and pictures for RViz would double the size, and no replay needs them.
LEFT_OUT = (RECORDS_TOPIC, '/diagnostics', '/battery_state', '/advise/markers', '/advise/uncertainty', '/advise/reward')
ANSWERS = 3
SMALL_CHUNK = 4000
MOST_FLIGHTS, MOST_SEEDS = 12, 50
CUT_SHARE, CUT_AFTER = 0.8, 200


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('names', nargs='*', metavar='NAME', help=f'of: {", ".join(MAKERS)} (default: all)')
    parser.add_argument('--to', type=Path, default=ROOT / 'bags')
    options = parser.parse_args()
    if unknown := set(options.names) - set(MAKERS):
        parser.error(f'there is no {", ".join(sorted(unknown))}; known: {", ".join(MAKERS)}')
    wrong = [name for name in options.names or MAKERS if not _made(name, options.to)]
    sys.exit(1 if wrong else 0)


def _made(name: str, folder: Path) -> bool:
    """Make a bag and put it into the folder, if it replays byte for byte."""
    with tempfile.TemporaryDirectory() as directory:
        draft = Path(directory) / name
        MAKERS[name](draft)
        report = check(draft)
        same, of = report.in_bytes
        print(f'{name}: {report.byte_verdict}; {report.verdict}')
        if report.agrees and same == of:
            shutil.rmtree(folder / name, ignore_errors=True)
            shutil.move(draft, folder / name)
        return report.agrees and same == of


def simulated_session(target: Path) -> None:
    """The demo's own bag without what is for people's eyes."""
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory) / 'demo'
        subprocess.run([str(ROOT / 'advise'), 'demo', *DEMO, '--out', str(out)], check=False, stdout=subprocess.DEVNULL)
        _copy(out / 'bag', target)


def _copy(bag: Path, target: Path) -> None:
    source, writer = open_source(bag), BagWriter(target)
    with AnyReader([bag]) as reader:
        qos = {connection.topic: connection.ext.offered_qos_profiles for connection in reader.connections}
    topics: dict[str, int] = {}
    for block in source.blocks():
        for row in range(len(block.starts)):
            channel = block.channels[int(block.channel_ids[row])]
            if channel.topic in LEFT_OUT:
                continue
            if channel.topic not in topics:
                topics[channel.topic] = writer.add_topic(channel.topic, definition(channel.type_name), qos[channel.topic])
            data = block.data[int(block.starts[row]) : int(block.ends[row])]
            writer.write(topics[channel.topic], int(block.log_ns[row]), int(block.publish_ns[row]), data)
    for record in source.records:
        if record.name != 'rosbag2':
            writer.add_record(record.name, {key: _portable(value, bag) for key, value in record.values.items()})
    writer.close()


def _portable(value: str, bag: Path) -> str:
    """A recorded parameter without where this checkout and the draft lie."""
    return value.replace(f'{ROOT}/', '').replace(f'{bag.parent}/', '')


def arducopter_session(target: Path) -> None:
    """The flight in arducopter_flight1.tlog, learnt from, with a simulated expert's answers; no policy was flown."""
    grid, recording = load_grid(ROOT / 'config' / 'grid_6x6.yaml'), read_tlog(ROOT / 'bags' / 'arducopter_flight1.tlog')
    bag = SessionBag(advise=AdviseConfig(acquisition='occupancy'))
    (flown,) = demonstrations_of(grid, recording._replace(source=SOURCE), bag.recorder.discretise_settings()).demonstrations
    _put_samples(bag, recording)
    bag.put('/demonstration', convert.demonstration_to_msg(flown))
    session = Session(grid, learn_settings(bag.advise), bag.advise.budget)
    session.add(flown)
    expert = SimulatedExpert(grid, np.random.default_rng(0))
    learned = bag.learn(session, grid)
    for _ in range(ANSWERS):
        if learned.query is None:
            break
        _tell(bag, session, expert.answer(learned.query))
        learned = bag.learn(session, grid)
    bag.write(target)


def _put_samples(bag: SessionBag, recording: Recording) -> None:
    entries: list[tuple[int, str, object]] = []
    for stamp_ns, position in zip(*(array.tolist() for array in recording.poses), strict=True):
        pose = _stamped(PoseStamped(), stamp_ns)
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = position
        entries.append((stamp_ns, '/pose', pose))
    for stamp_ns, velocity in zip(*(array.tolist() for array in recording.commands), strict=True):
        command = _stamped(TwistStamped(), stamp_ns)
        command.twist.linear.x, command.twist.linear.y, command.twist.linear.z = velocity
        entries.append((stamp_ns, '/cmd_vel', command))
    for event in recording.events:
        status = VehicleStatus(connected=True, armed=event.armed, in_air=event.in_air, commandable=event.in_air)
        entries.append((event.stamp_ns, '/vehicle_status', _stamped(status, event.stamp_ns)))
    for bag.now_ns, topic, message in sorted(entries, key=lambda entry: entry[0]):
        bag.put(topic, message)


def _stamped(message: PoseStamped, stamp_ns: int) -> PoseStamped:
    message.header.frame_id, message.header.stamp = 'map', convert.stamp_from_ns(stamp_ns)
    return message


def _tell(bag: SessionBag, session: Session, answer: Answer) -> tuple[int, ...]:
    """Log an answer; returns the earlier ones that it contradicts."""
    outcome = session.submit(answer)
    assert outcome.record is not None, outcome
    bag.put('/advise/advice_log', convert_advice.advice_to_msg(outcome.record, bag.now_ns))
    return outcome.contradicts


def contradictory_answers(target: Path) -> None:
    """Someone answers one way, and after more flights, asked again about some of the same states, the other way."""
    for seed in range(MOST_SEEDS):
        bag = _contradictory(np.random.default_rng(seed))
        if bag is not None:
            bag.write(target)
            return
    raise SystemExit('no flights led to a second question about the same states; raise MOST_SEEDS')


def _contradictory(rng: np.random.Generator) -> SessionBag | None:
    bag = SessionBag(advise=AdviseConfig(clusters=4, cluster_features=0.0, acquisition='paper', temperature=1.0))
    session = Session(GRID, learn_settings(bag.advise), bag.advise.budget)
    answered: set[int] = set()
    for _ in range(MOST_FLIGHTS):
        session.add(bag.demonstrate(np.flatnonzero(rng.random(GRID.n_states) < 0.5).tolist()))
        query = bag.learn(session, GRID).query
        if query is None or (answered and answered.isdisjoint(query.states)):
            continue
        preferred, avoided = (2, 0) if answered else (0, 2)
        _tell(bag, session, Answer(query.query_id, Verdict.ANSWER, (preferred,), (avoided,), 'undecided'))
        if bag.learn(session, GRID).contradictions:
            return bag
        answered |= set(query.states)
    return None


def interrupted_session(target: Path) -> None:
    """A recording whose logger and machine died: metadata.yaml as at the beginning, no index, half a chunk at the end."""
    made = session_bag()
    kept = made.entries[: int(len(made.entries) * CUT_SHARE)]
    writer = BagWriter(target, chunk_bytes=SMALL_CHUNK)
    writer.add_record('platform', made.made_on)
    for node in made.nodes:
        writer.add_record(f'parameters /{node}', {name: json.dumps(value) for name, value in made.parameters(node).items()})
    made.put_into(writer, kept)
    writer.flush()
    writer.abandon()
    (file,) = target.glob('*.mcap')
    data = file.read_bytes()
    file.write_bytes(data[: data.rindex(b'zstd') + CUT_AFTER])


MAKERS: Mapping[str, Callable[[Path], None]] = {
    maker.__name__: maker for maker in (simulated_session, arducopter_session, interrupted_session, contradictory_answers)
}

if __name__ == '__main__':
    main()

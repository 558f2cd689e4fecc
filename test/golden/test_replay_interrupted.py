"""Sessions of which a part is missing or was begun anew: each replays, or says exactly which messages the bag lacks."""

import copy
import json
import re
from pathlib import Path

import pytest

from advise_ros.commands import replay
from advise_ros.config import PolicyConfig
from advise_ros.core.demonstrations.epochs import divide
from advise_ros.core.flight.policy_flight import FlightPlan, PolicyFlight
from advise_ros.core.learning.learner import Learned
from advise_ros.core.learning.session import Session
from advise_ros.recording.bags import read_bag
from advise_ros.recording.topics import BagTopics
from advise_ros.replay.session import at
from advise_ros.ros import convert
from advise_ros.settings import learn_settings
from support.session_bag import GRID, SessionBag

pytestmark = pytest.mark.usefixtures('learn_once')

FASTER = PolicyConfig(speed_m_s=2.0)


def test_a_policy_flew_until_another_node_says_that_it_is_idle(good: SessionBag, tmp_path: Path) -> None:
    bag = copy.deepcopy(good)
    bag.fly(flight(bag, bag.policy), 3, ticks=9)
    began_ns = bag.entries[bag.where('/policy/status')[-1]][1]
    bag.start_policy_again(FASTER)
    topics = BagTopics(('/pose',), '/cmd_vel', '/vehicle_status', '/policy/status', as_stamped=True)
    (part,) = divide(read_bag(bag.write(tmp_path / 'bag'), topics)).parts
    assert [event.flies for event in part.policy] == [True, False, True, False]
    assert part.policy[2].stamp_ns <= began_ns <= part.policy[3].stamp_ns < bag.now_ns


def verdict(bag: SessionBag, directory: Path) -> tuple[int, dict[str, dict], list[str]]:
    """Exit code, stage -> values, and all notes."""
    report = directory / 'report.json'
    code = replay.run([str(bag.write(directory / 'bag')), '--json', str(report)])
    stages = {stage['name']: stage for stage in json.loads(report.read_text())['stages']}
    return code, stages, [note for stage in stages.values() for note in stage['notes']]


def last_policy(bag: SessionBag) -> FlightPlan:
    message = bag.entries[bag.where('/advise/policy')[-1]][2]
    return FlightPlan(GRID, tuple(int(action) for action in message.greedy))


def flight(bag: SessionBag, config: PolicyConfig) -> PolicyFlight:
    return PolicyFlight(last_policy(bag), config.seek_settings())


# -- the policy node was killed and started again -----------------------------------------------------
@pytest.mark.parametrize('ticks', [0, 1, 9, 40])
@pytest.mark.parametrize('idle_heard', [True, False])
def test_a_policy_that_was_killed_and_started_again_with_another_speed(
    bag: SessionBag, tmp_path: Path, ticks: int, idle_heard: bool,
) -> None:
    before = len(bag.where('/cmd_vel'))
    bag.fly(flight(bag, bag.policy), 3, ticks=ticks)
    bag.start_policy_again(FASTER)
    if not idle_heard:
        del bag.entries[bag.where('/policy/status')[-1]]
    bag.fly(flight(bag, FASTER), 3)
    code, stages, notes = verdict(bag, tmp_path)
    assert code == 0, stages
    pilots = int(next(re.match(r'(\d+) commands of pilots', note).group(1) for note in notes if 'of pilots' in note))
    assert stages['commands']['checked'] == len(bag.where('/cmd_vel')) - pilots
    assert stages['commands']['checked'] - ticks >= len(bag.where('/cmd_vel')) - before - ticks
    assert sum('has no end in the bag' in note for note in notes) == 1


def test_commands_of_a_pilot_after_the_policy_was_killed_are_not_the_policys(bag: SessionBag, tmp_path: Path) -> None:
    bag.fly(flight(bag, bag.policy), 3, ticks=20)
    bag.start_policy_again(bag.policy)
    commands = len(bag.where('/cmd_vel'))
    bag.demonstrate(())
    code, stages, notes = verdict(bag, tmp_path)
    assert code == 0, stages
    flown_by_pilot = len(bag.where('/cmd_vel')) - commands
    assert any(f'{flown_by_pilot + pilots_of(bag, commands)} commands of pilots' in note for note in notes), notes


def pilots_of(bag: SessionBag, upto: int) -> int:
    """Commands of the first two flights, which demonstrated."""
    end_ns = bag.entries[bag.where('/demonstration')[1]][1]
    return sum(bag.entries[index][1] < end_ns for index in bag.where('/cmd_vel')[:upto])


def test_a_wrong_command_of_a_flight_that_was_cut_off_is_still_found(bag: SessionBag, tmp_path: Path) -> None:
    bag.fly(flight(bag, bag.policy), 3, ticks=20)
    bag.entries[bag.where('/cmd_vel')[-2]][2].twist.linear.x += 1e-3
    code, stages, _ = verdict(bag, tmp_path)
    assert code == 1
    assert 'twist.linear.x' in stages['commands']['difference']


# -- the logger came late, or left early --------------------------------------------------------------
def moments(bag: SessionBag, count: int) -> list[int]:
    first_ns, last_ns = bag.entries[0][1], bag.entries[-1][1]
    return [first_ns + (last_ns - first_ns) * part // (count + 1) for part in range(1, count + 1)]


@pytest.mark.parametrize('part', range(12))
def test_a_logger_that_came_late(bag: SessionBag, tmp_path: Path, part: int) -> None:
    begin_ns = moments(bag, 12)[part]
    all_commands = len(bag.where('/cmd_vel'))
    bag.begin_late(begin_ns)
    begin_ns = min(bag.entries[index][2].header.stamp.sec * 10**9 + bag.entries[index][2].header.stamp.nanosec
                   for index in bag.where('/pose'))
    code, stages, notes = verdict(bag, tmp_path)
    assert code == 0, stages
    assert len(bag.where('/cmd_vel')) < all_commands
    lacking = [note for note in notes if 'was flown before the recording began' in note]
    early = [index for index in bag.where('/demonstration') if _start_ns(bag.entries[index][2]) < begin_ns]
    assert len(lacking) == len(early)
    for note, index in zip(lacking, early, strict=True):
        demonstration = bag.entries[index][2]
        held = sum(
            _start_ns(demonstration) <= bag.entries[pose][1] <= _ns(demonstration.window_end) for pose in bag.where('/pose')
        )
        assert f'lacks {demonstration.audit.samples - held} messages on /pose' in note
        assert f'from {at(_start_ns(demonstration))} to ' in note
    assert stages['demonstrations']['checked'] == len(bag.where('/demonstration')) - len(early)
    if any('was under way when the recording began' in note for note in notes):
        assert stages['commands']['checked'] == 0


def _ns(stamp: object) -> int:
    return stamp.sec * 10**9 + stamp.nanosec


def _start_ns(demonstration: object) -> int:
    return _ns(demonstration.window_start)


def test_a_logger_that_came_in_the_middle_of_a_policys_flight_says_what_it_missed(bag: SessionBag, tmp_path: Path) -> None:
    middle = bag.where('/cmd_vel')[-8]
    bag.begin_late(bag.entries[middle][1])
    code, stages, notes = verdict(bag, tmp_path)
    assert code == 0, stages
    said = next(note for note in notes if 'was under way when the recording began' in note)
    lacks = r'flight 1 .* nor are its 8 commands: the bag lacks /pose and /cmd_vel from [\d.]+ or earlier to [\d.]+'
    assert re.fullmatch(lacks, said)


@pytest.mark.parametrize('part', range(12))
def test_a_logger_that_left_early(bag: SessionBag, tmp_path: Path, part: int) -> None:
    end_ns = moments(bag, 12)[part]
    bag.entries = [entry for entry in bag.entries if entry[1] < end_ns]
    if not bag.where('/demonstration'):
        return  # Nothing was published yet: no session.
    code, stages, _ = verdict(bag, tmp_path)
    assert code == 0, stages


def test_a_late_logger_whose_recorder_was_started_again_lacks_what_the_first_one_kept(bag: SessionBag, tmp_path: Path) -> None:
    begin_ns = bag.entries[bag.where('/policy/status')[0]][1]
    bag.begin_late(begin_ns)
    del bag.entries[bag.where('/demonstration')[0]]
    code, stages, notes = verdict(bag, tmp_path)
    assert code == 0, stages
    lacks = r'policy 3 at [\d.]+ is not learnt again: the bag lacks 1 message on /demonstration from before'
    assert any(re.match(lacks, note) for note in notes)


# -- recorder and learner were started again ----------------------------------------------------------
def test_a_learner_and_a_recorder_that_were_started_again(bag: SessionBag, tmp_path: Path) -> None:
    """The second recorder counts from 1 again, and the second learner hears only its demonstrations."""
    session = Session(GRID, learn_settings(bag.advise), bag.advise.budget)
    learned: Learned | None = None
    for number, wrong_turns in enumerate((range(0, GRID.n_states, 2), ()), start=1):
        session.add(bag.demonstrate(wrong_turns, number))
        learned = bag.learn(session)
    assert learned is not None
    bag.answer(session, learned)
    bag.learn(session)
    code, stages, notes = verdict(bag, tmp_path)
    assert code == 0, stages
    assert stages['policies']['checked'] == 6
    assert any('had received nothing before demonstration 3 of the bag' in note for note in notes)


def test_a_learner_that_was_started_again_hears_a_living_recorder_whole(bag: SessionBag, tmp_path: Path) -> None:
    demonstrations = [convert.demonstration_from_msg(bag.entries[index][2]) for index in bag.where('/demonstration')]
    session = Session(GRID, learn_settings(bag.advise), bag.advise.budget)
    for demonstration in demonstrations:
        session.add(demonstration)
    bag.learn(session)
    code, stages, _ = verdict(bag, tmp_path)
    assert code == 0, stages
    assert stages['policies']['checked'] == 4


# -- another version, and the real nodes --------------------------------------------------------------
def test_a_difference_may_be_another_versions(bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag.made_on['core'] = '0123456789abcdef'
    bag.entries[bag.where('/cmd_vel')[-6]][2].twist.linear.x += 1.0
    assert verdict(bag, tmp_path)[0] == 1
    said = capsys.readouterr().out
    assert 'or another version decides otherwise: the bag was made by core 01234567, this is core' in said


def test_a_recording_that_began_late_is_not_lived_through(
    bag: SessionBag, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    bag.begin_late(bag.entries[bag.where('/policy/status')[0]][1])
    assert replay.run([str(bag.write(tmp_path / 'bag')), '--live']) == 2
    assert 'its recording began when others had published already; replay it without --live' in capsys.readouterr().err

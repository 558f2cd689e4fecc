"""The learner as a process: where its demonstrations come from, what outlives it, who hears of it and what ends it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from advise_msgs.msg import Advice, AdviceQuery, Demonstration, LearnerStatus, Policy
from advise_msgs.srv import AnswerQuery
from advise_ros.config import AdviseConfig
from advise_ros.core.advice.advice import Code, Verdict
from advise_ros.core.learning.learner import learn
from advise_ros.experiments.routes.cases import RouteCase, trial_of
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.ros import convert, convert_advice, qos
from advise_ros.settings import learn_settings
from support.graph import Graph
from support.learner import LATCHED, Learner, write_grid
from support.walks import GRID_4X4, walk


@pytest.fixture
def grid_file(tmp_path: Path) -> str:
    return write_grid(tmp_path, GRID_4X4)


def test_a_demonstration_that_does_not_fit_is_refused_and_the_rest_goes_on(graph: Graph, grid_file: str) -> None:
    learner = Learner(graph, grid_file)
    learner.demonstrate(5, grid=replace(GRID_4X4, altitude_m=9.0))
    refused = learner.status(LearnerStatus.WAITING_FOR_DEMONSTRATIONS, "Demonstration 'flight-005' was refused")
    assert 'another grid' in refused.message
    nonsense = convert.demonstration_to_msg(walk(GRID_4X4, 6))
    nonsense.states[0] = 64
    nonsense.end_reason = 99
    learner.publish(nonsense)
    learner.status(LearnerStatus.WAITING_FOR_DEMONSTRATIONS, "'flight-006' was refused")
    learner.demonstrate(0)
    assert learner.policy(1, 0).version == 1
    assert 'refused' not in learner.status(LearnerStatus.ASKING).message


def test_flights_of_two_people_with_other_wishes_are_named(graph: Graph, tmp_path: Path) -> None:
    trial = trial_of(RouteCase('6x6-4', people=2), 41_502)
    save_demonstrations(tmp_path / 'demos.json', trial.flights)
    file = str(tmp_path / 'demos.json')
    Learner(graph, write_grid(tmp_path, trial.site.grid), acquisition='site', demonstrations_file=file)
    named = [trial.flights[flight].demonstration_id for flight in (1, 3)]
    words = f'Flights {named[0]} and {named[1]} look like those of somebody with other wishes: ('
    graph.wait_for('advise/status', LearnerStatus, lambda m: words in m.message, LATCHED)


def test_demonstrations_from_a_file_are_shown_to_all_and_learnt_with_those_that_come(
    graph: Graph, grid_file: str, tmp_path: Path,
) -> None:
    save_demonstrations(tmp_path / 'demos.json', [walk(GRID_4X4, 0), walk(GRID_4X4, 1)])
    learner = Learner(graph, grid_file, demonstrations_file=str(tmp_path / 'demos.json'), demonstrations_min=2)
    heard = graph.listen('demonstration', Demonstration, qos.DEMONSTRATIONS)
    learner.policy(2, 0)
    graph.wait_until(lambda: len(heard) == 2)
    learner.demonstrate(1, 2, 3, 4)  # Number 1 is known.
    learner.policy(5, 0)
    assert (learner.policies[0].version, learner.policies[0].demonstrations) == (1, 2)


def test_killed_and_started_again_it_has_the_same_log_and_policy(graph: Graph, grid_file: str, tmp_path: Path) -> None:
    file = tmp_path / 'session.jsonl'
    first = Learner(graph, grid_file, session_file=str(file))
    first.demonstrate(0, 1)
    first.policy(2, 0)
    for log_length in (1, 2):
        assert first.answer(first.open_query(), (1,), (3,)).accepted
        first.policy(2, log_length)
    assert graph.call(Trigger, 'advise/undo').success
    first.process.kill()  # The undo is on the disk, learnt or not.
    log = list(first.log)
    with file.open('a') as torn:
        torn.write('{"advice": {"advice_id": 3, "que')
    second = Learner(graph, grid_file, session_file=str(file))  # The demonstrations are latched by the test.
    again = second.policy(2, 3)
    assert again.digest == digest_with_first_answer(log)
    graph.wait_until(lambda: len(second.log) == 3)
    assert second.log[: len(log)] == log  # With the stamps of then.
    number = second.query_of(again).query_id
    told = second.status(LearnerStatus.ASKING, f'query {number}')
    assert 'the last line was cut off' in told.message
    assert told.answers == 1
    assert second.answer(2, (1,), (3,)).code == Code.STALE_QUERY


def digest_with_first_answer(log: list[Advice]) -> str:
    """Of the policy that two demonstrations and the first answer make."""
    first = (convert_advice.advice_from_msg(log[0]),)
    flown = (walk(GRID_4X4, 0), walk(GRID_4X4, 1))
    return learn(GRID_4X4, learn_settings(AdviseConfig(acquisition='occupancy')), flown, first).digest


def test_who_comes_late_gets_everything_and_a_namespace_moves_all_names(graph: Graph, grid_file: str) -> None:
    graph.start('advise', {'grid_file': grid_file, 'acquisition': 'occupancy'}, namespace='/crew_1')
    publisher = graph.publisher('crew_1/demonstration', Demonstration, qos.DEMONSTRATIONS)
    publisher.publish(convert.demonstration_to_msg(walk(GRID_4X4, 0)))
    told = graph.listen('crew_1/advise/status', LearnerStatus, LATCHED)
    for number in (1, 2):
        graph.wait_until(lambda number=number: any(m.query_id == number for m in told))
        request = AnswerQuery.Request(query_id=number, verdict=Verdict.UNSURE)
        assert graph.call(AnswerQuery, '/crew_1/advise/answer', request).accepted
    graph.wait_until(lambda: told[-1].query_id == 3)
    assert 'ros2 service call /crew_1/advise/answer advise_msgs/srv/AnswerQuery "{query_id: 3, ' in told[-1].message
    assert './advise answer --query 3 ' in told[-1].message and '-r __ns:=/crew_1' in told[-1].message
    check_latched(graph)
    outside = {name for name, _ in graph.node.get_topic_names_and_types() if not name.startswith('/crew_1/')}
    assert outside <= {'/diagnostics', '/rosout', '/parameter_events', '/clock'}


def check_latched(graph: Graph) -> None:
    assert graph.wait_for('crew_1/advise/policy', Policy, qos=LATCHED).version == 3
    assert graph.wait_for('crew_1/advise/query', AdviceQuery, qos=LATCHED).query_id == 3
    for name in ('uncertainty', 'reward'):
        assert len(graph.wait_for(f'crew_1/advise/{name}', OccupancyGrid, qos=LATCHED).data) == 16
    assert graph.wait_for('crew_1/advise/markers', MarkerArray, qos=LATCHED).markers
    log = graph.listen('crew_1/advise/advice_log', Advice, qos.ADVICE_LOG)
    graph.wait_until(lambda: [m.advice_id for m in log] == [1, 2])


@pytest.mark.parametrize(('params', 'words'), [
    ({'grid_file': ''}, "set parameter 'grid_file'"),
    ({'session_file': '/nowhere/session.jsonl'}, 'session file /nowhere/session.jsonl: it cannot be opened'),
])  # fmt: skip
def test_wrong_input_ends_it_with_one_sentence(graph: Graph, grid_file: str, params: dict[str, object], words: str) -> None:
    process = graph.start('advise', {'grid_file': grid_file, **params})
    assert process.wait_exit() == 2
    errors = [line for line in process.err if line.startswith('error: ')]
    assert len(errors) == 1 and words in errors[0]
    assert 'Traceback' not in process.text

"""What `ros2 bag play` does with the sessions that ship: live nodes learn from them what had been learnt."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from advise_msgs.msg import Demonstration, LearnerStatus
from advise_ros.commands import recover
from advise_ros.config import RecorderConfig
from advise_ros.replay.session import read_session
from advise_ros.ros import convert, qos
from support.bag_player import play
from support.graph import Graph
from support.learner import write_grid
from support.paths import ROOT

# A listener reports what it has counted after as many.
REPORTED = 50
# Flights of the policy are no demonstrations.
OURS = ('/policy/status',)
FLOWN = ('/pose', '/cmd_vel', '/vehicle_status')


@pytest.mark.parametrize('name', ['contradictory_answers', 'arducopter_session', 'simulated_session'])
def test_a_session_that_is_played_is_learnt_from(graph: Graph, tmp_path: Path, name: str) -> None:
    session = read_session(ROOT / 'bags' / name)
    wanted = [one.value for one in session.on('demonstration') if len(one.value.states)]
    config = session.config(RecorderConfig, 'recorder')
    grid = write_grid(tmp_path, convert.grid_from_msg(wanted[0].grid))
    changed = {
        spec.name: getattr(config, spec.name) for spec in fields(config)
        if getattr(config, spec.name) != spec.default and spec.name != 'grid_file'
    }
    # The player is far faster than the flight was: on a busy machine what is sent best-effort is lost.
    reliable = {'qos_overrides./pose.subscription.reliability': 'reliable'}
    graph.start('recorder', {**changed, **reliable, 'grid_file': grid, 'use_sim_time': True})
    graph.start('advise', {'grid_file': grid, 'acquisition': 'occupancy', 'use_sim_time': True})
    made = graph.listen('demonstration', Demonstration, qos.DEMONSTRATIONS)
    said = graph.listen('/diagnostics', DiagnosticArray)

    def counted(topic: str) -> int:
        statuses = (one for array in reversed(said) for one in array.status if one.name == '/recorder')
        status = next(statuses, None)
        return next((int(pair.value) for pair in status.values if pair.key == topic), 0) if status else 0

    def keep_up(topic: str, sent: int) -> None:
        if topic == '/pose' and sent % REPORTED == 0:
            graph.wait_until(lambda: counted('/pose') >= sent, what=f'{sent} positions at the recorder')

    topics = (*FLOWN, *(topic for topic in OURS if topic in session.bag.topics))
    play(graph, ROOT / 'bags' / name, topics, keep_up)
    graph.wait_until(lambda: len(made) == len(wanted), what=f'{len(wanted)} demonstrations')
    assert [(list(one.states), list(one.actions)) for one in made] == [(list(one.states), list(one.actions)) for one in wanted]
    graph.wait_for(
        'advise/status', LearnerStatus, lambda m: m.policy_version and m.demonstrations == len(wanted), qos.latched())


def test_the_lines_of_the_page_name_what_there_is(tmp_path: Path) -> None:
    page = (ROOT / 'docs' / 'replay.md').read_text(encoding='utf-8')
    whole = tmp_path / 'interrupted_whole'
    assert recover.run([str(ROOT / 'bags' / 'interrupted_session'), '--out', str(whole)]) == 0
    lines = re.findall(r'^\$ ros2 bag play (\S+) --clock 50 --topics (.+)$', page, re.MULTILINE)
    shipped = {str(one.relative_to(ROOT)) for one in (ROOT / 'bags').iterdir() if (one / 'metadata.yaml').exists()}
    assert {bag for bag, _ in lines} == shipped - {'bags/interrupted_session'} | {whole.name}
    for bag, topics in lines:
        held = read_topics(whole if bag == whole.name else ROOT / bag)
        assert set(topics.split()) <= held, bag


def read_topics(bag: Path) -> set[str]:
    return set(re.findall(r'^\s+name: (/\S+)$', (bag / 'metadata.yaml').read_text(encoding='utf-8'), re.MULTILINE))

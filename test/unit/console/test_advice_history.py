"""The page's history: over restarts of the learner no answer is told twice, and what is not known is not made up."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from advise_ros.console import views
from advise_ros.console.advice_history import AdviceHistory
from advise_ros.core.advice.advice import Verdict
from advise_ros.core.demonstrations.demonstration import count
from advise_ros.ros import convert_advice
from advise_ros.ros.track import POINTS, TrackTopic
from support.learning import EAST, WEST, ready, record

FIRST, SECOND = record(1, (0, 1), (EAST,), (WEST,)), record(2, (2,), (), (), verdict=Verdict.SKIP)
OUTLOOK = {'reaches': True, 'success': 0.5}


def test_a_log_that_is_told_again_is_known() -> None:
    past = AdviceHistory()
    assert past.add(FIRST, 10) and past.add(SECOND, 20)
    past.begin(0)
    past.learnt(2, 3, OUTLOOK)
    assert not past.add(FIRST, 10) and not past.add(SECOND, 20)
    assert past.view() == {'since': 0, 'gains': [{'entry': 2, 'changed': 3, **OUTLOOK}]}
    assert past.add(record(1, (0, 1), (EAST,), (WEST,), retracted=True), 10), 'what takes an answer back is another entry'


def test_another_session_begins_anew() -> None:
    past = AdviceHistory()
    past.add(FIRST, 10)
    past.begin(1)
    past.learnt(2, 3, OUTLOOK)
    assert past.add(FIRST, 50)
    assert [entry.stamp_ns for entry in past.entries] == [50]
    past.begin(1)
    assert past.view() == {'since': 1, 'gains': []}


def test_what_was_learnt_before_one_listened_is_not_known() -> None:
    past = AdviceHistory()
    past.begin(2)
    past.begin(3)
    past.learnt(3, 1, OUTLOOK)
    assert past.view()['since'] == 2


def test_the_heat_is_the_uncertainty_of_the_learner() -> None:
    session = ready()
    learned = session.learned
    assert learned is not None
    policy = convert_advice.policy_to_msg(learned, 0)
    found = views.unsure(policy, session.grid, count(session.grid, session.demonstrations), learned.settings)
    flown = [state for state in range(session.grid.n_states) if not session.grid.is_terminal(state)]
    assert found[flown] == pytest.approx(learned.state_uncertainty[flown], abs=1e-6)
    assert np.all(found >= found[session.grid.goal_state])


def test_a_track_is_bounded_and_told_when_it_has_grown() -> None:
    told: list[Marker] = []
    clock = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=10**9))
    node: Any = SimpleNamespace(get_clock=lambda: clock, create_publisher=lambda *_: SimpleNamespace(publish=told.append))
    track = TrackTopic(node, 0.1)
    track.add((0.0, 0.0, 5.0))
    track.publish()
    assert not told, 'one point is no line'
    for step in range(POINTS + 10):
        track.add((0.06 * step, 0.0, 5.0))
    track.publish()
    track.publish()
    (line,) = told
    assert (line.type, line.header.frame_id, line.header.stamp.sec) == (Marker.LINE_STRIP, 'map', 1)
    assert 1 < len(line.points) <= POINTS
    steps = [math.dist((a.x, a.y), (b.x, b.y)) for a, b in zip(line.points, line.points[1:], strict=False)]
    assert min(steps) >= 0.1

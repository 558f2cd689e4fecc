"""Malformed, late, duplicate and contradictory answers: the learner ends where the valid ones alone lead."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from std_srvs.srv import Trigger

from advise_msgs.msg import Advice, LearnerStatus
from advise_msgs.srv import AnswerQuery
from advise_ros.core.grid.grid import N_ACTIONS
from support.graph import Graph
from support.learner import Learner, write_grid
from support.promises.book import Book, Measure
from support.promises.rig import private_graph
from support.walks import GRID_4X4

ACCEPTED_AT_MOST = 20
DEMONSTRATIONS = (0, 1)


class Crowd:
    """People who answer wrongly, late, twice and against each other; every choice from a Generator."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.given: list[AnswerQuery.Request] = []

    def good(self, query_id: int) -> AnswerQuery.Request:
        """A sound answer, right or wrong: it may contradict an earlier one."""
        first, second = self._rng.permutation(N_ACTIONS)[:2]
        return AnswerQuery.Request(query_id=query_id, preferred=[int(first)], avoided=[int(second)], expert_id='anna')

    def bad(self, query_id: int) -> AnswerQuery.Request:
        """One that must not change anything, whatever query is open."""
        kinds = (self._late, self._twice, self._unknown, self._overlapping, self._empty, self._no_action, self._no_verdict)
        return kinds[self._rng.integers(len(kinds))](query_id)

    def _late(self, query_id: int) -> AnswerQuery.Request:
        return self.good(int(self._rng.integers(0, max(query_id, 1))))

    def _twice(self, query_id: int) -> AnswerQuery.Request:
        return self.given[self._rng.integers(len(self.given))] if self.given else self._late(query_id)

    def _unknown(self, query_id: int) -> AnswerQuery.Request:
        return self.good(int(self._rng.integers(query_id + 1000, 2**63)))

    def _overlapping(self, query_id: int) -> AnswerQuery.Request:
        action = int(self._rng.integers(N_ACTIONS))
        return AnswerQuery.Request(query_id=query_id, preferred=[action], avoided=[(action + 1) % N_ACTIONS, action])

    def _empty(self, query_id: int) -> AnswerQuery.Request:
        return AnswerQuery.Request(query_id=query_id, preferred=[1], comment='x' * int(self._rng.integers(10_000)))

    def _no_action(self, query_id: int) -> AnswerQuery.Request:
        action = int(self._rng.integers(N_ACTIONS, 256))
        return AnswerQuery.Request(query_id=query_id, preferred=[action], avoided=[0])

    def _no_verdict(self, query_id: int) -> AnswerQuery.Request:
        return AnswerQuery.Request(query_id=query_id, verdict=int(self._rng.integers(10, 256)), preferred=[0], avoided=[1])


def run(folder: Path, rng: np.random.Generator, book: Book) -> None:
    """Send bad answers and a few good ones; then the good ones alone to a fresh learner."""
    grid_file = write_grid(folder, GRID_4X4)
    for _ in book.rounds(book.total):
        with private_graph() as graph:
            troubled, broken = _troubled(graph, grid_file, rng, book.total)
        with private_graph() as graph:
            differences = _replayed(graph, grid_file, troubled)
        trouble = f'malformed, late, duplicate, contradictory; {len(troubled[0])} valid between them'
        book.add(Measure(
            'answers', trouble, 'differences', float(len(differences)), 0.0, timed=False, count=book.total,
            broken='; '.join((*broken, *differences)[:5]),
        ))


def _troubled(
    graph: Graph, grid_file: str, rng: np.random.Generator, trials: int,
) -> tuple[tuple[list[Advice], str], list[str]]:
    """The advice log and the policy's digest at the end; what was accepted that should not be."""
    learner, crowd, broken, valid = _learner(graph, grid_file), Crowd(rng), [], 0
    good_at = set(rng.choice(trials, min(ACCEPTED_AT_MOST, max(1, trials // 5)), replace=False).tolist())
    for number in range(trials):
        if number in good_at:
            valid += _act(learner, crowd, valid)
        request = crowd.bad(learner.statuses[-1].query_id)
        response = graph.call(AnswerQuery, 'advise/answer', request)
        if response.accepted:
            broken.append(f'accepted: {request}')
    _rest(learner, valid)
    return (list(learner.log), learner.policies[-1].digest), broken


def _act(learner: Learner, crowd: Crowd, valid: int) -> int:
    """A good answer, or the last one taken back when nothing is asked; how many were accepted."""
    query_id = _rest(learner, valid)
    if not query_id:
        return int(learner.graph.call(Trigger, 'advise/undo').success)
    request = crowd.good(query_id)
    accepted = bool(learner.graph.call(AnswerQuery, 'advise/answer', request).accepted)
    if accepted:
        crowd.given.append(request)
    return int(accepted)


def _rest(learner: Learner, valid: int) -> int:
    """The open query once all that was accepted is learnt from, 0 when there is none."""
    resting = (LearnerStatus.ASKING, LearnerStatus.DONE)

    def rests() -> bool:
        status = learner.statuses[-1]
        return len(learner.log) == valid == learner.policies[-1].log_length and status.phase in resting \
            and status.policy_version == learner.policies[-1].version

    learner.graph.wait_until(rests, what=f'learning from {valid} entries of the log')
    return int(learner.statuses[-1].query_id)


def _learner(graph: Graph, grid_file: str) -> Learner:
    learner = Learner(graph, grid_file)
    learner.demonstrate(*DEMONSTRATIONS)
    learner.policy(len(DEMONSTRATIONS), 0)
    return learner


def _replayed(graph: Graph, grid_file: str, troubled: tuple[list[Advice], str]) -> list[str]:
    """How a learner that heard the valid answers alone differs."""
    log, digest = troubled
    learner = _learner(graph, grid_file)
    for number, entry in enumerate(log):
        query_id = _rest(learner, number)
        if entry.retracted:
            assert graph.call(Trigger, 'advise/undo').success
        elif query_id != entry.query_id or not learner.answer(query_id, entry.preferred, entry.avoided, entry.verdict).accepted:
            return [f'query {entry.query_id} was answered, the replay has {query_id}']
    _rest(learner, len(log))
    differences = [f'entry {a.advice_id} differs' for a, b in zip(log, learner.log, strict=True) if _said(a) != _said(b)]
    if learner.policies[-1].digest != digest:
        differences.append('the policy differs')
    return differences


def _said(entry: Advice) -> tuple[object, ...]:
    return entry.advice_id, entry.query_id, list(entry.states), list(entry.preferred), list(entry.avoided), entry.verdict, \
        entry.retracted

"""Talking to a running learner in tests."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from advise_msgs.msg import Advice, AdviceQuery, Demonstration, LearnerStatus, Policy
from advise_msgs.srv import AnswerQuery
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.gridfile import grid_to_mapping
from advise_ros.ros import convert, qos
from support.graph import Graph
from support.processes import Process
from support.walks import GRID_4X4, walk

LATCHED = qos.latched()
TOPICS = (
    ('advise/policy', Policy, LATCHED),
    ('advise/query', AdviceQuery, LATCHED),
    ('advise/status', LearnerStatus, LATCHED),
    ('advise/advice_log', Advice, qos.ADVICE_LOG),
)


def write_grid(folder: Path, grid: Grid, place: tuple[float, float] | None = None) -> str:
    """A grid file; `place`: latitude and longitude of its origin."""
    path = folder / f'grid_{grid.width}.yaml'
    path.write_text(f"grid: {grid_to_mapping(grid) | ({'origin_wgs84': list(place)} if place else {})}\n")
    return str(path)


class Learner:
    """An `advise` process and all that is heard of it."""

    def __init__(self, graph: Graph, grid_file: str, **params: object) -> None:
        self.graph = graph
        self.process: Process = graph.start('advise', {'grid_file': grid_file, 'acquisition': 'occupancy', **params})
        self.policies, self.queries, self.statuses, self.log = (graph.listen(*topic) for topic in TOPICS)
        for heard in (self.policies, self.queries, self.statuses, self.log):
            heard.clear()  # What an earlier learner said.

    def demonstrate(self, *numbers: int, grid: Grid = GRID_4X4) -> None:
        """Publish walks by their numbers."""
        for number in numbers:
            self.publish(convert.demonstration_to_msg(walk(grid, number)))

    def publish(self, demonstration: Demonstration) -> None:
        self.graph.publisher('demonstration', Demonstration, qos.DEMONSTRATIONS).publish(demonstration)

    def policy(self, demonstrations: int, log_length: int) -> Policy:
        """The policy from so many demonstrations and entries of the log."""
        found = (demonstrations, log_length)
        return self.graph.wait_for('advise/policy', Policy, lambda m: (m.demonstrations, m.log_length) == found, LATCHED)

    def query_of(self, policy: Policy) -> AdviceQuery:
        return self.graph.wait_for('advise/query', AdviceQuery, lambda m: m.policy_version == policy.version, LATCHED)

    def status(self, phase: int, words: str = '') -> LearnerStatus:
        return self.graph.wait_for('advise/status', LearnerStatus, lambda m: m.phase == phase and words in m.message, LATCHED)

    def open_query(self) -> int:
        """Id of the query that is open, once learning rests: that of the newest policy heard, not of an older one."""
        def asked() -> int:
            told = self.statuses[-1] if self.statuses and self.policies else None
            rests = told is not None and told.phase == LearnerStatus.ASKING
            return told.query_id if rests and told.policy_version >= self.policies[-1].version else 0

        return self.graph.wait_until(asked, what='an open query')

    def answer(
        self, number: int, preferred: Sequence[int] = (), avoided: Sequence[int] = (), verdict: int = 0,
    ) -> AnswerQuery.Response:
        request = AnswerQuery.Request(
            query_id=number, verdict=verdict, preferred=preferred, avoided=avoided, expert_id='anna', comment='a "word"',
        )
        return self.graph.call(AnswerQuery, 'advise/answer', request)

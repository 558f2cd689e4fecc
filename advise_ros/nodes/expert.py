"""A simulated person at the other end of the questions."""

from __future__ import annotations

import sys

import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.task import Future

from advise_msgs.msg import AdviceQuery
from advise_msgs.srv import AnswerQuery
from advise_ros.config import ExpertConfig
from advise_ros.core.advice.advice import Answer, Query
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.known_site import site_of
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.nodes.route_grid import grid_if_named, grid_of
from advise_ros.recording.wishfile import load_wish
from advise_ros.ros import calls, convert, convert_advice, diagnostics, qos, run
from advise_ros.ros.configured import ConfiguredNode

# How long to wait for the service to appear or to reply before trying again (steady time).
RETRY_S = 0.25
REPLY_TIMEOUT_S = 10.0


class ExpertNode(ConfiguredNode):
    """Answers `advise/query` by the service `advise/answer`, as a person with a known route would.

    It prefers the actions that are right in most of a question's cells and avoids those that are right in
    none; a share `error_rate` of its answers is wrong, a share `skip_rate` of the questions is skipped, and
    it thinks for `thinking_time_s` first. What it says to a query depends on the seed and the query alone.
    The true route is that of `grid_file`, or of the query when none is given; it goes round the cells of
    `wish_file`. It stays until it is stopped.

    Example: ros2 run advise_ros expert --ros-args -p error_rate:=0.1 -p thinking_time_s:=2.0
    Next: `policy` flies what was learnt; `answer` shows what was said.
    """

    def __init__(self) -> None:
        super().__init__('expert')
        self.config = self.load(ExpertConfig)
        self._diagnostics = diagnostics.Diagnostics(self)
        named = grid_of if self.config.wish_file else grid_if_named  # A wish is about the cells of a grid file.
        self._grid = named(self, self.config)
        self._wish = load_wish(self.config.wish_file, self._grid) if self._grid is not None else ()
        self._answer: Answer | None = None
        self._sent: Future | None = None
        self._client = self.create_client(AnswerQuery, 'advise/answer')
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        pause_s = max(self.config.thinking_time_s, 1e-3)
        self._thinking = self.create_timer(pause_s, self._on_thought, clock=steady, autostart=False)
        self._retry = self.create_timer(RETRY_S, self._say, clock=steady, autostart=False)
        self._timeout = self.create_timer(REPLY_TIMEOUT_S, self._on_timeout, clock=steady, autostart=False)
        self.create_subscription(AdviceQuery, 'advise/query', self._on_query, qos.latched())
        self._diagnostics.set(diagnostics.WARN, f"waiting for a query on {self.resolve_topic_name('advise/query')}")

    def _on_query(self, message: AdviceQuery) -> None:
        """A new question takes the place of one that is not answered yet."""
        self._forget()
        query = convert_advice.query_from_msg(message)
        if query is None:
            self.get_logger().info(f'nothing to answer: {message.question}')
            self._diagnostics.set(diagnostics.OK, f'nothing to answer: {message.question}')
            return
        try:
            self._answer = self._think(query, convert.grid_from_msg(message.grid))
        except InputError as problem:
            self.get_logger().warning(f'query {query.query_id} cannot be answered: {problem}')
            self._diagnostics.set(diagnostics.WARN, f'query {query.query_id} cannot be answered: {problem}')
            return
        self._diagnostics.set(diagnostics.OK, f'thinking about query {query.query_id}')
        self._thinking.reset()

    def _think(self, query: Query, asked: Grid) -> Answer:
        if self._grid is not None and self._grid != asked:
            raise InputError(f"it is about another grid than {self.config.grid_file}; use the learner's grid file")
        if any(not 0 <= state < asked.n_states for state in query.states):
            raise InputError(f'it names a state outside 0 to {asked.n_states - 1}')
        rng = np.random.default_rng([self.config.seed, query.query_id])
        config = self.config
        expert = SimulatedExpert(
            asked, rng, config.avoid, config.error_rate, config.skip_rate, config.expert_id, config.prefer,
            site_of(asked, self._wish).right,
        )
        return expert.answer(query)

    def _on_thought(self) -> None:
        self._thinking.cancel()
        self._say()

    def _say(self) -> None:
        """Send the answer, or try again soon while the service is missing."""
        if self._answer is None or self._sent is not None:
            self._retry.cancel()
        elif not self._client.service_is_ready():
            self._diagnostics.set(diagnostics.WARN, f'waiting for service {self._client.srv_name}')
            self._retry.reset()
        else:
            self._retry.cancel()
            answer = self._answer
            self._sent = self._client.call_async(convert_advice.answer_to_request(answer))
            self._sent.add_done_callback(lambda sent: self._on_reply(answer, sent))
            self._timeout.reset()

    def _on_reply(self, answer: Answer, sent: Future) -> None:
        """The next question may have come before this."""
        reply, said = sent.result(), calls.in_words(answer)
        outcome = 'accepted' if reply.accepted else 'refused'
        self.get_logger().info(f'{said} -> {outcome}: {reply.message}')
        if sent is self._sent:
            self._diagnostics.set(diagnostics.OK, f'{said}; {outcome}')
            self._forget()

    def _on_timeout(self) -> None:
        """The learner may have died with the request: ask the one that serves now. A repeated answer is refused, no more."""
        self._timeout.cancel()
        if self._sent is not None:
            self.get_logger().warning(f'no reply from {self._client.srv_name} within {REPLY_TIMEOUT_S:g} s; trying again')
            self._client.remove_pending_request(self._sent)
            self._sent = None
            self._say()

    def _forget(self) -> None:
        """No answer under way."""
        for timer in (self._thinking, self._retry, self._timeout):
            timer.cancel()
        self._answer = self._sent = None


def main() -> None:
    sys.exit(run.run_node(ExpertNode, ExpertConfig))

"""Replay through the real nodes: recorder, learner and policy live through the recorded session again, by /clock."""

from __future__ import annotations

import os
import time
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from advise_msgs import action, srv
from advise_ros.config import RecorderConfig
from advise_ros.core.errors import InputError
from advise_ros.recording.messages import Message
from advise_ros.replay.demonstrations import is_flown
from advise_ros.replay.flight_parts import UNDER_WAY
from advise_ros.replay.flights import FROM_OUTSIDE
from advise_ros.replay.live_listener import RecorderProgress, is_matched
from advise_ros.replay.live_nodes import NODES, LiveNodes
from advise_ros.replay.recorded_input import PublishedLive
from advise_ros.replay.score import (
    STATUS_TYPE,
    Advise,
    Demonstrated,
    Fly,
    Learnt,
    Publish,
    Score,
    Step,
    Stop,
    score_of,
    stamp_ns_of,
)
from advise_ros.replay.session import RecordedSession, at
from advise_ros.ros import convert, qos
from advise_ros.ros.graph_client import GraphClient, GraphTimeoutError
from advise_ros.ros.subscriptions import message_class

START_PATIENCE_S, LEARN_PATIENCE_S, PATIENCE_S, COMMAND_PATIENCE_S = 300.0, 300.0, 60.0, 1.0
# A node that is short of processor time answers late; after one that never came, later ones are waited for less.
COMMAND_TRIES, COMMAND_TRIES_AFTER = 40, 2
GOAL_TRIES = 10
# At most this many positions may be on their way, with clock and commands beside them: less than a socket holds (200 KiB, a
# KiB a message), and as many as the recorder receives before it reports them.
MOST_MISSING = 50


class Live:
    """The three nodes in a ROS domain of their own, and what plays the recorded world to them. A context manager.

    Nothing of it reaches a vehicle: another domain than the user's, this machine only.

    Args:
        speed: recorded seconds a second, at most; it waits for the nodes.
        domain: ROS domain that nothing else uses.

    Raises:
        InputError: the session cannot be lived through again.
        AdviseError: a node ended, or did not do in time what it did in the bag.
    """

    def __init__(self, session: RecordedSession, *, speed: float, domain: int) -> None:
        self._session, self._speed = session, speed
        self._domain = domain
        recorder = session.config(RecorderConfig, 'recorder')
        if recorder.source != 'topics' or recorder.split != 'flights':
            raise InputError(f'{session.bag.path}: only sessions recorded from topics, flight by flight, can be replayed live')
        if changed := [node for node in NODES if f'{session.namespace}/{node}' in session.changes]:
            raise InputError(
                f'{session.bag.path}: parameters of {", ".join(changed)} were set while it ran, and nobody sets them '
                'again; replay it without --live'
            )
        if session.began_late:
            raise InputError(
                f'{session.bag.path}: its recording began when others had published already; replay it without --live, which '
                'says what the bag lacks'
            )
        self.score: Score = score_of(session, recorder.pose_source)
        self._pose_topic = f'{session.namespace}/{recorder.pose_source}'
        self._nodes = LiveNodes(session)
        self._progress: dict[str, RecorderProgress] = {}
        self._clock_ns = -1
        self._ends = {
            convert.stamp_to_ns(one.value.window_end) for one in session.on('demonstration') if is_flown(one.value)
        }
        self._landed_by_policy = False
        self._status_sent = False
        self.late: list[str] = []
        self.lost = 0
        self._tries = COMMAND_TRIES

    def __enter__(self) -> Live:
        os.environ.update(ROS_DOMAIN_ID=str(self._domain), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
        space = ['--ros-args', '-r', f'__ns:={self._session.namespace}'] if self._session.namespace else []
        rclpy.init(args=space, domain_id=self._domain, signal_handler_options=SignalHandlerOptions.NO)
        self._client = GraphClient('replay', self._nodes.check)
        self.published = PublishedLive(self._client)
        self._clock = self._client.node.create_publisher(Clock, '/clock', 100)
        self._publishers = {
            topic: self._client.node.create_publisher(message_class(kind), topic, _offer(topic))
            for topic, kind in self.score.topics.items()
        }
        return self

    def __exit__(self, *_: object) -> None:
        self._nodes.stop()
        self._client.close()

    # -- the performance ---------------------------------------------------------------------
    def play(self) -> None:
        """Play all steps; the clock stands until every node receives what is sent."""
        self._nodes.start()
        if not self.score.steps:
            return
        first_ns = self.score.steps[0][0]
        self._tick(first_ns)
        self._wait_for_matches()
        begin_s, held_s = time.monotonic(), 0.0
        for log_ns, step in self.score.steps:
            ahead_s = (log_ns - first_ns) / 1e9 / self._speed - (time.monotonic() - begin_s - held_s)
            if ahead_s > 0:
                time.sleep(ahead_s)
            self._tick(log_ns)
            waited_from_s = time.monotonic()
            self._do(step)
            held_s += 0.0 if isinstance(step, Publish) else time.monotonic() - waited_from_s

    def _tick(self, stamp_ns: int) -> None:
        if stamp_ns != self._clock_ns:
            self._clock_ns = stamp_ns
            self._clock.publish(Clock(clock=convert.stamp_from_ns(stamp_ns)))

    def _wait_for_matches(self) -> None:
        """Until the nodes' readers are matched, and the recorder reports that it received a position."""
        for topic, publisher in self._publishers.items():
            matched = lambda publisher=publisher: is_matched(self._client.node, publisher, self._nodes.names) or None  # noqa: E731
            self._client.wait(f'the nodes to listen to {topic}', matched, START_PATIENCE_S)
        if 'advise' in self._nodes.names:
            self._client.wait('the learner', lambda: self._client.learner, START_PATIENCE_S)
        if 'recorder' in self._nodes.names:
            for topic in {self._pose_topic, f'{self._session.namespace}/cmd_vel'} & self._publishers.keys():
                kind = message_class(self.score.topics[topic])
                self._progress[topic] = progress = RecorderProgress(self._client, self._publishers[topic], kind, topic)
                progress.mark()
                reached = lambda progress=progress: progress.reached() or None  # noqa: E731
                self._client.wait(f'the recorder to receive {topic}', reached, START_PATIENCE_S)
                progress.reset()

    def _send(self, message: Message) -> None:
        self._publishers[message.topic].publish(message.data)
        if message.topic in self._progress:
            self._progress[message.topic].sent()

    def _await_recorder(self) -> None:
        """Until the recorder has had all positions and commands that were sent."""
        for progress in self._progress.values():
            progress.mark()
        for topic, progress in self._progress.items():
            self._in_time(f'the recorder to receive all of {topic}', progress.reached, PATIENCE_S)
            self.lost = max(self.lost, progress.missing)

    # -- steps -------------------------------------------------------------------------------
    def _do(self, step: Step) -> None:
        if isinstance(step, Publish):
            self._publish(step)
        elif isinstance(step, Demonstrated):
            self._await_demonstration(step)
        elif isinstance(step, Stop):
            self._stop()
        elif isinstance(step, Advise):
            self._advise(step)
        elif isinstance(step, Learnt):
            self._await_policy(step)
        elif isinstance(step, Fly):
            self._fly(step)
        else:
            self._client.trigger('policy/stop')
            self._await_recorder()

    def _publish(self, step: Publish) -> None:
        if step.message.topic not in self._publishers:
            return
        if step.message.topic == self._pose_topic:
            self._publish_pose(step)
            return
        self._send(step.message)
        if step.message.type_name == STATUS_TYPE and not self._status_sent:
            self._status_sent = True
            self._acknowledged()  # An acknowledgement takes seconds; it shows that its reader has matched us, too.

    def _publish_pose(self, step: Publish) -> None:
        if self._landed_by_policy and not step.command_stamp_ns:
            self._await_landing()
        if stamp_ns_of(step.message) in self._ends:  # It may close the demonstration, which waits for no late command.
            self._await_recorder()
        self._send(step.message)
        if step.command_stamp_ns:
            self._await_command(step)
        progress = self._progress.get(self._pose_topic)
        if progress is not None and progress.missing > MOST_MISSING:
            self._in_time('the recorder to keep up', lambda: progress.missing <= MOST_MISSING, PATIENCE_S)
            progress.reset()

    def _await_landing(self) -> None:
        """The recorder, too, must know that the flight is over: what follows may be one of a pilot."""
        self._landed_by_policy = False
        over = lambda: self._client.flight is not None and self._client.flight.phase not in UNDER_WAY  # noqa: E731
        self._in_time('the end of the flight', over, PATIENCE_S)
        self._await_recorder()

    def _await_command(self, step: Publish) -> None:
        """Positions are best effort: one that brings no command is sent again."""
        for _ in range(self._tries):
            if self.published.has_command(step.command_stamp_ns, COMMAND_PATIENCE_S):
                return
            self._send(step.message)
        self._tries = COMMAND_TRIES_AFTER
        self.late.append(f'no command bears the stamp {at(step.command_stamp_ns)}')

    def _await_demonstration(self, step: Demonstrated) -> None:
        wanted = step.recorded.value.demonstration_id
        there = lambda: any(one.demonstration_id == wanted for one in self.published.demonstrations)  # noqa: E731
        self._in_time(f'demonstration {wanted}', there, PATIENCE_S)

    def _stop(self) -> None:
        """Call recorder/stop once the recorder has received all that it had then."""
        self._await_recorder()
        self._client.trigger('recorder/stop')

    def _advise(self, step: Advise) -> None:
        record = step.record
        if record.retracted:
            self._client.call(srv.RetractAdvice, 'advise/retract', srv.RetractAdvice.Request(advice_id=record.advice_id))
            return
        self._in_time(f'query {record.query_id}', lambda: record.query_id in self._client.queries, LEARN_PATIENCE_S)
        request = srv.AnswerQuery.Request(
            query_id=record.query_id, verdict=int(record.verdict), preferred=list(record.preferred),
            avoided=list(record.avoided), expert_id=record.expert_id, comment=record.comment,
        )
        if int(record.verdict) == srv.AnswerQuery.Request.SPLIT:
            request.part = list(record.states)
        self._client.call(srv.AnswerQuery, 'advise/answer', request)

    def _await_policy(self, step: Learnt) -> None:
        value = step.recorded.value
        key = (value.demonstrations, value.log_length)
        self._in_time(
            f'the policy from {key[0]} demonstrations and {key[1]} entries of the log',
            lambda: any((p.demonstrations, p.log_length) == key for p in self.published.policies), LEARN_PATIENCE_S,
        )

    def _fly(self, step: Fly) -> None:
        first = step.flight.statuses[0].value
        budget = max(int(one.value.step_budget) for one in step.flight.statuses)
        goal = action.Fly.Goal(start_cell=int(first.start_cell), policy_version=int(first.policy_version), step_budget=budget)
        self._landed_by_policy = step.flight.statuses[-1].value.phase not in FROM_OUTSIDE
        for _ in range(GOAL_TRIES):
            if self._has_begun(step, goal):
                return
        self.late.append(f'the flight at {at(step.flight.statuses[0].stamp_ns)} did not begin as it had')

    def _has_begun(self, step: Fly, goal: Any) -> bool:
        """Begin by the position that it had begun by; a goal can be met before the position that was sent before it."""
        flights = self.published.flights
        if step.pose is not None:  # While the clock stood, the last position has become too old to begin with.
            self._send(step.pose)
        self._acknowledged()
        if not self._client.begin_flight(goal, PATIENCE_S):
            return False
        self._in_time('the flight to begin', lambda: self.published.flights > flights, PATIENCE_S)
        began = self.published.beginning(flights + 1)
        if began is None or step.pose is None or convert.stamp_to_ns(began.header.stamp) == stamp_ns_of(step.pose):
            return True
        self._client.trigger('policy/stop')
        self.published.forget_flight(flights + 1)
        return False

    def _acknowledged(self) -> None:
        """Until the vehicle's last state is with its readers: it decides whether a flight may begin."""
        status = self._publishers.get(f'{self._session.namespace}/vehicle_status')
        if status is not None:
            status.wait_for_all_acked(Duration(seconds=PATIENCE_S))

    def _in_time(self, what: str, predicate: Any, timeout_s: float) -> None:
        """Wait; what does not come in time is missing in the comparison."""
        try:
            self._client.wait(what, lambda: predicate() or None, timeout_s)
        except GraphTimeoutError:
            self.late.append(f'{what} did not come in {timeout_s:g} s')

    def settle(self) -> None:
        """Wait for the last policy's question."""
        wanted = len(self._session.on('advise/query'))
        self._in_time('the last question', lambda: len(self.published.queries) >= wanted, PATIENCE_S)


def _offer(topic: str) -> Any:
    if topic.endswith('/vehicle_status'):
        return qos.latched(100)
    return qos.DEMONSTRATIONS if topic.endswith('/demonstration') else qos.COMMAND_DEEP

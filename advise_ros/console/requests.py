"""Takes a person's acts to the graph; keeps an answer while the learner is away, and gives it once."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future as Promise
from dataclasses import dataclass, replace
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from advise_msgs.srv import AnswerQuery, PreviewAnswer, RetractAdvice, TakeBack
from advise_ros.console import request_check
from advise_ros.console.flight_goals import FlightGoals, Reply, no, resolve
from advise_ros.console.hand import HandFlight
from advise_ros.console.language import mark
from advise_ros.console.listener import GraphListener
from advise_ros.console.route_delivery import RouteDelivery
from advise_ros.core.advice.advice import Answer, Code
from advise_ros.core.errors import InputError
from advise_ros.ros import convert_advice

TICK_S = 0.1
# A request without reply for this long (steady time) is given up.
PATIENCE_S = 15.0
# A learner that does not know the question may ask it again under another number within this time.
ASKED_PATIENCE_S = 20.0
NOT_OPEN = (Code.UNKNOWN_QUERY, Code.STALE_QUERY)
# Replies remembered, so that an answer sent again gets the same one.
REMEMBERED = 500
# Answers kept while the learner is away.
KEPT_MOST = 50


@dataclass
class PendingAnswer:
    """An answer on its way.

    Attributes:
        states: those that the person saw.
        since_s: when it came (steady time).
        refused: what the learner said when it knew nothing of the question, None while it did not.
    """

    uid: str
    answer: Answer
    states: tuple[int, ...]
    promise: Promise[Reply]
    since_s: float
    sent: Future | None = None
    sent_s: float = 0.0
    refused: Reply | None = None


@dataclass
class PendingRequest:
    """A request under way."""

    promise: Promise[Reply]
    future: Future
    until_s: float
    what: str


class RequestDispatcher:
    """Services and actions of the graph, as a page or a terminal asks for them.

    `act` may be called in any thread; the rest happens in the thread of the node's executor. Its promise always
    gets a reply, a dict with `ok` and `message`; an answer's only when the learner has taken or refused it.
    """

    def __init__(
        self, node: Node, listener: GraphListener, hand: HandFlight | None = None, delivery: RouteDelivery | None = None,
    ) -> None:
        """Requests of windows, or of a terminal, which has no hand and takes no route along."""
        self._node, self._listener = node, listener
        self._hand, self._delivery = hand, delivery
        self._take_back = node.create_client(TakeBack, 'recorder/take_back')
        self._trigger = {name: node.create_client(Trigger, service) for name, service in request_check.TRIGGERS.items()}
        self._answer = node.create_client(AnswerQuery, 'advise/answer')
        self._preview = node.create_client(PreviewAnswer, 'advise/preview')
        self._retract = node.create_client(RetractAdvice, 'advise/retract')
        self._goals = FlightGoals(node)
        self._inbox: deque[Callable[[], None]] = deque()
        self._kept: OrderedDict[str, PendingAnswer] = OrderedDict()
        self._replied: OrderedDict[str, Promise[Reply]] = OrderedDict()
        self._waiting: list[PendingRequest] = []
        self._lock = threading.Lock()
        self._wake = node.create_guard_condition(self._on_wake)
        node.create_timer(TICK_S, self._on_tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def hand(self) -> HandFlight:
        """By which windows fly; a terminal has none."""
        assert self._hand is not None
        return self._hand

    # -- from any thread ---------------------------------------------------------------------
    def act(self, name: str, given: Mapping[str, Any]) -> Promise[Reply]:
        """Do what a person wants.

        Args:
            name: 'answer', 'preview', 'retract', 'fly' or one of `acts.TRIGGERS`.
            given: what the page sent with it.
        """
        promise: Promise[Reply] = Promise()
        try:
            begin = self._plan(name, given, promise)
        except InputError as problem:
            promise.set_result(no(mark('this was not sent: {problem}'), problem=str(problem)))
            return promise
        with self._lock:
            self._inbox.append(begin)
        self._wake.trigger()
        return promise

    def _plan(self, name: str, given: Mapping[str, Any], promise: Promise[Reply]) -> Callable[[], None]:
        if name == 'hold' and self._hand is not None:
            return lambda: self._hold(promise)
        if name in request_check.TRIGGERS:
            return lambda: self._call(promise, self._trigger[name], Trigger.Request(), name)
        if name == 'answer':
            answer, states = request_check.answer_of(given), request_check.asked_states(given)
            kept = PendingAnswer(request_check.unique_id(given), answer, states, promise, time.monotonic())
            return lambda: self._take(kept)
        if name == 'preview':
            request = _preview_of(request_check.answer_of(given))
            return lambda: self._call(promise, self._preview, request, name)
        if name == 'retract':
            retract = RetractAdvice.Request(advice_id=request_check.advice_id(given))
            return lambda: self._call(promise, self._retract, retract, name)
        if name == 'fly':
            return lambda: self._send_off(promise)
        if name in ('route_file', 'route_upload') and self._delivery is not None:
            return self._plan_delivery(self._delivery, name, given, promise)
        return self._plan_teaching(name, given, promise)

    def _plan_teaching(self, name: str, given: Mapping[str, Any], promise: Promise[Reply]) -> Callable[[], None]:
        if name in ('hand_take', 'hand_release'):
            act, window = (self.hand.take if name == 'hand_take' else self.hand.release), str(given.get('window'))
            return lambda: promise.set_result(act(window))
        if name == 'lesson_discard':
            back = TakeBack.Request(demonstration_id=request_check.demonstration_id(given))
            return lambda: self._call(promise, self._take_back, back, name)
        if name == 'lesson_name':
            lesson, words = request_check.demonstration_id(given), request_check.lesson_name(given)
            return lambda: promise.set_result(self._listener.lessons.rename(lesson, words))
        if name == 'lessons_file':
            return lambda: promise.set_result(self._listener.lessons.file())
        raise InputError('it is unknown')

    def _plan_delivery(
        self, delivery: RouteDelivery, name: str, given: Mapping[str, Any], promise: Promise[Reply],
    ) -> Callable[[], None]:
        def deliver() -> None:
            try:
                if name == 'route_file':
                    promise.set_result(delivery.file(form))
                else:
                    delivery.send(promise)
            except InputError as problem:
                promise.set_result(no(mark('this was not done: {problem}'), problem=str(problem)))

        form = request_check.route_form(given) if name == 'route_file' else ''
        return deliver

    # -- in the node's thread ----------------------------------------------------------------
    def _on_wake(self) -> None:
        with self._lock:
            begun, self._inbox = list(self._inbox), deque()
        for begin in begun:
            begin()

    def _hold(self, promise: Promise[Reply]) -> None:
        """Whoever flies: a hand loses its stick, the policy stops."""
        self.hand.release()
        self._call(promise, self._trigger['hold'], Trigger.Request(), 'hold')

    def _call(self, promise: Promise[Reply], client: Any, request: Any, what: str) -> None:
        if not client.service_is_ready():
            service = self._node.resolve_service_name(client.srv_name)
            promise.set_result(no(mark('nobody serves {service}; is its node running?'), service=service))
            return
        self._await(promise, client.call_async(request), what)

    def _await(self, promise: Promise[Reply], future: Future, what: str) -> None:
        future.add_done_callback(lambda done: None if done.cancelled() else resolve(promise, reply_of(done.result())))
        self._waiting.append(PendingRequest(promise, future, time.monotonic() + PATIENCE_S, what))

    def _send_off(self, promise: Promise[Reply]) -> None:
        """Fly the newest policy from the route's start."""
        grid = self._listener.grid
        if grid is None or not self._goals.is_served:
            promise.set_result(no(mark('nobody flies here: the policy node is not running')))
            return
        sent = self._goals.send(promise, grid.waypoints[-1])
        self._waiting.append(PendingRequest(promise, sent, time.monotonic() + PATIENCE_S, 'fly'))

    # -- answers -----------------------------------------------------------------------------
    def _take(self, kept: PendingAnswer) -> None:
        """An answer that came before gets the reply of the first one."""
        earlier = self._replied.get(kept.uid) or (self._kept[kept.uid].promise if kept.uid in self._kept else None)
        if earlier is not None:
            earlier.add_done_callback(lambda done: resolve(kept.promise, done.result()))
            return
        if len(self._kept) >= KEPT_MOST:
            resolve(kept.promise, no(mark('{n} answers wait for the learner already'), n=KEPT_MOST))
            return
        self._kept[kept.uid] = kept
        self._forward()

    def _forward(self) -> None:
        for kept in [kept for kept in self._kept.values() if kept.sent is None]:
            if self._answer.service_is_ready() and self._listener.learner_alive():
                self._give_if_asked(kept)
        self._listener.board.put('kept', [kept.uid for kept in self._kept.values() if kept.sent is None])

    def _give_if_asked(self, kept: PendingAnswer) -> None:
        """Give an answer to the question that the person saw.

        A learner that was started again asks the same under another number, and something else under the same one.
        """
        query = self._listener.query
        if kept.refused is not None and (query is None or query.query_id == kept.answer.query_id):
            return  # The learner's new question is not heard yet.
        if query is not None and query.states == kept.states:
            kept.answer = replace(kept.answer, query_id=query.query_id)
        elif kept.refused is not None or (query is not None and query.query_id == kept.answer.query_id):
            message = kept.refused['message'] if kept.refused else 'the question has changed'
            self._finish(kept, no(mark('{message}; the answer to the old question was not given'), message=message))
            return
        self._give(kept)

    def _give(self, kept: PendingAnswer) -> None:
        kept.sent, kept.sent_s = self._answer.call_async(convert_advice.answer_to_request(kept.answer)), time.monotonic()
        kept.sent.add_done_callback(lambda done: self._on_reply(kept, done))

    def _on_reply(self, kept: PendingAnswer, done: Future) -> None:
        if done is not kept.sent:
            return  # It was given up.
        reply = reply_of(done.result())
        if not reply['ok'] and self._is_logged(kept.answer):
            reply = {'ok': True, 'message': 'it was noted before the connection was lost'}
        if reply.get('code') in NOT_OPEN and time.monotonic() - kept.since_s < ASKED_PATIENCE_S:
            kept.sent, kept.refused = None, reply
        else:
            self._finish(kept, reply)

    def _is_logged(self, answer: Answer) -> bool:
        """Whether the learner had taken it, and only its reply was lost: the log has the same words."""
        said = (answer.query_id, answer.verdict, answer.preferred, answer.avoided, answer.expert_id, answer.comment)
        return any(
            said == (one.query_id, one.verdict, one.preferred, one.avoided, one.expert_id, one.comment)
            for one, _ in self._listener.entries
        )

    def _finish(self, kept: PendingAnswer, reply: Reply) -> None:
        self._kept.pop(kept.uid, None)
        self._replied[kept.uid] = kept.promise
        while len(self._replied) > REMEMBERED:
            self._replied.popitem(last=False)
        resolve(kept.promise, reply)
        self._forward()

    def _on_tick(self) -> None:
        """Try what is kept again, and give up what nobody replies to."""
        now = time.monotonic()
        for kept in self._kept.values():
            if kept.sent is not None and (now - kept.sent_s > PATIENCE_S or not self._listener.learner_alive()):
                self._answer.remove_pending_request(kept.sent)
                kept.sent, kept.since_s = None, now
        for kept in list(self._kept.values()):
            if kept.refused is not None and now - kept.since_s > ASKED_PATIENCE_S:
                self._finish(kept, kept.refused)
            elif not self._listener.learner_alive():
                kept.since_s = now
        self._forward()
        for waiting in self._waiting:
            if now > waiting.until_s:
                silent = mark('no reply to {what} within {seconds} s: the node that serves it may be gone')
                resolve(waiting.promise, no(silent, what=waiting.what, seconds=f'{PATIENCE_S:g}'))
                waiting.future.cancel()  # The client forgets it, or it would keep every request that nobody replied to.
        self._waiting = [waiting for waiting in self._waiting if not waiting.promise.done()]


def _preview_of(answer: Answer) -> PreviewAnswer.Request:
    return PreviewAnswer.Request(
        query_id=answer.query_id, verdict=answer.verdict,
        preferred=list(answer.preferred), avoided=list(answer.avoided), part=list(answer.part),
    )


def reply_of(response: Any) -> Reply:
    """A service's response as the page reads it."""
    if isinstance(response, AnswerQuery.Response):
        return {
            'ok': response.accepted, 'code': int(response.code), 'message': response.message,
            'contradicts': [int(one) for one in response.contradicts], 'advice': int(response.advice_id),
        }
    if isinstance(response, PreviewAnswer.Response):
        return _preview_reply(response)
    return {'ok': response.success, 'message': response.message}  # Of a Trigger, RetractAdvice or TakeBack.


def _preview_reply(response: PreviewAnswer.Response) -> Reply:
    return {
        'ok': response.valid, 'code': int(response.code), 'message': response.message,
        'contradicts': [int(one) for one in response.contradicts],
        'changed': [int(state) for state in response.changed_states],
        'actions': [int(action) for action in response.changed_actions],
        'before': [int(state) for state in response.route_before],
        'after': [int(state) for state in response.route_after],
        'reaches': [response.reaches_goal_before, response.reaches_goal_after],
        'success': [response.expected_success_before, response.expected_success_after],
        'keepOut': [int(share) for share in response.keep_out_after],
        'entered': [[int(cell) for cell in cells] for cells in (response.entered_before, response.entered_after)],
        'seconds': response.solve_s,
    }

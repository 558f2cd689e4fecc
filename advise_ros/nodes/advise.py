"""The learner's node: demonstrations and answers in, policy and questions out."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future
from std_srvs.srv import Trigger

from advise_msgs import msg, srv
from advise_ros.config import AdviseConfig
from advise_ros.core.advice.advice import Outcome, active
from advise_ros.core.demonstrations.demonstration import Demonstration, known, standing
from advise_ros.core.errors import AdviseError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.learning.learner import Learned
from advise_ros.core.learning.session import Session
from advise_ros.core.site.prior import SitePrior
from advise_ros.nodes.route_grid import grid_of
from advise_ros.recording.demofile import load_demonstrations
from advise_ros.recording.gridfile import load_place
from advise_ros.recording.savedsession import LiveSession, SavedSession
from advise_ros.recording.sitefile import begin_site, save_site, site_text
from advise_ros.ros import calls, convert, convert_advice, diagnostics, preview, qos, run
from advise_ros.ros.configured import ConfiguredNode
from advise_ros.ros.learner_topics import LearnerTopics, Result, result_of
from advise_ros.ros.worker import Finished, Worker
from advise_ros.settings import learn_settings

Status = msg.LearnerStatus


def compare(grid: Grid, flights: tuple[Demonstration, ...], seed: int, prior: SitePrior) -> str:
    """What a person should read of flights that look like those of two; '' of one."""
    from advise_ros.core.site.within_advise import two_people_in_words  # noqa: PLC0415 - takes half a second to import

    return two_people_in_words(grid, flights, seed, prior)


class AdviseNode(ConfiguredNode):
    """Learns a route from demonstrations, asks about what it is unsure of, and learns from the answers.

    Listens to `demonstration`; one without moves takes the earlier one with its id back (`recorder/discard`), and
    the policy is learnt anew without it. Publishes `advise/policy`, `advise/query` (query id 0: nothing left to ask),
    `advise/status`, `advise/advice_log`, and for RViz `advise/uncertainty` (per cell the highest U_s of its
    layers, 100 = ln 4 nat), `advise/reward` (per cell the mean, 0 = -r_max, 50 = zero, 100 = +r_max),
    `advise/markers`, `advise/route` (nav_msgs/Path: where the policy leads), `advise/map` (the grid with its obstacles) and,
    with acquisition `site`, `advise/site_map` (per cell the probability in % that the person wants it kept out of); all
    latched.

    Services: `advise/answer`, `advise/preview` (what an answer would change; commits nothing),
    `advise/undo` (takes the last answer back) and `advise/retract` (takes one earlier answer back).

    It learns in a thread beside, so services reply while it learns; of previews that wait only the newest is
    tried. With `session_file` every accepted answer is on the disk before the service replies, and the next start
    goes on from there. With `site_map_out` what was learnt of the site is kept with each policy, as a map of
    nav2_map_server and a file beside it; with `site_map_file` another route over the site begins with it, and has a
    policy before anything is flown. What it began with is latched on `advise/site_prior`, so that bags hold it.

    Example: ros2 run advise_ros advise --ros-args -p grid_file:=config/grid_6x6.yaml
    Next: answer its questions by `ask`, `console` or `answer`; `policy` flies what it learnt.
    """

    def __init__(self) -> None:
        super().__init__('advise')
        self.config = self.load(AdviseConfig)
        self._diagnostics = diagnostics.Diagnostics(self)
        grid = grid_of(self, self.config)
        site = begin_site(self.config.site_map_file, self.config.site_map_out, grid)
        session = LiveSession(grid, learn_settings(self.config), self.config.budget, site.prior)
        self._saved = SavedSession(session, self.config.session_file)
        place = load_place(self.config.grid_file)
        self._topics = LearnerTopics(self, place.on_earth if place else None)
        self._topics.map(grid)
        self._topics.site_prior(site_text(site.prior))
        self._site_remark = site.remark
        self._learned: Learned | None = None
        self._learning = False
        self._learning_size: tuple[int, int] = (0, 0)
        self._change = 0  # Counts changes of what is learnt by.
        self._failure = ''
        self._failed_at: tuple[int, int] | None = None
        self._refused = self._not_kept = self._two_people = ''
        self._compared: tuple[Demonstration, ...] = ()
        self._solve_s = 0.0
        self._wake = self.create_guard_condition(self._deliver)
        self._worker = Worker(self._wake.trigger)
        self._tell_restored()
        self._tell_site()
        self._load_file()
        self._listen()
        self._learn()

    @property
    def _session(self) -> LiveSession:
        return self._saved.session

    def close(self) -> None:
        self._worker.close()
        self._saved.close()

    def _listen(self) -> None:
        self.create_subscription(msg.Demonstration, 'demonstration', self._on_demonstration, qos.DEMONSTRATIONS)
        self.create_service(srv.AnswerQuery, 'advise/answer', self._on_answer)
        self.create_service(Trigger, 'advise/undo', self._on_undo)
        self.create_service(srv.RetractAdvice, 'advise/retract', self._on_retract)
        # A preview waits for the worker; in a group of its own it holds up nobody.
        self.create_service(
            srv.PreviewAnswer, 'advise/preview', self._on_preview, callback_group=ReentrantCallbackGroup(),
        )

    # -- start -------------------------------------------------------------------------------
    def _tell_restored(self) -> None:
        loaded = self._saved.loaded
        for entry in loaded.entries:
            self._topics.advice(entry.record, entry.stamp_ns)
        for sentence in loaded.dropped:
            self.get_logger().warning(f'session file {self.config.session_file}: {sentence}')
        if loaded.entries:
            self.get_logger().info(f'{len(loaded.entries)} entries of the advice log restored from {self.config.session_file}')

    def _tell_site(self) -> None:
        if self._site_remark:
            self.get_logger().warning(f'site_map_file: {self._site_remark}')
        if self._session.prior:
            self.get_logger().info(f'known of the site from {self.config.site_map_file}: {self._session.prior.in_words}')

    def _load_file(self) -> None:
        if not self.config.demonstrations_file:
            return
        for demonstration in load_demonstrations(self.config.demonstrations_file, self._session.grid):
            self._session.add(demonstration)
            self._topics.demonstration(demonstration)

    # -- demonstrations ----------------------------------------------------------------------
    def _on_demonstration(self, message: msg.Demonstration) -> None:
        try:
            demonstration = convert.demonstration_from_msg(message)
            if known(demonstration, self._session.demonstrations):
                return
            self._session.add(demonstration)
        except (AdviseError, ValueError) as problem:
            self._refused = f'Demonstration {message.demonstration_id!r} was refused: {problem}.'
            self.get_logger().warning(self._refused)
            self._tell()
            return
        self._refused = ''
        moves = len(demonstration.states)
        told = f'{moves} moves' if moves else 'taken back'
        self.get_logger().info(f'demonstration {demonstration.demonstration_id}: {told}')
        self._learn()

    # -- learning ----------------------------------------------------------------------------
    def _learn(self) -> None:
        """Have the newest state learnt, unless the worker is at it already: it comes back here when done."""
        work = self._session.snapshot() if self._enough and not self._learning and self._failed_at != self._size else None
        if work is not None:
            self._learning, self._learning_size = True, self._size
            self._worker.submit(partial(result_of, work, self._session.budget_left), partial(self._on_learned, self._change))
        self._tell()

    def changed(self, names: frozenset[str]) -> None:
        """Whatever is published from now on is learnt by the new values, so a replay knows what was learnt by which."""
        if names & {'enough', 'budget'}:
            self._session.change(learn_settings(self.config), self.config.budget)
            self._change, self._failed_at = self._change + 1, None
        self._learn()

    @property
    def _enough(self) -> bool:
        return bool(self._session.prior) or len(self._session.standing) >= self.config.demonstrations_min

    def _deliver(self) -> None:
        """The worker has woken the executor."""
        self._worker.deliver()

    @property
    def _size(self) -> tuple[int, int]:
        """What came to learn from, what was taken back included; both only grow."""
        return len(self._session.demonstrations), len(self._session.log)

    def _on_learned(self, change: int, finished: Finished) -> None:
        self._learning = False
        if change != self._change:
            pass  # By parameters that were changed meanwhile: it is learnt anew.
        elif finished.error is not None:
            self._on_failure(finished.error)
        elif self._session.adopt(finished.value.learned):
            self._failure, self._failed_at, self._solve_s = '', None, finished.value.solve_s
            self._publish(finished.value)
        self._learn()

    def _on_failure(self, error: Exception) -> None:
        """The policy and the session stay as they are; the next demonstration or answer tries again."""
        reason = str(error) if isinstance(error, AdviseError) else f'{type(error).__name__}: {error}'
        remedy = 'The policy stays as it was; a demonstration, an answer or advise/undo tries again.'
        self._failure = f'Learning failed: {reason}. {remedy}'
        self._failed_at = self._learning_size
        self.get_logger().error(self._failure)

    def _publish(self, result: Result) -> None:
        self._learned = learned = result.learned
        if learned.query is not None:
            self._note_asked(learned.query.query_id)
        self._topics.learned(result.messages)
        held = standing(self._session.demonstrations[: learned.n_demonstrations])
        self.get_logger().info(
            f'policy {learned.version} from {len(held)} demonstrations and '
            f'{learned.log_length} log entries in {self._solve_s:.3f} s by {learned.solver}'
        )
        self.get_logger().info(self._question())
        self._keep_site(learned)
        self._compare(learned)

    def _compare(self, learned: Learned) -> None:
        """Whether the flights are one person's is looked at when there is nothing else to do, once for the same flights."""
        flights = standing(self._session.demonstrations)
        if learned.keep_out is None or flights == self._compared:
            return
        self._compared, self._two_people = flights, ''
        seed, prior = learned.settings.seed, self._session.prior
        self._worker.submit_idle(partial(compare, learned.grid, flights, seed, prior), partial(self._on_compared, flights))

    def _on_compared(self, flights: tuple[Demonstration, ...], finished: Finished) -> None:
        if flights != self._compared:
            return
        if finished.error is not None:
            self.get_logger().error(f"whether the flights are one person's could not be looked at: {finished.error}")
            return
        self._two_people = finished.value
        if self._two_people:
            self.get_logger().warning(self._two_people)
            self._tell()

    def _keep_site(self, learned: Learned) -> None:
        """What was learnt of the site is on the disk with each policy."""
        self._not_kept = ''
        if not self.config.site_map_out or learned.keep_out is None:
            return
        try:
            save_site(self.config.site_map_out, learned.grid, learned.keep_out, self._session.kept(learned))
        except AdviseError as problem:
            self._not_kept = f'What was learnt of the site is not kept: {problem}.'
            self.get_logger().error(self._not_kept)

    def _note_asked(self, query_id: int) -> None:
        try:
            self._saved.note_asked(query_id)
        except AdviseError as problem:
            self.get_logger().warning(f'{problem}; after a restart query id {query_id} may be used again')

    # -- services ----------------------------------------------------------------------------
    def _on_answer(self, request: srv.AnswerQuery.Request, response: srv.AnswerQuery.Response) -> srv.AnswerQuery.Response:
        answer = convert_advice.answer_from_request(request)
        outcome = self._commit(lambda session: session.submit(answer))
        self.get_logger().info(f'answer to query {answer.query_id}: {outcome.message}')
        return convert_advice.fill_answer(response, outcome)

    def _on_undo(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        outcome = self._commit(lambda session: session.undo())
        response.success, response.message = outcome.accepted, outcome.message
        return response

    def _on_retract(self, request: srv.RetractAdvice.Request, response: srv.RetractAdvice.Response) -> srv.RetractAdvice.Response:
        outcome = self._commit(lambda session: session.retract(int(request.advice_id)))
        response.success, response.message = outcome.accepted, outcome.message
        return response

    def _commit(self, act: Callable[[Session], Outcome]) -> Outcome:
        """An accepted record is on the disk, then in the advice log, then learnt from."""
        stamp_ns = self._topics.now_ns()
        outcome = self._saved.commit(act, stamp_ns)
        if outcome.record is not None:
            self._topics.advice(outcome.record, stamp_ns)
            self._learn()
        return outcome

    async def _on_preview(
        self, request: srv.PreviewAnswer.Request, response: srv.PreviewAnswer.Response,
    ) -> srv.PreviewAnswer.Response:
        answer, before = convert_advice.answer_from_request(request), self._learned
        work, response.contradicts = self._session.preview(answer), list(self._session.check(answer).contradicts)
        if isinstance(work, Outcome) or before is None:
            return preview.fill_refused(response, work)
        done: Future = Future()
        self._worker.submit_newest(partial(preview.try_answer, response, before, work), done.set_result)
        finished = await done
        if finished.error is not None:
            response.valid, response.message = False, f'The answer could not be tried: {finished.error}.'
        return response

    # -- what people read --------------------------------------------------------------------
    def _tell(self) -> None:
        """Status and diagnostics as things stand."""
        phase, sentence = self._phase()
        notes = self._notes()
        text = ' '.join([*notes, sentence])
        self._topics.status(self._status(phase, text))
        level = diagnostics.ERROR if phase == Status.FAILED else diagnostics.OK
        if level == diagnostics.OK and (phase == Status.WAITING_FOR_DEMONSTRATIONS or notes):
            level = diagnostics.WARN
        self._diagnostics.set(level, text.splitlines()[0], {
            'demonstrations': len(self._session.standing), 'log entries': self._size[1],
        })

    def _notes(self) -> list[str]:
        """What is not as it should be, though work goes on; a sentence each."""
        notes = [note for note in (self._refused, self._not_kept, self._site_remark) if note]
        notes += [f'Session file {self.config.session_file}: {sentence}.' for sentence in self._saved.loaded.dropped]
        if self._two_people:
            notes.append(f'{self._two_people[0].upper()}{self._two_people[1:]}.')
        if self._learned is not None and self._learned.contradictions:
            sentence = calls.cannot_hold(self._learned.contradictions)
            notes.append(f'{sentence.capitalize()}; advise/retract takes one back.')
        return notes

    def _phase(self) -> tuple[int, str]:
        n_demonstrations = len(self._session.standing)
        if self._learning:
            return Status.LEARNING, f'Learning from {n_demonstrations} demonstrations and {self._size[1]} log entries.'
        if self._failure:
            return Status.FAILED, self._failure
        if self._learned is None or not self._enough:
            return Status.WAITING_FOR_DEMONSTRATIONS, self._waiting(n_demonstrations)
        return (Status.DONE if self._session.query is None else Status.ASKING), self._question()

    def _waiting(self, n_demonstrations: int) -> str:
        topic = self.resolve_topic_name('demonstration')
        sentence = f'Waiting for demonstrations on {topic}: {n_demonstrations} of {self.config.demonstrations_min}.'
        if self._learned is None:
            return sentence
        return f'{sentence} Policy {self._learned.version} rests on some that were taken back; do not fly it.'

    def _question(self) -> str:
        query = self._session.query
        if query is None:
            return convert_advice.nothing_to_ask(self._learned, self._session.budget_left)
        words = [option.word for option in query.options]
        how = calls.how_to_answer(self.resolve_service_name('advise/answer'), self.get_namespace(), query.query_id, words)
        return f'{query.question}\n{how}'

    def _status(self, phase: int, text: str) -> Status:
        query, learned = self._session.query, self._learned
        return Status(
            phase=phase, policy_version=learned.version if learned else 0,
            demonstrations=len(self._session.standing),
            demonstration_ids=sorted({found.demonstration_id for found in self._session.demonstrations}),
            answers=len(active(self._session.log)),
            query_id=query.query_id if query else 0, budget_left=self._session.budget_left,
            solve_s=self._solve_s, objective=learned.objective if learned else 0.0,
            doubt_left=learned.doubt_left if learned else 0.0, enough_advice=learned is not None and learned.enough_advice,
            contradictions=list(learned.contradictions) if learned else [], message=text,
            enough=learned.least_worth if learned else 0.0, worth_unit=learned.worth_unit if learned else '',
        )


def main() -> None:
    # A solve may still be running in the worker's thread; it must not meet an interpreter that is being taken down.
    run.exit_now(run.run_node(AdviseNode, AdviseConfig))

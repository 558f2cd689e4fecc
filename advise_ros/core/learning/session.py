"""One sitting with a person: demonstrations come in, questions go out, answers are told, taken back and learnt from.

Knows no clock and no thread: `snapshot` says what is to be learnt, `Work.run` may be called in any thread or
process, `adopt` takes the result.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from advise_ros.core.advice.advice import (
    AdviceRecord,
    Answer,
    Code,
    Fault,
    Outcome,
    Query,
    Verdict,
    check_log,
    fault,
    part_fault,
)
from advise_ros.core.advice.state import AdviceState, advice_state, against
from advise_ros.core.demonstrations.demonstration import Demonstration, standing
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.irl.solvers.local_preview import Solved
from advise_ros.core.learning.learner import Learned, check_grid, check_prior, kept_of, learn
from advise_ros.core.site.prior import NOTHING, SitePrior


@dataclass(frozen=True)
class Work:
    """Something to learn, apart from the session that goes on meanwhile; near `earlier`, if it is a preview.

    `prior` is what was learnt of the site on other routes.
    """

    grid: Grid
    settings: LearnSettings
    demonstrations: tuple[Demonstration, ...]
    log: tuple[AdviceRecord, ...]
    version: int
    next_query_id: int
    budget: int
    earlier: Solved | None = None
    prior: SitePrior = NOTHING

    def run(self) -> Learned:
        """`learn` on the snapshot.

        Raises:
            InputError: as `learn`.
        """
        return learn(
            self.grid, self.settings, self.demonstrations, self.log,
            version=self.version, next_query_id=self.next_query_id, budget=self.budget, earlier=self.earlier,
            prior=self.prior,
        )


class Session:
    """The ask / tell / undo loop.

    Args:
        grid: of every demonstration.
        settings: of every policy.
        budget: answers that the person is willing to give, -1 unlimited.
        prior: what was learnt of the site on other routes: with it, no demonstration is needed.

    Raises:
        InputError: there is a prior and the settings' acquisition has no use for it.
    """

    def __init__(self, grid: Grid, settings: LearnSettings, budget: int = -1, prior: SitePrior = NOTHING) -> None:
        check_prior(settings, prior)
        self.grid = grid
        self.prior = prior
        self.settings = settings
        self.budget = budget
        self._demonstrations: tuple[Demonstration, ...] = ()
        self._advice = advice_state(())
        self._learned: Learned | None = None
        self._query: Query | None = None
        self._version = 0
        self._last_query_id = 0

    # -- what is there -----------------------------------------------------------------------
    @property
    def demonstrations(self) -> tuple[Demonstration, ...]:
        """All that came, in order of arrival, with those that take others back."""
        return self._demonstrations

    @property
    def standing(self) -> tuple[Demonstration, ...]:
        """Those that hold, in order of arrival."""
        return standing(self._demonstrations)

    @property
    def log(self) -> tuple[AdviceRecord, ...]:
        """Every accepted answer and retraction, in order."""
        return self._advice.log

    @property
    def advice(self) -> AdviceState:
        """What the log says."""
        return self._advice

    @property
    def learned(self) -> Learned | None:
        """The newest policy, None before the first."""
        return self._learned

    @property
    def query(self) -> Query | None:
        """The open question; None when it is answered and the next is not learnt yet, or nothing is left to ask."""
        return self._query

    @property
    def budget_left(self) -> int:
        """Answers left, -1 unlimited."""
        return self._advice.budget_left(self.budget)

    # -- demonstrations and learning ---------------------------------------------------------
    def add(self, demonstration: Demonstration) -> None:
        """One more demonstration, or one without moves that takes an earlier one back.

        Raises:
            InputError: it lies on another grid.
        """
        check_grid(self.grid, demonstration)
        self._demonstrations += (demonstration,)

    def snapshot(self) -> Work | None:
        """What is to be learnt next; None when there is nothing to learn from or the policy is up to date."""
        if not (self.standing or self.prior) or self._is_newest(self._learned):
            return None
        return self._work(self.log)

    def learn(self) -> Learned:
        """Learn what is due, here and now, and adopt it.

        Raises:
            InputError: nothing is due; or as `learn`.
        """
        work = self.snapshot()
        if work is None:
            raise InputError('there is nothing new to learn from')
        learned = work.run()
        self.adopt(learned)
        return learned

    def adopt(self, learned: Learned) -> bool:
        """Take a result with its question; False when the session has gone on since its snapshot."""
        if not self._is_newest(learned) or learned.version != self._version + 1:
            return False
        self._learned, self._version, self._query = learned, learned.version, learned.query
        if learned.query is not None:
            self._last_query_id = learned.query.query_id
        return True

    def _is_newest(self, learned: Learned | None) -> bool:
        newest = (len(self._demonstrations), len(self.log))
        return learned is not None and (learned.n_demonstrations, learned.log_length) == newest

    def _work(self, log: tuple[AdviceRecord, ...]) -> Work:
        return Work(
            self.grid, self.settings, self._demonstrations, log, self._version + 1, self._last_query_id + 1, self.budget,
            prior=self.prior,
        )

    def kept(self, learned: Learned) -> SitePrior:
        """What a policy was learnt from, for other routes over the site."""
        return kept_of(self.grid, self._demonstrations[: learned.n_demonstrations], self.log[: learned.log_length], self.prior)

    # -- answers -----------------------------------------------------------------------------
    def check(self, answer: Answer) -> Outcome:
        """What `submit` would reply; commits nothing."""
        query = self._query
        if query is None or answer.query_id != query.query_id:
            return self._refuse(*self._not_open(answer.query_id))
        wrong = self._too_many(answer) or fault(answer) or part_fault(answer, query)
        return self._refuse(*wrong) if wrong else self._weigh(answer, query)

    def submit(self, answer: Answer) -> Outcome:
        """Take an answer to the open question, or say why not."""
        outcome = self.check(answer)
        if outcome.record is not None:
            self._append(outcome.record)
            outcome = replace(outcome, budget_left=self.budget_left)
        return outcome

    def preview(self, answer: Answer) -> Work | Outcome:
        """What would be learnt with an answer, or why it would be refused; commits nothing."""
        outcome = self.check(answer)
        if outcome.record is None:
            return outcome
        return replace(self._work((*self.log, outcome.record)), earlier=self._learned.solved if self._learned else None)

    def undo(self) -> Outcome:
        """Take the last answer that holds back."""
        if not self._advice.active:
            return self._refuse(Code.UNKNOWN_QUERY, 'there is no answer to take back')
        return self._take_back(self._advice.active[-1])

    def retract(self, advice_id: int) -> Outcome:
        """Take one earlier answer back."""
        for record in self._advice.active:
            if record.advice_id == advice_id:
                return self._take_back(record)
        known = any(record.advice_id == advice_id for record in self.log)
        reason = 'was taken back before' if known else 'was never given'
        return self._refuse(Code.ALREADY_ANSWERED if known else Code.UNKNOWN_QUERY, f'answer {advice_id} {reason}')

    def restore(self, log: tuple[AdviceRecord, ...], last_query_id: int = 0) -> None:
        """Go on with the log of an earlier session, instead of this one's; its query ids are not used again.

        Raises:
            InputError: a record's state or action is not on this grid.
        """
        check_log(self.grid, log)
        self._advice = advice_state(tuple(log))
        self._last_query_id = max((self._last_query_id, last_query_id, *(record.query_id for record in log)))
        self._learned = self._query = None

    # -- parts -------------------------------------------------------------------------------
    def _append(self, record: AdviceRecord) -> None:
        self._advice = advice_state((*self.log, record))
        self._query = None  # It is answered, or rests on an answer that was taken back.

    def _take_back(self, record: AdviceRecord) -> Outcome:
        retraction = replace(record, retracted=True)
        self._append(retraction)
        return Outcome(
            True, Code.OK, f'answer {record.advice_id} is taken back', retraction, budget_left=self.budget_left
        )

    def _refuse(self, code: Code, message: str, contradicts: tuple[int, ...] = ()) -> Outcome:
        return Outcome(False, code, message, None, contradicts, self.budget_left)

    def _not_open(self, number: int) -> Fault:
        """Why a query that is not open cannot be answered."""
        hint = f'query {self._query.query_id} is open' if self._query else 'no query is open now'
        if not 1 <= number <= self._last_query_id:
            return Fault(Code.UNKNOWN_QUERY, f'query {number} was never asked; {hint}')
        if any(record.query_id == number for record in self._advice.active):
            return Fault(Code.ALREADY_ANSWERED, f'query {number} was answered before; {hint}')
        if self.budget_left == 0:
            return Fault(Code.BUDGET_SPENT, f'all {self.budget} answers of the budget are given; take one back first')
        return Fault(Code.STALE_QUERY, f'query {number} was replaced or its answer taken back; {hint}')

    def _too_many(self, answer: Answer) -> Fault | None:
        if self.budget_left == 0 and answer.verdict == Verdict.ANSWER:
            return Fault(Code.BUDGET_SPENT, f'all {self.budget} answers of the budget are given; take one back first')
        return None

    def _weigh(self, answer: Answer, query: Query) -> Outcome:
        """Accept a sound answer; when advice is strict, only if no earlier answer opposes it."""
        record = self._record(answer, query)
        contradicts = against(record, self._advice.answers)
        opposed = f'it contradicts earlier answers: {", ".join(map(str, contradicts))}' if contradicts else ''
        if opposed and self.settings.slack_cost == 0:
            return self._refuse(Code.CONTRADICTION, f'{opposed}; take them back first', contradicts)
        message = f'noted, though {opposed}' if opposed else 'noted'
        return Outcome(True, Code.OK, message, record, contradicts, self.budget_left)

    def _record(self, answer: Answer, query: Query) -> AdviceRecord:
        said = answer.verdict == Verdict.ANSWER
        return AdviceRecord(
            advice_id=1 + max((record.advice_id for record in self.log), default=0),
            query_id=query.query_id,
            states=tuple(sorted(answer.part)) if answer.verdict == Verdict.SPLIT else query.states,
            preferred=tuple(sorted(answer.preferred)) if said else (),
            avoided=tuple(sorted(answer.avoided)) if said else (),
            verdict=Verdict(answer.verdict),
            expert_id=answer.expert_id,
            comment=answer.comment,
        )

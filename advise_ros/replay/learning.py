"""Stages 2 and 3: demonstrations and answers -> policies and questions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from advise_ros.config import AdviseConfig
from advise_ros.core.advice.advice import AdviceRecord
from advise_ros.core.advice.state import advice_state
from advise_ros.core.demonstrations.demonstration import Demonstration, known
from advise_ros.core.demonstrations.recorded_flights import number_of
from advise_ros.core.errors import InputError
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import Learned, kept_of, learn
from advise_ros.core.learning.session import Work
from advise_ros.core.site.prior import SitePrior
from advise_ros.replay.demonstrations import demonstration_stages
from advise_ros.replay.overrides import GRID
from advise_ros.replay.session import (
    ADVICE_TYPE,
    POLICY_TYPE,
    SITE_PRIOR_TOPIC,
    RecordedMessage,
    RecordedSession,
    at,
)
from advise_ros.replay.stage import Comparison, Stage
from advise_ros.ros import convert, convert_advice
from advise_ros.settings import learn_settings

# A policy this near to the end of the bag may have lost its question to the end of the recording.
TAIL_NS = 1_000_000_000


class Episode(NamedTuple):
    """One policy as the bag holds it.

    Attributes:
        policy: the message.
        query: the question published with it, None when the bag has none.
        log: the learner's advice log until then.
        version: that it must have.
        next_query_id: number that its question must have.
    """

    policy: RecordedMessage
    query: RecordedMessage | None
    log: tuple[AdviceRecord, ...]
    version: int
    next_query_id: int


def learning_stages(session: RecordedSession, comparison: Comparison) -> list[Stage]:
    """Learn each policy and its question again."""
    policies, queries = Stage('policies'), Stage('queries')
    found = episodes(session)
    demonstrations = _demonstrations(session, comparison)
    if any(episode.log and _elsewhere(session, episode) for episode in found):
        policies.notes.append('the answers were given on the grid that was flown and are left out')
    given = any(one.value.data for one in session.on(SITE_PRIOR_TOPIC))
    if given and any(_elsewhere(session, episode) for episode in found):
        policies.notes.append('what was known of the site has the cells that were flown and is left out')
    began_late = session.began_late or (bool(found) and found[0].version > 1)
    for life in _lives(found):
        learner = _LearnerRun(demonstrations)
        for episode in life:
            lacks = _lacks(session, episode, demonstrations) if began_late else ''
            if lacks:
                policies.notes.append(lacks)
                continue
            config = config_of(session, episode)
            try:
                learned = learner.learn(session, comparison, episode, learn_settings(config), config.budget)
            except InputError as problem:
                policies.count(f'{episode.policy.where}: {problem}')
                continue
            comparison.rebuilt.policies[episode.policy.message.publish_time_ns] = learned
            rebuilt = convert_advice.policy_to_msg(learned, episode.policy.stamp_ns)
            comparison.count(policies, rebuilt, episode.policy)
            _check_query(queries, session, comparison, episode, learned, config.budget)
        policies.notes += learner.notes
    return [policies, queries]


def learnt_last(session: RecordedSession) -> tuple[Learned, SitePrior]:
    """The last policy learnt again, and what is known of the site by then.

    Raises:
        InputError: the bag holds no policy, or not what it was learnt from.
    """
    found, comparison = episodes(session), Comparison(session)
    if not found:
        raise InputError(f'{session.bag.path} holds no policy; record a session with the logger until there is one')
    demonstration_stages(session, comparison)
    config, learner = config_of(session, found[-1]), _LearnerRun(_demonstrations(session, comparison))
    learned = learner.learn(session, comparison, found[-1], learn_settings(config), config.budget)
    work = _work(session, found[-1], learner.demonstrations, learn_settings(config), config.budget)
    return learned, kept_of(work.grid, work.demonstrations, work.log, work.prior)


def config_of(session: RecordedSession, episode: Episode) -> AdviseConfig:
    """The learner's parameters by which a policy was learnt: it publishes none by those that were changed meanwhile."""
    return session.config(AdviseConfig, 'advise', until_ns=episode.policy.message.publish_time_ns)


def episodes(session: RecordedSession) -> list[Episode]:
    """The policies of a bag, each with the answers that came before it."""
    found: list[Episode] = []
    log: list[AdviceRecord] = []
    counted = _Counted()
    for recorded in _in_order(session):
        kind, value = recorded.message.type_name, recorded.value
        if kind == ADVICE_TYPE:
            _note(log, value)
        elif kind == POLICY_TYPE:
            version, next_id = counted.policy(int(value.version), log)
            found.append(Episode(recorded, None, tuple(log), version, next_id))
        elif found and found[-1].query is None:
            number = int(value.query_id)
            next_id = counted.query(number, found[-1].next_query_id)
            found[-1] = found[-1]._replace(query=recorded, next_query_id=next_id)
    return found


def _lives(found: list[Episode]) -> list[list[Episode]]:
    """The policies of each life of the learner: one that was started again counts its versions anew."""
    lives: list[list[Episode]] = []
    for episode in found:
        version = int(episode.policy.value.version)
        if not lives or version <= int(lives[-1][-1].policy.value.version):
            lives.append([])
        lives[-1].append(episode)
    return lives


class _LearnerRun:
    """What one run of the learner received: all demonstrations, or those since a recorder was started again.

    A recorder keeps its demonstrations for learners that come later, and takes them with it when it ends.
    """

    def __init__(self, demonstrations: tuple[Demonstration | None, ...]) -> None:
        self.demonstrations = demonstrations
        self.notes: list[str] = []

    def learn(
        self, session: RecordedSession, comparison: Comparison, episode: Episode, settings: LearnSettings, budget: int,
    ) -> Learned:
        """As `_learn`, from what gives the recorded policy, if something does."""
        learned = _learn(session, episode, self.demonstrations, settings, budget)
        if comparison.what_if or _is_it(comparison, learned, episode):
            return learned
        for first in _recorders(self.demonstrations)[1:]:
            later = self.demonstrations[first:]
            if int(episode.policy.value.demonstrations) > len(later):
                break
            other = _learn(session, episode, later, settings, budget)
            if _is_it(comparison, other, episode):
                number = int(episode.policy.value.version)
                self.notes.append(
                    f'the learner of policy {number} at {at(episode.policy.stamp_ns)} had received nothing before demonstration '
                    f'{first + 1} of the bag: it and a recorder had been started again'
                )
                self.demonstrations = later
                return other
        return learned


def _recorders(demonstrations: tuple[Demonstration | None, ...]) -> list[int]:
    """Where the ids begin anew, because a recorder was started again."""
    numbers = [number_of(one.demonstration_id) if one is not None else 0 for one in demonstrations]
    return [0, *(place for place in range(1, len(numbers)) if 0 < numbers[place] <= numbers[place - 1])]


def _is_it(comparison: Comparison, learned: Learned, episode: Episode) -> bool:
    rebuilt = convert_advice.policy_to_msg(learned, episode.policy.stamp_ns)
    same = comparison.same(rebuilt, episode.policy)
    return same or (not comparison.exact and list(rebuilt.greedy) == list(episode.policy.value.greedy))


def _lacks(session: RecordedSession, episode: Episode, demonstrations: tuple[Demonstration | None, ...]) -> str:
    """What the bag, which began late, lacks of what a policy was learnt from, in words."""
    value = episode.policy.value
    missing = int(value.demonstrations) - len(demonstrations)
    entries = int(value.log_length) - len(episode.log)
    lacking = [
        f'{number} message{"" if number == 1 else "s"} on {session.namespace}/{topic}'
        for number, topic in ((missing, 'demonstration'), (entries, 'advise/advice_log')) if number > 0
    ]
    if not lacking:
        return ''
    return (
        f'policy {int(value.version)} at {at(episode.policy.stamp_ns)} is not learnt again: the bag lacks '
        f'{" and ".join(lacking)} from before {at(session.bag.first_ns)}, when the recording began'
    )


def _elsewhere(session: RecordedSession, episode: Episode) -> bool:
    """Whether another grid takes the place of the one that was flown."""
    if not session.overrides.get(GRID):
        return False
    try:
        flown = convert.grid_from_msg(episode.policy.value.grid)
        return session.grid(flown) != flown
    except InputError:  # Reported where the policy is learnt again.
        return False


class _Counted:
    """The learner's counters; 0 where the bag began in the middle and does not hold them."""

    def __init__(self) -> None:
        self._version = 0
        self._query_id: int | None = None

    def policy(self, published: int, log: list[AdviceRecord]) -> tuple[int, int]:
        """Version and query id that are due; the first version of a bag or of a restarted learner is taken as it is."""
        if self._version == 0 or published == 1:
            self._version = published
            self._query_id = 0 if published == 1 and not log else None
        else:
            self._version += 1
        due = self._version
        self._version = published
        return due, 0 if self._query_id is None else self._query_id + 1

    def query(self, published: int, due: int) -> int:
        """Id that was due, the published one where that is not known."""
        if published:
            self._query_id = published
        return due or published or 1


def _in_order(session: RecordedSession) -> Iterator[RecordedMessage]:
    """What the learner published, by the clock of its machine."""
    topics = ('advise/advice_log', 'advise/policy', 'advise/query')
    everything = [recorded for topic in topics for recorded in session.on(topic)]
    return iter(sorted(everything, key=lambda recorded: recorded.message.publish_time_ns))


def _note(log: list[AdviceRecord], value: Any) -> None:
    """Append; an entry that is there already begins the log anew: the learner was started again."""
    try:
        record = convert_advice.advice_from_msg(value)
    except ValueError:  # A verdict that no learner accepts: the next policy will miss this entry.
        return
    if any((old.advice_id, old.retracted) == (record.advice_id, record.retracted) for old in log):
        log.clear()
    log.append(record)


def _demonstrations(session: RecordedSession, comparison: Comparison) -> tuple[Demonstration | None, ...]:
    """Demonstrations in order of arrival; as in the learner, none is taken twice.

    Those of the bag, for what they became is compared by itself; where a parameter was changed, those rebuilt.
    """
    demonstrations: list[Demonstration] = []
    taken: list[Demonstration | None] = []
    for recorded, rebuilt in zip(session.on('demonstration'), comparison.rebuilt.demonstrations, strict=True):
        try:
            new = convert.demonstration_from_msg(recorded.value)
        except (InputError, ValueError):  # As the learner does; a policy that counts it will miss it.
            continue
        if not known(new, demonstrations):
            demonstrations.append(new)
            taken.append(rebuilt if comparison.what_if else new)
    return tuple(taken)


def _learn(
    session: RecordedSession, episode: Episode, demonstrations: tuple[Demonstration | None, ...], settings: LearnSettings,
    budget: int,
) -> Learned:
    """The policy that follows from what it says it was learnt from.

    Raises:
        InputError: the bag does not hold that much.
    """
    work = _work(session, episode, demonstrations, settings, budget)
    return learn(
        work.grid, work.settings, work.demonstrations, work.log,
        version=work.version, next_query_id=work.next_query_id, budget=budget, prior=work.prior,
    )


def _work(
    session: RecordedSession, episode: Episode, demonstrations: tuple[Demonstration | None, ...], settings: LearnSettings,
    budget: int,
) -> Work:
    """What a policy says it was learnt from.

    Raises:
        InputError: the bag does not hold that much.
    """
    value = episode.policy.value
    recorded = convert.grid_from_msg(value.grid)
    grid = session.grid(recorded)
    usable = tuple(one for one in demonstrations if one is None or one.grid == grid)
    log = episode.log if grid == recorded else ()
    _at_most('demonstrations', int(value.demonstrations), len(usable))
    _at_most('log_length', int(value.log_length), len(episode.log))
    return Work(
        grid, settings, tuple(one for one in usable[: int(value.demonstrations)] if one is not None),
        log[: int(value.log_length)], version=episode.version, next_query_id=episode.next_query_id, budget=budget,
        prior=session.site_prior(recorded, episode.policy.message.publish_time_ns),
    )


def _at_most(name: str, said: int, held: int) -> None:
    if said > held:
        raise InputError(f'{name} is {said}, expected at most {held}, which is what the bag holds until then')


def _check_query(
    queries: Stage, session: RecordedSession, comparison: Comparison, episode: Episode, learned: Learned, budget: int,
) -> None:
    if episode.query is None:
        _missing_query(queries, session, episode, learned)
        return
    stamp_ns = episode.query.stamp_ns
    if learned.query is not None:
        rebuilt = convert_advice.query_to_msg(learned.query, learned.grid, stamp_ns)
    else:
        advice = advice_state(episode.log[: learned.log_length])
        rebuilt = convert_advice.no_query_to_msg(learned, advice.budget_left(budget), stamp_ns)
    comparison.count(queries, rebuilt, episode.query)


def _missing_query(queries: Stage, session: RecordedSession, episode: Episode, learned: Learned) -> None:
    if episode.policy.message.log_time_ns > session.bag.last_ns - TAIL_NS:
        queries.notes.append('the recording ended before the question of the last policy')
        return
    number = learned.query.query_id if learned.query else 0
    queries.count(f'{session.namespace}/advise/query at {at(episode.policy.stamp_ns)}: nothing, expected query {number}')

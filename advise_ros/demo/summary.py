"""The demo's end: the table on the terminal and the values of the report page."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table
from scipy.stats import binomtest

from advise_ros.core.advice.advice import AdviceRecord, Verdict, active
from advise_ros.core.grid.grid import N_ACTIONS, Action
from advise_ros.core.learning.learner import Learned
from advise_ros.demo.story import DemoFlight, DemoSession
from advise_ros.report import pictures
from advise_ros.ros import convert

PERCENT = 100.0


@dataclass(frozen=True)
class Rate:
    """A success rate with its 95 % Wilson interval, all in percent."""

    successes: int
    trials: int
    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        return f'{self.mean:.0f} % ({self.low:.0f} to {self.high:.0f})'


@dataclass(frozen=True)
class DemoOutcome:
    """All that a run has to show.

    Attributes:
        before, after: learnt in the main session without and with its answers.
        rate_before, rate_after: of the trials on the grid model.
        answers_mean: answers in a trial.
        by_person: whether a person answered; then every figure comes from the person's answers, those of the trials too.
    """

    sessions: Sequence[DemoSession]
    tracks: Sequence[pictures.FlownTrack]
    log: tuple[AdviceRecord, ...]
    before: Learned
    after: Learned
    rate_before: Rate
    rate_after: Rate
    answers_mean: float
    first_trial_seed: int
    by_person: bool
    replay_equal: bool
    seconds: float
    bag: Path

    @property
    def flights(self) -> list[DemoFlight]:
        return [flight for session in self.sessions for flight in session.flights]

    @property
    def replay_text(self) -> str:
        return 'equal byte for byte' if self.replay_equal else 'it differs, see the replay log'

    @property
    def good(self) -> bool:
        """The story holds: asking helped the flown drone, and the bag proves it."""
        main = self.sessions[0].flights
        return self.replay_equal and main[-1].success and self.rate_after.mean > self.rate_before.mean


def rate(successes: Sequence[bool]) -> Rate:
    """Success rate of independent trials with the Wilson score interval."""
    done, trials = int(sum(successes)), len(successes)
    interval = binomtest(done, trials).proportion_ci(method='wilson')
    return Rate(done, trials, PERCENT * done / trials, PERCENT * interval.low, PERCENT * interval.high)


def table(outcome: DemoOutcome) -> Table:
    """The closing table: before and after advice."""
    rows = Table(title='Does asking help?', title_justify='left', header_style='bold')
    for heading in ('', 'without advice', 'with advice'):
        rows.add_column(heading)
    trials = outcome.rate_before.trials
    whose = 'your answers' if outcome.by_person else 'simulated answers'
    rows.add_row(
        f'success on the grid model, {trials} seeds, {whose} (95 %)', str(outcome.rate_before), str(outcome.rate_after),
    )
    rows.add_row('success in the simulator', _flown(outcome.flights, 'before'), _flown(outcome.flights, 'after'))
    rows.add_row('questions answered', '0', f'{len(active(outcome.log))}')
    rows.add_row('replay of the bag', '', outcome.replay_text)
    rows.add_row('seconds, the whole demo', '', f'{outcome.seconds:.0f}')
    return rows


def _flown(flights: Sequence[DemoFlight], policy: str) -> str:
    flown = [flight for flight in flights if flight.policy == policy]
    return f'{sum(flight.success for flight in flown)} of {len(flown)} flights'


# -- the report page -------------------------------------------------------------------------
def page_values(outcome: DemoOutcome) -> dict[str, Any]:
    """Everything that report/page.html shows."""
    main = outcome.sessions[0]
    trials = outcome.rate_before.trials
    last = outcome.first_trial_seed + trials - 1
    shown = _asked_pictures(main, active(outcome.log))
    return {
        'title': 'A drone that learnt its route by asking',
        'lead': (
            f'A clumsy pilot flew the route {len(main.demonstrations)} times. The drone learnt from that, asked '
            f'{len(active(outcome.log))} questions about the areas where it was unsure, and learnt again.'
        ),
        'tiles': _tiles(outcome),
        'tracks_svg': pictures.to_svg(pictures.tracks_figure(outcome.before.grid, outcome.tracks)),
        'layers_svg': pictures.to_svg(_layers(outcome)),
        'success_svg': pictures.to_svg(_success(outcome)),
        'trials_caption': (
            f'{trials} independent trials on the grid model, seeds {outcome.first_trial_seed} to {last}, each with '
            f'its own demonstrations and mistakes and {_trial_answers(outcome)}; bars with 95 % intervals.'
        ),
        'questions': [_question(main, record, shown) for record in active(outcome.log)],
        **shown,
        'flights': [_flight_row(flight) for flight in outcome.flights],
        'demonstrations': [_demonstration_row(demonstration) for demonstration in main.demonstrations],
        'bag': str(outcome.bag),
        'bag_word': shlex.quote(str(outcome.bag)),
        'replay': outcome.replay_text,
    }


def _trial_answers(outcome: DemoOutcome) -> str:
    if outcome.by_person:
        return f'the {outcome.answers_mean:.0f} answers that you gave in this session'
    return f'{outcome.answers_mean:.1f} answers of a simulated expert on average'


def _tiles(outcome: DemoOutcome) -> list[dict[str, str]]:
    word, mood = ('equal', 'good') if outcome.replay_equal else ('differs', 'bad')
    return [
        {'value': f'{outcome.rate_before.mean:.0f} %', 'label': 'reach the end without advice', 'mood': 'bad'},
        {'value': f'{outcome.rate_after.mean:.0f} %', 'label': 'reach the end with advice', 'mood': 'good'},
        {'value': str(len(active(outcome.log))), 'label': 'questions answered', 'mood': ''},
        {'value': _flown(outcome.flights, 'after'), 'label': 'succeeded in the simulator', 'mood': ''},
        {'value': word, 'label': 'replay of the bag', 'mood': mood},
    ]


def _layers(outcome: DemoOutcome) -> Any:
    before, after = outcome.before, outcome.after
    visits = np.asarray(before.visits, dtype=np.float64)
    seen = np.where(visits[:, None] > 0, before.demonstrated, 0.0)
    heat = pictures.heat_colour(before.state_uncertainty)
    plain = _nothing
    return pictures.layers_figure(
        before.grid,
        [
            ('flown, by cluster', pictures.cluster_colour(before.clusters, visits), seen, 'black'),
            ('unsure', heat, None, 'black'),
            ('policy without advice', plain, pictures.one_hot(before.greedy, N_ACTIONS), pictures.VERMILION),
            ('policy with advice', plain, pictures.one_hot(after.greedy, N_ACTIONS), pictures.GREEN),
        ],
    )


def _nothing(_state: int) -> None:
    """No colour."""


def _success(outcome: DemoOutcome) -> Any:
    return pictures.success_figure(
        [
            (name, r.mean, r.low, r.high)
            for name, r in (('without advice', outcome.rate_before), ('with advice', outcome.rate_after))
        ],
    )


def _question(session: DemoSession, record: AdviceRecord, shown: Mapping[str, str]) -> dict[str, str]:
    query = session.queries.get(record.query_id)
    return {
        'number': str(record.query_id), 'question': query.question if query else '', 'answer': answer_text(record),
        'shown': shown.get(_picture_name(record), ''),
    }


def _picture_name(record: AdviceRecord) -> str:
    return f'question_{record.query_id}_svg'


def _asked_pictures(session: DemoSession, records: Sequence[AdviceRecord]) -> dict[str, str]:
    """What the person saw of each question, as a picture a question: `question_3_svg`."""
    seen = {}
    for record in records:
        query = session.queries.get(record.query_id)
        policy = session.policies.get(query.policy_version) if query else None
        if query is not None and policy is not None:
            picture = pictures.question_figure(
                convert.grid_from_msg(query.grid), tuple(query.states), np.array(policy.greedy), session.demonstrations,
            )
            seen[_picture_name(record)] = pictures.to_svg(picture)
    return seen


def answer_text(record: AdviceRecord) -> str:
    """An answer in words, e.g. 'EAST; not NORTH, WEST (simulated-expert)'."""
    if record.verdict != Verdict.ANSWER:
        return f'{record.verdict.name.lower()} ({record.expert_id})'
    preferred, avoided = (', '.join(Action(a).name for a in actions) for actions in (record.preferred, record.avoided))
    return f'{preferred}; not {avoided} ({record.expert_id})'


def _flight_row(flight: DemoFlight) -> dict[str, str]:
    return {
        'seed': str(flight.seed), 'policy': f'{flight.policy} advice', 'steps': str(flight.steps),
        'result': 'reached the end' if flight.success else flight.message,
        'mood': 'good' if flight.success else 'bad', 'seconds': f'{flight.seconds:.0f}',
    }


def _demonstration_row(demonstration: Any) -> dict[str, str]:
    audit = demonstration.audit
    return {
        'name': demonstration.demonstration_id, 'moves': str(len(demonstration.states)),
        'samples': str(audit.samples), 'notes': '; '.join(audit.notes) or 'none',
    }

"""The demo's end: the table on the terminal and the values of the report page."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from advise_ros.core.advice.advice import AdviceRecord, Verdict, active
from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.grid.grid import N_ACTIONS, Action
from advise_ros.core.people.known_site import Site
from advise_ros.core.people.trial import TrialResult
from advise_ros.core.planning.rollout import Rollout, optimal_table, rollout
from advise_ros.core.site.wording import times
from advise_ros.core.statistics import wilson
from advise_ros.demo.options import DemoSites
from advise_ros.demo.story import KINDS, DemoFlight, DemoPolicy, DemoSession
from advise_ros.report import pictures
from advise_ros.ros import convert, convert_advice

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
        session: what was flown, asked and answered on the route that is shown.
        other: the flight of the other route; None without one.
        trials: of the grid model, with seeds that count up from first_trial_seed.
        by_person: whether a person answered; then every figure comes from the person's answers, those of the trials too.
    """

    sites: DemoSites
    session: DemoSession
    other: DemoFlight | None
    tracks: Sequence[pictures.FlownTrack]
    trials: Sequence[TrialResult]
    first_trial_seed: int
    by_person: bool
    replay_equal: bool
    seconds: float
    bag: Path

    @property
    def flights(self) -> list[DemoFlight]:
        return [*self.session.flights, *([] if self.other is None else [self.other])]

    @property
    def answers(self) -> list[AdviceRecord]:
        return active(self.session.log)

    @property
    def replay_text(self) -> str:
        return 'equal byte for byte' if self.replay_equal else 'it differs, see the replay log'

    @property
    def good(self) -> bool:
        """The story holds: what was learnt flies this route and the other one, and the bag proves it."""
        return self.replay_equal and all(flight.success for flight in self.flights if flight.kind != 'before')

    def rates(self) -> dict[str, Rate]:
        """Success on the grid model by kind of flight; empty without trials."""
        if not self.trials:
            return {}
        found = {
            'before': rate([trial.before.success for trial in self.trials]),
            'after': rate([trial.after.success for trial in self.trials]),
        }
        others = [trial.other.success for trial in self.trials if trial.other is not None]
        return {**found, 'other': rate(others)} if others else found


def rate(successes: Sequence[bool]) -> Rate:
    """Success rate of independent trials with the Wilson score interval."""
    done, trials = int(sum(successes)), len(successes)
    low, high = wilson(done, trials)
    return Rate(done, trials, PERCENT * done / trials, PERCENT * low, PERCENT * high)


def planned(site: Site) -> Rollout:
    """The way of a planner who knows the map alone; of equally short ways the first by the order of the actions."""
    grid = site.grid
    return rollout(grid, optimal_table(grid).argmax(axis=1).tolist(), grid.start_state(), grid.n_states)


@dataclass(frozen=True)
class OutcomeRow:
    """One line of the closing table, a word for each kind of flight; the moods colour the words."""

    name: str
    words: Sequence[str]
    moods: Sequence[str]


HEADINGS = {'before': 'without advice', 'after': 'with advice', 'other': 'another route'}


def headings(outcome: DemoOutcome) -> list[str]:
    """The columns of the closing table."""
    return ["planner's route", *(HEADINGS[flight.kind] for flight in outcome.flights)]


def lines(outcome: DemoOutcome) -> list[OutcomeRow]:
    """The closing table: what the planner would fly (computed), and what was flown in the simulator."""
    site, plan, flights = outcome.sites.shown, planned(outcome.sites.shown), outcome.flights
    crossed = sorted({site.grid.cell_of(state) for state in plan.states[1:]} & set(np.flatnonzero(site.keep_out).tolist()))
    asked, flown = {'before': '0', 'after': str(len(outcome.answers)), 'other': 'none new'}, len(outcome.session.demonstrations)
    rates, kinds = outcome.rates(), [flight.kind for flight in flights]
    whose = 'your answers' if outcome.by_person else 'simulated answers'
    found = [
        _line('all waypoints in order', [True, *(flight.arrived for flight in flights)], ('yes', 'no')),
        OutcomeRow('moves', [str(plan.steps), *(str(flight.steps) for flight in flights)], [''] * (1 + len(flights))),
        _plain('lessons flown by the pilot', ['0', *('none new' if kind == 'other' else str(flown) for kind in kinds)]),
        _plain('questions answered', ['0', *(asked[kind] for kind in kinds)]),
    ]
    if rates:
        name = f'success on the grid model, {len(outcome.trials)} seeds, {whose} (95 %)'
        found.append(_plain(name, ['never' if crossed else 'always', *(str(rates[kind]) for kind in kinds)]))
    if site.keep_out.any():
        kept = [not crossed, *(not flight.entered for flight in flights)]
        found.insert(0, _line('garden', kept, ('kept out', 'entered')))
    return found


def _line(name: str, good: Sequence[bool], words: tuple[str, str]) -> OutcomeRow:
    return OutcomeRow(name, [words[not one] for one in good], ['good' if one else 'bad' for one in good])


def _plain(name: str, words: Sequence[str]) -> OutcomeRow:
    return OutcomeRow(name, words, [''] * len(words))


def table(outcome: DemoOutcome) -> Table:
    """The closing table on the terminal."""
    rows = Table(title='What the map does not say', title_justify='left', header_style='bold')
    for heading in ('', *headings(outcome)):
        rows.add_column(heading)
    colours = {'good': 'green', 'bad': 'red', '': 'default'}
    for line in lines(outcome):
        cells = [f'[{colours[mood]}]{word}[/]' for word, mood in zip(line.words, line.moods, strict=True)]
        rows.add_row(line.name, *cells)
    return rows


# -- the report page -------------------------------------------------------------------------
def page_values(outcome: DemoOutcome) -> dict[str, Any]:
    """Everything that report/page.html shows."""
    session = outcome.session
    shown = _asked_pictures(session, outcome.answers)
    return {
        'title': 'A drone that learnt what the map does not say',
        'lead': _lead(outcome),
        'headings': headings(outcome),
        'lines': lines(outcome),
        'tracks_svg': pictures.to_svg(pictures.site_figure(_panels(outcome))),
        'layers_svg': pictures.to_svg(_layers(outcome)),
        **_measured(outcome),
        'questions': [_question(session, record, shown) for record in outcome.answers],
        **shown,
        'flights': [_flight_row(flight) for flight in outcome.flights],
        'demonstrations': [_demonstration_row(demonstration) for demonstration in session.demonstrations],
        'bag': str(outcome.bag),
        'bag_word': shlex.quote(str(outcome.bag)),
        'replay': outcome.replay_text,
        'replay_mood': 'good' if outcome.replay_equal else 'bad',
    }


def _lead(outcome: DemoOutcome) -> str:
    flown, answers = len(outcome.session.demonstrations), len(outcome.answers)
    said = (
        f'A clumsy pilot flew the route {times(flown)}, keeping out of a garden that is on no map. The drone learnt where it '
        f'may lie, asked {answers} question{"" if answers == 1 else "s"}, and flew'
    )
    return said + (' the route and then another one over the same site.' if outcome.other else ' the route.')


def _panels(outcome: DemoOutcome) -> list[pictures.SitePanel]:
    """The map and the lessons; what was learnt and flown; the other route."""
    shown, hidden = outcome.sites.shown, np.flatnonzero(outcome.sites.shown.keep_out).tolist()
    by_kind = {kind: [track for track in outcome.tracks if track.kind == kind] for kind in pictures.TRACKS}
    plan = planned(shown).states
    panels = [
        pictures.SitePanel('The map knows no garden; the pilot does', shown.grid, hidden, plan, by_kind['demonstration']),
        pictures.SitePanel(
            'Learnt: the darker, the surer to keep out', shown.grid, hidden, plan, by_kind['before'] + by_kind['after'],
            outcome.session.learnt[-1].keep_out,
        ),
    ]
    if outcome.sites.other is not None:
        other = outcome.sites.other
        panels.append(pictures.SitePanel(
            'Another route, without a new lesson', other.grid, hidden, planned(other).states, by_kind['other'],
            outcome.session.learnt[-1].keep_out,
        ))
    return panels


def _measured(outcome: DemoOutcome) -> dict[str, str]:
    """Success on the grid model as a picture with its caption; nothing without trials."""
    if not outcome.trials:
        return {}
    last = outcome.first_trial_seed + len(outcome.trials) - 1
    figure = pictures.success_figure([(HEADINGS[kind], r.mean, r.low, r.high) for kind, r in outcome.rates().items()])
    return {
        'success_svg': pictures.to_svg(figure),
        'trials_caption': (
            f'{len(outcome.trials)} independent trials on the grid model, seeds {outcome.first_trial_seed} to {last}, each with '
            f'its own demonstrations and mistakes and {_trial_answers(outcome)}; bars with 95 % intervals.'
        ),
    }


def _trial_answers(outcome: DemoOutcome) -> str:
    mean = sum(trial.answers for trial in outcome.trials) / len(outcome.trials)
    if outcome.by_person:
        return f'the {mean:.0f} answers that you gave in this session'
    return f'{mean:.1f} answers of a simulated expert on average'


def _layers(outcome: DemoOutcome) -> Any:
    (before, after), grid = outcome.session.learnt, outcome.sites.shown.grid
    taken = count(grid, outcome.session.demonstrations).taken
    return pictures.layers_figure(
        grid,
        [
            ('flown by the pilot', _nothing, taken / np.maximum(taken.sum(axis=1, keepdims=True), 1), pictures.BLUE),
            ('policy without advice', _belief(before), pictures.one_hot(before.greedy, N_ACTIONS), pictures.PURPLE),
            ('policy with advice', _belief(after), pictures.one_hot(after.greedy, N_ACTIONS), pictures.GREEN),
        ],
    )


def _belief(learned: DemoPolicy) -> Callable[[int], str | None]:
    """Colour of what is believed of the site; white where the acquisition believes nothing of it."""
    return _nothing if learned.keep_out is None else pictures.keep_out_colour(learned.keep_out)


def _nothing(_state: int) -> None:
    """No colour."""


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
        asked = convert_advice.query_from_msg(query) if query else None
        if query is not None and policy is not None and asked is not None:
            picture = pictures.question_figure(
                convert.grid_from_msg(query.grid), asked, np.array(policy.greedy), session.demonstrations,
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
    told = 'reached the end' if flight.arrived else flight.message
    return {
        'policy': KINDS[flight.kind], 'steps': str(flight.steps), 'seconds': f'{flight.seconds:.0f}',
        'result': told + (f', garden entered in {len(flight.entered)} of its cells' if flight.entered else ''),
        'mood': 'good' if flight.success else 'bad',
    }


def _demonstration_row(demonstration: Any) -> dict[str, str]:
    audit = demonstration.audit
    return {
        'name': demonstration.demonstration_id, 'moves': str(len(demonstration.states)),
        'samples': str(audit.samples), 'notes': '; '.join(audit.notes) or 'none',
    }

"""Answers of one gesture beside answers by directions: how often they say the same, and what either leads to.

    ./advise python benchmarks/gestures.py [--trials 16] [--seed 41000] [--sizes 6x6-4 12x12-6]

Prints Markdown, a row a size: questions asked; their cells in dispute and the states asked about (median, most); per cent of
questions in which half to all or none of the cells in dispute are to be kept out of, so that a yes or no is true of each; per
cent in which the gesture stands for the same preferred and avoided directions as the expert names, and in which it prefers
none that he avoids; then success at the end by directions and by gestures, and the questions asked, as in `routes.py`.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import Answer, Query, Verdict
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.core.people.known_site import judge
from advise_ros.core.people.simulated_expert import by_gesture
from advise_ros.core.statistics import share_in_words
from advise_ros.experiments.routes.cases import RouteCase, RouteTrial, trial_of
from advise_ros.experiments.routes.ways import MOST_ANSWERS
from advise_ros.experiments.sites import SIZES


class Asked(NamedTuple):
    """One question: its sizes, whether a yes or no is true of all disputed cells, and how near gesture and directions are."""

    disputed: int
    states: int
    clean: bool
    same: bool
    compatible: bool


class Interview(NamedTuple):
    """All questions of a trial, and whether the policy at the end succeeds."""

    asked: list[Asked]
    success: bool


def interview(trial: RouteTrial, *, gestures: bool) -> Interview:
    session = Session(trial.site.grid, LearnSettings(acquisition='site', seed=trial.seed), -1)
    for flight in trial.flights:
        session.add(flight)
    asked: list[Asked] = []
    while True:
        learnt = session.learn()
        query = session.query
        if query is None or len(asked) >= MOST_ANSWERS:
            return Interview(asked, judge(trial.site, learnt.greedy).success)
        asked.append(compared(trial, query))
        answer = trial.expert.answer(query)
        session.submit(_by_gesture(trial, query) if gestures and query.options else answer)


def _by_gesture(trial: RouteTrial, query: Query) -> Answer:
    chosen = by_gesture(query, trial.site.keep_out > 0)
    return Answer(query.query_id, Verdict.ANSWER, chosen.preferred, chosen.avoided)


def compared(trial: RouteTrial, query: Query) -> Asked:
    preferred, avoided = trial.expert.advice(query.states)
    if not query.options:
        return Asked(0, len(query.states), False, False, False)
    chosen = by_gesture(query, trial.site.keep_out > 0)
    hidden = trial.site.keep_out[list(query.disputed)]
    opposed = set(chosen.preferred) & set(avoided) or set(chosen.avoided) & set(preferred)
    same = (chosen.preferred, chosen.avoided) == (preferred, avoided)
    return Asked(len(query.disputed), len(query.states), bool(hidden.all() or not hidden.any()), same, not opposed)


def row(size: str, trials: int, seed: int) -> str:
    case = RouteCase(size)
    by_way = {
        gestures: [interview(trial_of(case, one), gestures=gestures) for one in range(seed, seed + trials)]
        for gestures in (False, True)
    }
    asked = [one for found in by_way[False] for one in found.asked]
    shares = [100 * np.mean([getattr(one, name) for one in asked]) for name in ('clean', 'same', 'compatible')]
    sizes = [f'{np.median(found):.0f}, {max(found)}' for found in ([a.disputed for a in asked], [a.states for a in asked])]
    success = [share_in_words(sum(one.success for one in by_way[gestures]), trials) for gestures in (False, True)]
    numbers = [f'{np.mean([len(one.asked) for one in by_way[gestures]]):.1f}' for gestures in (False, True)]
    cells = [size, str(trials), str(len(asked)), *sizes, *(f'{share:.0f}' for share in shares), *success, *numbers]
    return f'| {" | ".join(cells)} |'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=16)
    parser.add_argument('--seed', type=int, default=41_000)
    parser.add_argument('--sizes', nargs='+', choices=SIZES, default=['6x6-4', '8x8-8', '12x12-6'])
    given = parser.parse_args()
    heads = ('', 'trials', 'questions', 'in dispute', 'states', 'one truth', 'same', 'compatible', 'success by directions',
             'by gestures', 'asked', 'by gestures')
    print(f'| {" | ".join(heads)} |\n{"|---" * len(heads)}|')
    for size in given.sizes:
        print(row(size, given.trials, given.seed), flush=True)


if __name__ == '__main__':
    main()

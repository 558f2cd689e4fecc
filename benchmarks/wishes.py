"""Wishes that are more than cells to keep out of: what flights tell, and what answers add.

    ./advise python benchmarks/wishes.py [--trials 15] [--seed 43000] [--wishes corridor ...] [--answers 6]

Five flights with 40 % wrong moves over 10 x 10 cells with five waypoints. Prints Markdown: per cent of plans that cost at most
0.6 step more than the best way by the true prices, after so many answers; what share of the belief richer kinds of wishes have
before and after them; questions asked; seconds of processor time of the first belief. `plain`: one map of cells to keep out
of; `by evidence`: graded cells where they explain the flights better, as the product does;
`and by answers`: also where the maps contradict an answer, areas for one waypoint among them.
"""

from __future__ import annotations

import argparse
import time
from typing import NamedTuple

import numpy as np

from advise_ros.core.advice.advice import Query
from advise_ros.core.demonstrations.demonstration import count
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.site.belief import SamplerSettings, SiteAnswer, SiteBelief, believe, tell
from advise_ros.core.site.layout import layout_of
from advise_ros.core.site.plan import plan
from advise_ros.core.site.questions import next_question
from advise_ros.core.site.wishes import ALIKE, GRADED, ONE_WAYPOINT
from advise_ros.core.statistics import share_in_words
from advise_ros.experiments.sites import expert_of, flights_of, pilot_of
from advise_ros.experiments.wished_sites import NEARLY, WISHES, extra_steps, wished_site

POINTS = (0, 2, 4, 6)
WAYS = {
    'plain': SamplerSettings(richer=()), 'by evidence': SamplerSettings(),
    'and by answers': SamplerSettings(contradicted=(GRADED, ONE_WAYPOINT)),
}


class Trial(NamedTuple):
    """Whether the plan was good after each answer, the share of richer wishes before and after them, seconds."""

    good: list[bool]
    before: float
    after: float
    seconds: float


def trial(wish: str, settings: SamplerSettings, seed: int, most: int) -> Trial:
    site, weights = wished_site(wish, np.random.default_rng([seed, 0]))
    pilot = pilot_of(site, 'errs', 0.4, 0.2, np.random.default_rng([seed, 1]))
    taken = count(site.grid, flights_of(site, pilot, 5)).taken
    layout, rng = layout_of(site.grid), np.random.default_rng([seed, 2])
    expert = expert_of(site, 0.0, np.random.default_rng([seed, 3]))
    begun = time.process_time()
    belief = believe(layout, taken, (), rng, settings)
    seconds, before, good = time.process_time() - begun, richer(belief), list[bool]()
    while True:
        good.append(extra_steps(site, weights, plan(layout, belief.expected).greedy) <= NEARLY)
        question = next_question(layout, belief, rng)
        if len(good) > most or question is None or question.worth < LearnSettings.enough:
            return Trial(good, before, richer(belief), seconds)
        answer = expert.answer(Query(1, 1, question.states, 0.0, 0.0, 0.0, (), (), (), -1, ''))
        belief = tell(layout, belief, SiteAnswer(question.states, answer.preferred, answer.avoided), rng, settings)


def richer(belief: SiteBelief) -> float:
    """Weight of the richer kinds of wishes."""
    return sum(one.weight for one in belief.pilots if one.wishes != ALIKE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=15)
    parser.add_argument('--seed', type=int, default=43_000, help='the first; choose one that tuned nothing')
    parser.add_argument('--wishes', nargs='+', choices=WISHES, default=list(WISHES))
    parser.add_argument('--answers', type=int, default=6, help='at most')
    given = parser.parse_args()
    print(f'| wish | way | trials | {" | ".join(map(str, POINTS))} | richer before, after | asked | s |')
    print('|---' * (len(POINTS) + 6) + '|')
    for wish in given.wishes:
        for way, settings in WAYS.items():
            rows = [trial(wish, settings, given.seed + at, given.answers) for at in range(given.trials)]
            hits = [sum(row.good[min(point, len(row.good) - 1)] for row in rows) for point in POINTS]
            good = [share_in_words(number, len(rows)) for number in hits]
            before, after = np.mean([row.before for row in rows]), np.mean([row.after for row in rows])
            asked, seconds = np.mean([len(row.good) - 1 for row in rows]), np.median([row.seconds for row in rows])
            cells = [wish, way, len(rows), *good, f'{before:.2f}, {after:.2f}']
            print(f'| {" | ".join(map(str, cells))} | {asked:.1f} | {seconds:.2f} |', flush=True)


if __name__ == '__main__':
    main()

"""What the learner's settings are worth with clusters: from the paper's to those of `occupancy`, one change after the other.

    ./advise python benchmarks/settings.py [--trials 30] [--seed 0] [--answers 10]

Each row adds its change to the row before. Rates: trials on the grid model of config/grid_6x6.yaml, five noisy
flights each, whose policy reaches the goal in order, with 95 % Wilson intervals. Last column: questions answered
until the same holds for the real recording bags/arducopter_five_flights. Takes some minutes; prints Markdown.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from advise_ros.config import AdviseConfig, ExpertConfig
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.trial import TrialSettings, follow, run_trial
from advise_ros.core.statistics import share_in_words
from advise_ros.demo.options import node_config
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.sources import read_recording
from advise_ros.settings import learn_settings

ROOT = Path(__file__).parent.parent
PAPER, GRID, BAG = (ROOT / path for path in ('config/paper.yaml', 'config/grid_6x6.yaml', 'bags/arducopter_five_flights'))
STEPS: tuple[tuple[str, dict[str, object]], ...] = (
    ('advice replaces a*, margins capped', {'reading': 'replace', 'margin_cap': 0.2}),
    ('position and waypoint among the features', {'cluster_features': 1.0}),
    ('questions weighted by expected visits', {'acquisition': 'occupancy'}),
    ('temperature 0.1', {'temperature': 0.1}),
    ('6 clusters', {'clusters': 6}),
    ('doubtful answers asked for again', {'confirm': True}),
)
WRONG = 0.1


def rows(answers: int) -> Iterator[tuple[str, TrialSettings]]:
    """Name and settings of each row."""
    paper = TrialSettings(
        learn=learn_settings(node_config(PAPER, 'advise', AdviseConfig)), flights=5, answers=answers,
        prefer=node_config(PAPER, 'expert', ExpertConfig).prefer,
    )
    yield 'as printed: config/paper.yaml', paper
    settings = replace(paper, prefer=ExpertConfig.prefer)
    for name, change in STEPS:
        settings = replace(settings, learn=replace(settings.learn, **change))  # type: ignore[arg-type]
        yield name, settings
    if settings.learn != learn_settings(AdviseConfig(acquisition='occupancy')):
        raise AssertionError('the last step must lead to the defaults of occupancy')
    yield f'the last, {WRONG:.0%} of the answers wrong', replace(settings, error_rate=WRONG)


def until_reached(grid: Grid, settings: TrialSettings, demonstrations: tuple[Demonstration, ...], seed: int) -> str:
    """Answers until the policy from the demonstrations reaches the goal, out of the questions there were."""
    curve = follow(grid, settings, demonstrations, np.random.default_rng(seed), seed)
    return str(curve.index(True)) if True in curve else f'never in {len(curve) - 1}'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--trials', type=int, default=30)
    parser.add_argument('--seed', type=int, default=0, help='of the first trial; the others follow')
    parser.add_argument('--answers', type=int, default=10, help='most answers a trial')
    options = parser.parse_args()
    grid, points = load_grid(GRID), sorted({0, 3, 6, options.answers})
    recorded = demonstrations_of(grid, read_recording(BAG), DiscretiseSettings()).demonstrations
    print('| settings |', ' | '.join(f'after {point}' for point in points), '| recording |', flush=True)
    print('| --- |', ' | '.join('---' for _ in points), '| --- |', flush=True)
    for name, settings in rows(options.answers):
        curves = [run_trial(grid, settings, options.seed + index).curve for index in range(options.trials)]
        done = [sum(curve[min(point, len(curve) - 1)].success for curve in curves) for point in points]
        rates = ' | '.join(share_in_words(number, options.trials) for number in done)
        print(f'| {name} | {rates} | {until_reached(grid, settings, recorded, options.seed)} |', flush=True)


if __name__ == '__main__':
    main()

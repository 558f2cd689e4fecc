"""What benchmarks on tuning seeds ask of their user: domains, trials, and where these run and are kept."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from advise_ros.experiments.figures import Trials
from advise_ros.experiments.protocols import FINAL_SEED, PROTOCOLS
from advise_ros.experiments.runner import OnCores, Performer, here


class Order(NamedTuple):
    """What is wanted; `path` is the file of the trials."""

    domains: Sequence[str]
    trials: Trials
    performer: Performer
    path: Path


def parse(about: str, name: str, domains: Sequence[str], seed: int) -> Order:
    """The order from the command line; seeds must lie below those of the published figures.

    Args:
        about: the benchmark's docstring.
        name: of the folder in out/ where trials are kept by default.
        domains: by default.
        seed: by default, of the first trial.
    """
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--domain', nargs='+', choices=PROTOCOLS, default=list(domains))
    parser.add_argument('--trials', type=int, default=40)
    parser.add_argument('--seed', type=int, default=seed, help='of the first trial; the others follow')
    parser.add_argument('--jobs', type=int, default=1, help='processes (default %(default)s)')
    parser.add_argument('--out', type=Path, default=Path('out', name), help='trials are kept here (default %(default)s)')
    options = parser.parse_args()
    if options.seed + options.trials > FINAL_SEED:
        parser.error(f'seeds from {FINAL_SEED} on are those of the published figures; choose lower ones')
    performer = OnCores(options.jobs) if options.jobs > 1 else here
    return Order(options.domain, Trials(options.trials, options.seed), performer, options.out / 'trials.jsonl')

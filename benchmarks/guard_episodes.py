"""How far the guard lets a vehicle pass the fence, over many episodes of a pilot who means to leave.

    ./advise python benchmarks/guard_episodes.py --episodes 10000              # the links as the guard was told
    ./advise python benchmarks/guard_episodes.py --episodes 10000 --troubled   # and later, with drift and jumps

Each episode: one of four fences (two not convex), a vehicle with a braking of 2 to 5 m/s2 and a delay of up to
0.2 s, gusts that carry it up to 0.25 m off its track, poses at 5 to 20 Hz and up to 0.1 s late, losses of poses
and commands of up to 3 s. --troubled: its velocity is off by a random walk of up to 0.3 m/s in most, positions and
commands are late by up to 10 s more (not, steadily, growing, by jitter or stalls; each way by its own draw), positions jump
by 4 to 20 m for up to 0.8 s in half of them. The bound of each episode is that of docs/safety.md; exit code 1 when
one is passed. --delay makes the links later than the guard was told, which the bound does not allow for.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path

import numpy as np

from advise_ros.parallel import on_cores

sys.path.insert(0, str(Path(__file__).parents[1] / 'test'))

from support.guarded_flight import DELAY_S, TICK_S, episode

CHUNK = 50


def flown(seed: int, numbers: range, seconds: float, delay_s: float, troubled: bool) -> list[tuple[float, float]]:
    """How far outside each of some episodes came, and its bound, metres."""
    return [(one.fly(seconds), one.bound_m) for one in (episode(seed, number, delay_s, troubled=troubled) for number in numbers)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--episodes', type=int, default=10_000)
    parser.add_argument('--seconds', type=float, default=0.0, help='simulated, each (default: 20; 40 with --troubled)')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--jobs', type=int, default=0, help='processes (default: one a core)')
    parser.add_argument('--troubled', action='store_true', help='with drift, jumps, and delays of up to 10 s in either direction')
    parser.add_argument(
        '--delay', type=float, default=DELAY_S - TICK_S, help='of poses and obedience together, at most (default: as told)',
    )
    options = parser.parse_args()
    seconds = options.seconds or (40.0 if options.troubled else 20.0)
    chunks = [range(first, min(first + CHUNK, options.episodes)) for first in range(0, options.episodes, CHUNK)]
    fly = partial(flown, options.seed, seconds=seconds, delay_s=options.delay, troubled=options.troubled)
    found = [pair for part in on_cores(fly, chunks, options.jobs) for pair in part]
    worst, bounds = np.array(found).T
    beyond = int((worst > bounds).sum())
    # Exact for none; for some, the normal approximation's upper end.
    share = beyond / len(worst)
    upper = 1 - 0.05 ** (1 / len(worst)) if beyond == 0 else share + 1.96 * (share * (1 - share) / len(worst)) ** 0.5
    print(f'{len(worst)} episodes of {seconds:g} s, seed {options.seed}; outside the fence, metres:')
    print(f'  median {np.median(worst):.3f}, 95 % {np.quantile(worst, 0.95):.3f}, 99.9 % {np.quantile(worst, 0.999):.3f}, '
          f'worst {worst.max():.3f}')
    print(f'  bounds {bounds.min():.2f} to {bounds.max():.2f}; nearest to its bound by {(bounds - worst).min():.3f}')
    print(f'  beyond the bound: {beyond} (share below {upper:.2e} with 95 % confidence)')
    sys.exit(1 if beyond else 0)


if __name__ == '__main__':
    main()

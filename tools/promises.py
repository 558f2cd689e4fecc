"""Runs the promises of docs/safety.md: breaks things, measures, and prints the ledger.

    make promises                     all of it, with the trials that docs/safety.md names
    ./advise python tools/promises.py --short
    ./advise python tools/promises.py --only deaths --trials 10 --json ledger.json

Exit code 1 when a promise is broken.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test'))

from support.promises import answers, clocks, deaths, fences, links, short, silence, soaks
from support.promises.ledger import Row, markdown, table

Run = Callable[[Path, np.random.Generator, int], list[Row]]
# Name -> what runs it, and its trials: of the long form, then of the short one.
LONG: dict[str, tuple[Run, int]] = {
    'silence': (silence.run, 100), 'deaths': (deaths.run, 100), 'clocks': (clocks.run, 100), 'links': (links.run, 100),
    'fences': (fences.run, 10_000), 'answers': (answers.run, 10_000), 'soak': (soaks.run, 24 * 60),
}
SHORT: dict[str, tuple[Run, int]] = {
    'silence': (silence.run, 1), 'flight': (short.run, 1), 'fences': (fences.run, 20), 'answers': (answers.run, 30),
}


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--short', action='store_true', help='few trials of each: under a minute')
    parser.add_argument('--only', nargs='+', choices=sorted({*LONG, *SHORT}), help='these promises')
    parser.add_argument('--trials', type=int, default=0, help='of each promise (fences: episodes, soak: minutes)')
    parser.add_argument('--seed', type=int, default=0, help='of every random choice')
    parser.add_argument('--slack', type=float, default=0.0, help='seconds on top of each limit of time, for a busy machine')
    parser.add_argument('--json', type=Path, help='write the ledger here too')
    parser.add_argument('--markdown', type=Path, help='write the table of docs/safety.md here')
    return parser.parse_args()


def tried(name: str, given: argparse.Namespace) -> list[Row]:
    """The rows of one promise; trials that could not be carried out are a broken promise too."""
    run, usual = (SHORT if given.short else LONG)[name]
    rng = np.random.default_rng([given.seed, *name.encode()])
    with tempfile.TemporaryDirectory() as folder:
        try:
            return [entry.with_slack(given.slack) for entry in run(Path(folder), rng, given.trials or usual)]
        except AssertionError as problem:
            return [Row(name, 'the trials could not be carried out', '', 0, float('nan'), 0.0, (str(problem),))]


def main() -> int:
    given = parse()
    rows: list[Row] = []
    console = Console(width=150)
    for name in given.only or (SHORT if given.short else LONG):
        began_s = time.monotonic()
        rows += tried(name, given)
        console.print(f'{name}: {time.monotonic() - began_s:.0f} s', highlight=False)
    console.print(table(rows))
    tell_broken(console, rows)
    if given.json:
        given.json.write_text(json.dumps([entry.as_mapping() for entry in rows], indent=1) + '\n')
    if given.markdown:
        given.markdown.write_text(markdown(rows))
    return 0 if all(entry.kept for entry in rows) else 1


def tell_broken(console: Console, rows: list[Row]) -> None:
    """What went wrong, in words."""
    broken = [entry for entry in rows if not entry.kept]
    for entry in broken:
        for sentence in entry.broken[:5]:
            console.print(f'{entry.promise}, {entry.trouble}: {sentence}', highlight=False, markup=False)
    console.print(f'{len(broken)} of {len(rows)} promises are broken' if broken else f'all {len(rows)} promises were kept')


if __name__ == '__main__':
    sys.exit(main())

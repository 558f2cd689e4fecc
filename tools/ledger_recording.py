"""Breaks recordings in every way that the project promises to survive, and prints the ledger.

    make ledger-recording                                   30 kills, 200 truncations, 1000 flips, a full disk
    ./advise python tools/ledger_recording.py --short       a few of each, in under half a minute
    ./advise python tools/ledger_recording.py --only flips --trials 5000 --seed 1

Exit code 1 when a promise is broken. A full disk is a tmpfs of 1 MB where that may be mounted (root), else a limit on
the size of files; the ledger says which.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test'))

from support.promises.ledger import Row, table
from support.recordings import crashes, damage, verdicts

Run = Callable[[Path, np.random.Generator, int], list[Row]]
# Name -> what runs it, and its trials: of the long form, then of the short one.
PARTS: dict[str, tuple[Run, int, int]] = {
    'kills': (crashes.kills, 30, 2), 'answers': (crashes.answers, 30, 2), 'full_disk': (crashes.full_disk, 1, 1),
    'truncations': (damage.truncations, 200, 15), 'flips': (damage.flips, 1000, 100),
    'verdicts': (verdicts.verdicts, 1200, 24),
}


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--short', action='store_true', help='a few trials of each')
    parser.add_argument('--only', nargs='+', choices=sorted(PARTS), default=list(PARTS), help='these')
    parser.add_argument('--trials', type=int, default=0, help='of each; default as above')
    parser.add_argument('--seed', type=int, default=0, help='of every random choice')
    parser.add_argument('--json', type=Path, help='write the ledger here too')
    return parser.parse_args()


def tried(name: str, given: argparse.Namespace) -> list[Row]:
    """The rows of one part; trials that could not be carried out are a broken promise too."""
    run, long, short = PARTS[name]
    rng = np.random.default_rng([given.seed, *name.encode()])
    with tempfile.TemporaryDirectory() as folder:
        try:
            return run(Path(folder), rng, given.trials or (short if given.short else long))
        except AssertionError as problem:
            return [Row(name, 'the trials could not be carried out', '', 0, float('nan'), 0.0, (str(problem),))]


def summed_up(rows: list[Row]) -> str:
    """The ledger in one line."""
    parts = (f'{entry.trouble} {entry.trials}x: {entry.figure} at most {entry.worst:.3g} of {entry.limit:g}' for entry in rows)
    broken = [entry for entry in rows if not entry.kept]
    verdict = f'{len(broken)} of {len(rows)} BROKEN' if broken else f'all {len(rows)} kept'
    return f'recording ledger: {verdict}; {"; ".join(parts)}'


def main() -> int:
    given = parse()
    rows = [row for name in given.only for row in tried(name, given)]
    console = Console(width=150, soft_wrap=True)
    console.print(table(rows))
    for entry in rows:
        for sentence in (*entry.broken[:5], *([entry.note] if entry.note else [])):
            console.print(f'{entry.trouble}: {sentence}', highlight=False, markup=False)
    if given.json:
        given.json.write_text(json.dumps([entry.as_mapping() for entry in rows], indent=1) + '\n')
    console.print(summed_up(rows), highlight=False, markup=False)
    return 0 if all(entry.kept for entry in rows) else 1


if __name__ == '__main__':
    sys.exit(main())

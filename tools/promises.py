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

from support.promises import answers, clocks, deaths, silence
from support.promises.ledger import Row, markdown, table

Run = Callable[..., list[Row]]
# Name -> what runs it, trials of the long form, trials of the short one.
PROMISES: dict[str, tuple[Run, int, int]] = {
    'silence': (silence.run, 100, 2),
    'deaths': (deaths.run, 100, 1),
    'clocks': (clocks.run, 100, 1),
    'answers': (answers.run, 10_000, 200),
}


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--short', action='store_true', help='few trials of each: under a minute')
    parser.add_argument('--only', nargs='+', choices=sorted(PROMISES), default=list(PROMISES), help='these promises')
    parser.add_argument('--trials', type=int, default=0, help='instead of the trials of the long or short form')
    parser.add_argument('--seed', type=int, default=0, help='of every random choice')
    parser.add_argument('--json', type=Path, help='write the ledger here too')
    parser.add_argument('--markdown', type=Path, help='write the table of docs/safety.md here')
    return parser.parse_args()


def main() -> int:
    given = parse()
    rows: list[Row] = []
    console = Console(width=150)
    for name in given.only:
        run, long, short = PROMISES[name]
        began_s = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            rng, trials = np.random.default_rng([given.seed, len(name)]), given.trials or (short if given.short else long)
            rows += run(Path(folder), rng, trials, short=given.short)
        console.print(f'{name}: {time.monotonic() - began_s:.0f} s', highlight=False)
    console.print(table(rows))
    broken = [entry for entry in rows if not entry.kept]
    for entry in broken:
        for sentence in entry.broken[:5]:
            console.print(f'{entry.promise}, {entry.trouble}: {sentence}', highlight=False)
    if given.json:
        given.json.write_text(json.dumps([entry.as_mapping() for entry in rows], indent=1) + '\n')
    if given.markdown:
        given.markdown.write_text(markdown(rows))
    console.print('every promise was kept' if not broken else f'{len(broken)} of {len(rows)} promises are broken')
    return 1 if broken else 0


if __name__ == '__main__':
    sys.exit(main())

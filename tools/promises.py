"""Runs the promises of docs/safety.md: breaks things, measures, and prints the ledger.

    make promises                     all of it, with the trials that docs/safety.md names
    ./advise python tools/promises.py --short
    ./advise python tools/promises.py --only deaths --trials 10 --json ledger.json
    make promises ARGS='--minutes 30' ; make promises ARGS=--resume      some now, the rest later

Parts run side by side, each with a ROS domain of its own. What each trial came to is written at once to a file a
part in --folder, and the ledger with every part that ends: an interrupted run loses one trial. Exit code 1 when a
promise is broken or trials are missing.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import sys
import tempfile
import time
import traceback
from pathlib import Path

import numpy as np
from rich.console import Console

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test'))

from support.promises.book import Book, lines_of, rows_of
from support.promises.crew import Crew
from support.promises.ledger import Row, markdown, table
from support.promises.parts import LONG, PROMISES, SHORT, Part, chosen

# A part whose graph broke down goes on with a new one so often.
NEW_GRAPHS = 3
LONGEST_S = 1e9


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--short', action='store_true', help='few trials of each: a minute or two')
    parser.add_argument('--only', nargs='+', choices=PROMISES, help='these promises')
    parser.add_argument('--trials', type=int, default=0, help='of each promise (fences: episodes, soak: minutes)')
    parser.add_argument('--jobs', type=int, default=0, help='flights at the same time (default: 3, in the short form 1)')
    parser.add_argument('--minutes', type=float, help='end after this long, with what there is')
    parser.add_argument('--resume', action='store_true', help='go on with what is in the folder')
    parser.add_argument('--folder', type=Path, help='where the trials are written (default: out/promises)')
    parser.add_argument('--seed', type=int, default=0, help='of every random choice')
    parser.add_argument('--slack', type=float, default=0.0, help='seconds on top of each limit of time, for a busy machine')
    parser.add_argument('--json', type=Path, help='write the ledger here too')
    parser.add_argument('--markdown', type=Path, help='write the table of docs/safety.md here')
    parser.add_argument('--part', help=argparse.SUPPRESS)
    parser.add_argument('--until', type=float, default=LONGEST_S, help=argparse.SUPPRESS)
    return parser.parse_args()


# -- one part --------------------------------------------------------------------------------
def run_part(given: argparse.Namespace, name: str, part: Part) -> int:
    """Its trials, in as many graphs as it takes; what could not be carried out is written down as broken."""
    book = Book(given.folder / f'{name}.jsonl', part.trials, given.until)
    for _ in range(1 + NEW_GRAPHS):
        rng = np.random.default_rng([given.seed, *name.encode(), book.done])
        try:
            with tempfile.TemporaryDirectory() as folder:
                part.run(Path(folder), rng, book)
        except KeyboardInterrupt:
            return 1
        except Exception:  # noqa: BLE001  whatever it is, it belongs into the ledger
            book.fail(traceback.format_exc())
        if book.done >= book.total or time.monotonic() >= given.until:
            break
    return 0


# -- all of them -----------------------------------------------------------------------------
class Ledger:
    """The rows of all parts, as far as they have come."""

    def __init__(self, given: argparse.Namespace, parts: dict[str, Part]) -> None:
        self._given, self._parts = given, parts

    def rows(self) -> list[Row]:
        rows = []
        for promise in dict.fromkeys(part.promise for part in self._parts.values()):
            names = [name for name, part in self._parts.items() if part.promise == promise]
            rows += rows_of(promise, [line for name in names for line in lines_of(self.book_of(name))])
        return [entry.with_slack(self._given.slack) for entry in rows]

    def book_of(self, name: str) -> Path:
        return Path(self._given.folder, f'{name}.jsonl')

    def missing(self) -> dict[str, str]:
        """Parts that are not through, and how far they are."""
        done = {name: Book(self.book_of(name), part.trials).done for name, part in self._parts.items()}
        return {name: f'{done[name]} of {part.trials}' for name, part in self._parts.items() if done[name] < part.trials}

    def write(self) -> None:
        """The files that were asked for."""
        if self._given.json:
            self._given.json.write_text(json.dumps([entry.as_mapping() for entry in self.rows()], indent=1) + '\n')
        if self._given.markdown:
            self._given.markdown.write_text(markdown(self.rows()))


def run_all(given: argparse.Namespace, parts: dict[str, Part], console: Console) -> int:
    given.folder.mkdir(parents=True, exist_ok=True)
    ledger = Ledger(given, parts)
    if not given.resume:
        for name in parts:
            ledger.book_of(name).unlink(missing_ok=True)
    until_s = time.monotonic() + 60.0 * given.minutes if given.minutes else LONGEST_S

    def command_of(name: str) -> list[str]:
        return [sys.executable, *sys.argv, '--part', name, '--until', str(until_s), '--folder', str(given.folder)]

    def on_end(name: str, code: int, seconds: float) -> None:
        ledger.write()
        console.print(f'{name}: {seconds:.0f} s' + (f', exit code {code}' if code else ''), highlight=False)

    crew = Crew(command_of, given.jobs or (1 if given.short else 3), until_s + 90.0, on_end)
    waiting = {name: part for name, part in parts.items() if name in ledger.missing()}
    with contextlib.suppress(KeyboardInterrupt):
        crew.run(waiting)
    ledger.write()
    return tell(console, ledger)


def tell(console: Console, ledger: Ledger) -> int:
    """The ledger, and what went wrong in words; the exit code."""
    rows, missing = ledger.rows(), ledger.missing()
    broken = [entry for entry in rows if not entry.kept]
    console.print(table(rows))
    for entry in broken:
        for sentence in entry.broken[:5]:
            console.print(f'{entry.promise}, {entry.trouble}: {sentence}', highlight=False, markup=False)
    for name, share in missing.items():
        console.print(f'{name}: {share} trials; go on by --resume', highlight=False)
    console.print(f'{len(broken)} of {len(rows)} promises are broken' if broken else f'all {len(rows)} promises were kept')
    return 1 if broken or missing else 0


def main() -> int:
    given = parse()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # So that everything that was started is ended.
    parts = chosen(SHORT if given.short else LONG, given.only, given.trials)
    if given.part:
        return run_part(given, given.part, parts[given.part])
    with contextlib.ExitStack() as stack:
        if given.folder is None:
            given.folder = Path(stack.enter_context(tempfile.TemporaryDirectory())) if given.short else Path('out', 'promises')
        return run_all(given, parts, Console(width=170))


if __name__ == '__main__':
    sys.exit(main())

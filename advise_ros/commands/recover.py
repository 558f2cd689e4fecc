"""recover: a bag that was cut off or damaged -> a whole one beside it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from advise_ros.command_line import CommandParser
from advise_ros.core.errors import AdviseError, LogError
from advise_ros.exits import INTERRUPTED, OK, USAGE, VERDICT_NO, fail
from advise_ros.recording.repair import recover

EPILOG = """examples:
  ./advise recover session1                   writes session1_recovered
  ./advise recover cut.mcap --out whole.mcap

The original is never changed. discretise and replay read unfinished bags as they are; other people's tools want whole ones.

Next: ./advise replay session1_recovered

exit code: 0 the bag is whole, or a whole one was written; 1 nothing in it is whole; 2 wrong usage, or OUT cannot be
written; 130 interrupted, nothing written"""


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        found = recover(options.bag, options.out)
    except LogError as problem:
        return fail(str(problem), VERDICT_NO if options.bag.exists() else USAGE)
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return fail('stopped; nothing was written', INTERRUPTED)
    if found.target is None:
        print(f'{options.bag} is whole; there is nothing to recover')
        return OK
    print('\n'.join(found.losses))
    print(f'{found.n_messages} messages are in {found.target}')
    return OK


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='recover', description='Write what is whole of an unfinished or damaged bag (MCAP) into a new one.',
        epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('bag', type=Path, metavar='BAG', help='a bag directory or an .mcap file')
    parser.add_argument('--out', type=Path, metavar='OUT', help='the new bag; by default BAG_recovered')
    return parser

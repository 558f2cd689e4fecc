"""site_map: a recorded session in, what was learnt of its site out."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from advise_ros.command_line import CommandParser
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.exits import INTERRUPTED, OK, fail
from advise_ros.recording.sitefile import begin_site, save_site
from advise_ros.replay.learning import learnt_last
from advise_ros.replay.overrides import parse
from advise_ros.replay.session import read_session

EPILOG = """Learns the last policy of the session again and keeps what was learnt of the site: site.yaml and site.pgm, a map for
nav2_map_server (per cent that a cell is to be kept out of), and site.json, the flights and answers.

examples:
  ./advise site_map session1 --out site.yaml
  ./advise site_map session1 --out site.yaml -p advise.acquisition:=site

Next: another route over the same site, which needs no new flight:
  ./advise advise --ros-args -p grid_file:=other_route.yaml -p site_map_file:=site.yaml

exit code: 0 written; 2 wrong usage, no bag with a session, or a session that learnt nothing of its site; 130 interrupted"""


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        print(_kept(options))
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return fail('stopped; nothing was written', INTERRUPTED)
    return OK


def _kept(options: argparse.Namespace) -> str:
    learned, prior = learnt_last(read_session(options.bag, options.namespace, parse(options.override)))
    if learned.keep_out is None:
        raise InputError(
            f"the learner of {options.bag} had acquisition '{learned.settings.acquisition}' and learnt nothing of the site; "
            'learn again with -p advise.acquisition:=site'
        )
    begin_site('', options.out, learned.grid)
    save_site(options.out, learned.grid, learned.keep_out, prior)
    return f'{options.out}: {prior.in_words}; the likeliest cell to keep out of {learned.keep_out.max():.0%}'


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='site_map', description='Keep what a recorded session learnt of its site, for other routes over it.', epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('bag', metavar='BAG', help='a bag by logger')
    parser.add_argument('--out', '-o', required=True, metavar='FILE', help='YAML file to write; .pgm and .json come beside it')
    parser.add_argument('--namespace', metavar='NAME', help='of the session, where the bag holds several')
    parser.add_argument(
        '-p', '--override', action='append', default=[], metavar='NODE.NAME:=VALUE', help='learn with another parameter',
    )
    return parser


if __name__ == '__main__':
    main()

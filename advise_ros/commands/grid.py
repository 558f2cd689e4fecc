"""grid: a grid file out of another tool's mission or map, one drawn on a page, and a look at one."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from advise_ros.command_line import CommandParser
from advise_ros.commands import grid_draw
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.exits import INTERRUPTED, OK, fail
from advise_ros.missions.files import KNOWN, read_mission
from advise_ros.missions.to_grid import GridOptions, PlacedGrid, grid_of
from advise_ros.recording.gridfile import grid_to_mapping, load_grid, load_place
from advise_ros.recording.gridtext import grid_text, write_new
from advise_ros.recording.place import Place

EPILOG = f"""Files: {KNOWN}.

examples:
  ./advise grid from survey.plan --cell 5 --out my_grid.yaml
  ./advise grid from site.kml --cell 4 --altitude 6 --heading auto --out my_grid.yaml
  ./advise grid draw my_grid.yaml
  ./advise grid draw --picture garden.png --corners "0,0 60,40"
  ./advise grid draw --picture ortho.jpg --corners-wgs84 "47.3975,8.5450 47.3979,8.5458"
  ./advise grid draw --map house.yaml
  ./advise grid show my_grid.yaml

Of a mission the places that are flown to become waypoints, areas to keep out of blocked cells; where there is an area to stay
in, cells that do not lie wholly in it are blocked. In KML and GeoJSON the longest line is the route (without one: the points),
and an area is one to keep out of if its name says so ("keep out", "exclusion", "no-fly"). What was not read is said.

draw serves a page on this machine alone and opens it; what is drawn there is checked as `show` does it, and saved where you say.
Ctrl-C ends it.

Next: ./advise fly --grid my_grid.yaml

exit code: 0 done; 2 wrong usage or input; 130 interrupted"""


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point; exits with the code of `run`."""
    sys.exit(run(list(sys.argv[1:] if argv is None else argv)))


def run(argv: Sequence[str]) -> int:
    """The command; returns its exit code."""
    options = _parser().parse_args(argv)
    try:
        if options.what == 'draw':
            return grid_draw.run(options)
        print(_imported(options) if options.what == 'from' else _shown(load_grid(options.file), load_place(options.file)))
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return INTERRUPTED
    return OK


def _imported(options: argparse.Namespace) -> str:
    mission = read_mission(options.file)
    try:
        found = grid_of(mission, GridOptions(options.cell, options.altitude, options.heading, options.margin))
    except InputError as problem:
        raise InputError(f'{options.file}: {problem}') from None
    notes = ''.join(f'note: {note}\n' for note in (*mission.notes, *found.notes))
    _write(Path(options.out), found, options.file)
    return f'{notes}{_shown(found.grid, found.place)}\n{options.out} written; next: ./advise fly --grid {options.out}'


def _write(path: Path, found: PlacedGrid, source: str) -> None:
    values = {
        'origin_wgs84': [found.place.latitude_deg, found.place.longitude_deg], 'heading_deg': found.place.heading_deg,
        **grid_to_mapping(found.grid),
    }
    head = f'# From {Path(source).name}; cells are [x, y]; y points heading_deg clockwise from north.\n'
    try:
        write_new(path, grid_text(values, head))
    except FileExistsError:
        raise InputError(f'{path} exists already; name another file by --out, or move it away') from None
    except OSError as problem:
        raise InputError(f'{path} cannot be written ({problem.strerror}); name another file by --out') from None


def _shown(grid: Grid, place: Place | None) -> str:
    """The grid as a picture of text, north (or the y axis) up."""
    marks = dict.fromkeys(grid.blocked, '#')
    for number, cell in enumerate(grid.waypoints, start=1):
        marks[cell] = f'{marks[cell]},{number}' if cell in marks else str(number)
    wide = max([1, *(len(mark) for mark in marks.values())])
    rows = []
    for y in range(grid.height - 1, -1, -1):
        cells = ' '.join(marks.get(grid.cell(x, y), '.').rjust(wide) for x in range(grid.width))
        rows.append(f'{y:>3}  {cells}')
    columns = ' '.join(str(x % 10).rjust(wide) for x in range(grid.width))
    at = 'no place on the earth (origin_wgs84)' if place is None else (
        f'metres count from {place.latitude_deg:.7f}, {place.longitude_deg:.7f}, y axis {place.heading_deg:g} deg from north'
    )
    size = (
        f'{grid.width} x {grid.height} cells of {grid.resolution_m:g} m, {len(grid.waypoints)} waypoints, '
        f'{len(grid.blocked)} blocked cells, flown at {grid.altitude_m:g} m; {at}'
    )
    return '\n'.join((size, *rows, f'     {columns}'))


def _heading(text: str) -> float | None:
    return None if text == 'auto' else float(text)


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='grid', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    what = parser.add_subparsers(dest='what', required=True, metavar='from | draw | show')
    imported = what.add_parser('from', help="a grid file out of another tool's file")
    imported.add_argument('file', metavar='FILE', help=KNOWN)
    imported.add_argument('--cell', type=float, required=True, metavar='M', help='edge of a cell')
    imported.add_argument('--altitude', type=float, metavar='M', help='flight altitude (default: the heights of the file)')
    imported.add_argument(
        '--heading', type=_heading, default=0.0, metavar='DEG',
        help='of the y axis, clockwise from north; auto: along the longest leg of the route (default 0)',
    )
    imported.add_argument('--margin', type=int, default=2, metavar='N', help='cells around the route (default 2)')
    imported.add_argument('--out', '-o', required=True, metavar='FILE', help='grid file to write')
    grid_draw.add_options(what.add_parser('draw', help='draw a grid file on a page, over a picture or a map'))
    shown = what.add_parser('show', help='check a grid file and draw it as text')
    shown.add_argument('file', metavar='FILE', help='grid file')
    return parser


if __name__ == '__main__':
    main()

"""What was learnt of a site, on disk: a map in the format of nav2's map_server, and beside it what it was learnt from.

`site.yaml` and `site.pgm` hold the probability of each cell that the person wants it kept out of, in per cent (mode raw).
`site.json` holds the flights and answers, so that another route over the same cells learns from them themselves. A map
without it, one that was changed since, and one of cells of another size or place count as probabilities, by area.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import advise_ros
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import N_ACTIONS, Grid
from advise_ros.core.grid.raster import Raster, on_cells
from advise_ros.core.numerics import Floats
from advise_ros.core.site.prior import UNKNOWN, KeptAnswer, KeptFlight, KeptRoute, SitePrior
from advise_ros.recording.mapfile import map_texts, read_map
from advise_ros.recording.whole_file import write_whole

FORMAT = 1
# A cell of which the map covers less than this share is unknown.
LEAST_KNOWN = 0.5


class LoadedSite(NamedTuple):
    """What a file says of a site; `remark` is what of it does not count and why, '' where all does."""

    prior: SitePrior
    remark: str


def save_site(path: str | Path, grid: Grid, keep_out: Floats, prior: SitePrior) -> None:
    """Write the three files, each whole or not at all.

    Args:
        path: of the YAML file; the others lie beside it.
        grid: whose cells they are.
        keep_out: (cells,) probabilities, NaN where unknown.
        prior: what they were learnt from.

    Raises:
        InputError: they cannot be written.
    """
    file = Path(path)
    values = np.where(np.isin(np.arange(grid.n_cells), grid.blocked), np.nan, keep_out).reshape(grid.height, grid.width)
    described, image = map_texts(file.with_suffix('.pgm').name, Raster(values, grid.resolution_m, grid.origin_enu_m))
    beside = {
        'advise_site': FORMAT, 'made_by': f'advise_ros {advise_ros.__version__}', 'cells': _cells(grid),
        'image_sha256': hashlib.sha256(image).hexdigest(), **to_mapping(prior),
    }
    for suffix, data in (('.pgm', image), ('.json', _text(beside).encode()), (file.suffix, described.encode())):
        write_whole(file.with_suffix(suffix), data)


def load_site(path: str | Path, grid: Grid) -> LoadedSite:
    """Read what is known of a site for a route over it.

    Args:
        path: of the YAML file, by save_site or by hand.
        grid: the route; its cells may be others than those of the file.

    Raises:
        InputError: a file is missing or damaged, or no part of the map lies on the grid.
    """
    raster, beside = read_map(path), _beside(Path(path))
    why = _why_map_alone(path, beside, raster, grid)
    if beside is not None and not why:
        return LoadedSite(from_mapping(beside, grid.n_cells), '')
    known, mean = on_cells(raster, grid)
    if not known.any():
        raise InputError(
            f'map file {path}: no known part of it lies on the grid, which begins at {list(grid.origin_enu_m)} m; '
            'name a map of this site, or leave it out'
        )
    percent = np.where(known >= LEAST_KNOWN, np.round(100.0 * np.nan_to_num(mean)), UNKNOWN).astype(int)
    return LoadedSite(SitePrior(tuple(percent.tolist())), why)


def begin_site(map_file: str, out: str, grid: Grid) -> LoadedSite:
    """What a session begins with, where it keeps what it learns in `out`; nothing that is there is lost.

    Args:
        map_file: what is known of the site; '' nothing. It may be the same as `out`, and then need not be there yet.
        out: the YAML file to write; '' none.
        grid: the route.

    Raises:
        InputError: as load_site; or `out` is no name of a YAML file, or holds something else, or what is not begun with.
    """
    same = bool(map_file) and Path(map_file).resolve() == Path(out).resolve()
    if out:
        _check_out(Path(out), same=same)
    if not map_file:
        return LoadedSite(SitePrior(), '')
    if same and not Path(out).exists():
        return LoadedSite(SitePrior(), f'{map_file} is not there yet: nothing is known of the site')
    return load_site(map_file, grid)


def _check_out(out: Path, *, same: bool) -> None:
    if out.suffix not in {'.yaml', '.yml'}:
        raise InputError(f"site map '{out}' is to be written; name a .yaml file, a .pgm and a .json are written beside it")
    there = [str(one) for one in (out, out.with_suffix('.pgm'), out.with_suffix('.json')) if one.exists()]
    if there and not _is_site(out):
        raise InputError(f'{" and ".join(there)} would be overwritten, and advise did not write it; name another file')
    if there and not same:
        raise InputError(
            f'{out} holds what another session learnt; set site_map_file to it, too, to go on from there, or name another file'
        )


def _is_site(path: Path) -> bool:
    """Whether a map was written by save_site."""
    try:
        return path.exists() and _beside(path) is not None
    except InputError:
        return False


# -- as JSON, which a topic carries too ------------------------------------------------------------
def site_text(prior: SitePrior) -> str:
    """All of it in one line; '' where nothing is known."""
    return json.dumps(to_mapping(prior), separators=(',', ':')) if prior else ''


def site_of_text(text: str, n_cells: int) -> SitePrior:
    """What `site_text` wrote for a site of so many cells.

    Raises:
        InputError: it is something else.
    """
    try:
        return from_mapping(json.loads(text), n_cells) if text else SitePrior()
    except ValueError:
        raise InputError('what is known of the site is damaged: it is no JSON') from None


def to_mapping(prior: SitePrior) -> dict[str, Any]:
    """Keys `before` and `routes`."""
    routes = [
        {
            'waypoints': list(route.waypoints),
            'flights': [one._asdict() for one in route.flights],
            'answers': [one._asdict() for one in route.answers],
        }
        for route in prior.routes
    ]
    return {'before': list(prior.before), 'routes': routes}


def from_mapping(values: Mapping[str, Any], n_cells: int) -> SitePrior:
    """What `to_mapping` wrote for a site of so many cells.

    Raises:
        InputError: something is missing, of the wrong type or outside of the site.
    """
    try:
        before = _whole(values['before'], UNKNOWN, 100)
        if before and len(before) != n_cells:
            raise ValueError(f'{len(before)} probabilities for {n_cells} cells')
        return SitePrior(before, tuple(_route(one, n_cells) for one in values['routes']))
    except (KeyError, TypeError, ValueError, AttributeError) as problem:
        reason = f'{problem} is missing' if isinstance(problem, KeyError) else str(problem)
        raise InputError(f'what is known of the site is damaged: {reason}') from None


def _route(values: Mapping[str, Any], n_cells: int) -> KeptRoute:
    waypoints = _whole(values['waypoints'], 0, n_cells - 1)
    last = len(waypoints) * n_cells - 1
    return KeptRoute(
        waypoints,
        tuple(_flight(one, last) for one in values['flights']),
        tuple(_answer(one, last) for one in values['answers']),
    )


def _answer(values: Mapping[str, Any], last: int) -> KeptAnswer:
    preferred, avoided = (_whole(values[name], 0, N_ACTIONS - 1) for name in ('preferred', 'avoided'))
    return KeptAnswer(_whole(values['states'], 0, last), preferred, avoided, str(values['expert_id']), str(values['comment']))


def _flight(values: Mapping[str, Any], last: int) -> KeptFlight:
    begin_ns, end_ns = values['window_ns']
    states, actions = _whole(values['states'], 0, last), _whole(values['actions'], 0, N_ACTIONS - 1)
    if len(actions) != len(states):
        raise ValueError(f'{len(states)} states and {len(actions)} actions')
    return KeptFlight(str(values['demonstration_id']), (int(begin_ns), int(end_ns)), states, actions)


def _whole(values: Any, low: int, high: int) -> tuple[int, ...]:
    if not isinstance(values, list) or any(type(value) is not int or not low <= value <= high for value in values):
        raise ValueError(f'{str(values)[:40]} is not a list of whole numbers from {low} to {high}')
    return tuple(values)


# -- the file beside the map -----------------------------------------------------------------------
def _beside(path: Path) -> Mapping[str, Any] | None:
    """The JSON file of a map; None where there is none.

    Raises:
        InputError: it is damaged or of another version.
    """
    file = path.with_suffix('.json')
    try:
        values = json.loads(file.read_text(encoding='utf-8'))
    except FileNotFoundError:
        return None
    except OSError as problem:
        raise InputError(f'site file {file}: it cannot be read ({problem.strerror})') from None
    except ValueError:
        raise InputError(f'site file {file}: it is not JSON; move it away to use the map alone') from None
    if not isinstance(values, dict) or 'advise_site' not in values:
        raise InputError(f'site file {file}: it is not what advise keeps of a site; move it away to use the map alone')
    if values['advise_site'] != FORMAT:
        raise InputError(f'site file {file}: its format is {values["advise_site"]}, this version reads {FORMAT}; move it away')
    return values


def _why_map_alone(path: str | Path, beside: Mapping[str, Any] | None, raster: Raster, grid: Grid) -> str:
    """Why flights and answers of a site's file do not count here; '' where they do, or there are none."""
    if beside is None:
        return ''
    pixels = hashlib.sha256(map_texts('', raster)[1]).hexdigest()
    if beside.get('image_sha256') != pixels or beside.get('cells') != _cells_of(raster):
        return f'{path} was changed since it was written: the map counts, its flights and answers do not'
    if beside['cells'] != _cells(grid):
        there, here = beside['cells'], _cells(grid)
        return f'{path} has other cells ({there}; here {here}): its map counts by area, its flights and answers do not'
    return ''


def _cells(grid: Grid) -> dict[str, Any]:
    return {'resolution': grid.resolution_m, 'width': grid.width, 'height': grid.height, 'origin': list(grid.origin_enu_m)}


def _cells_of(raster: Raster) -> dict[str, Any]:
    rows, columns = raster.values.shape
    return {'resolution': raster.resolution_m, 'width': columns, 'height': rows, 'origin': list(raster.origin_enu_m)}


def _text(values: Mapping[str, Any]) -> str:
    """One line a flight and an answer."""
    lines = [f'"{key}": {json.dumps(value)}' for key, value in values.items() if key != 'routes']
    routes = ',\n'.join(
        f'{{"waypoints": {json.dumps(route["waypoints"])},\n"flights": [\n{_lines(route["flights"])}],\n'
        f'"answers": [\n{_lines(route["answers"])}]}}'
        for route in values['routes']
    )
    return '{' + ',\n'.join(lines) + f',\n"routes": [{routes}]}}\n'


def _lines(values: Sequence[Any]) -> str:
    return ',\n'.join(json.dumps(one) for one in values)

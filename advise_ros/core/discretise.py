"""Samples of one flight -> a demonstration on the grid, with an audit of what was not used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.grid import Action, Grid
from advise_ros.core.samples import CommandSamples, PoseSamples, Recording
from advise_ros.core.track import Track, follow
from advise_ros.core.tracker import MAX_SKIP_CELLS, NS, CellTracker

# A command whose lesser component is more than this share of the greater one points at no one neighbour.
TIE_RATIO = 0.9
# Sentences about unknown moves in one audit; the rest is counted.
MAX_BREAK_NOTES = 5

Mask = npt.NDArray[np.bool_]
Stamps = npt.NDArray[np.int64]
Window = tuple[int, int]


@dataclass(frozen=True)
class DiscretiseSettings:
    """How samples become moves; the recorder's parameters of the same names say more."""

    hysteresis_m: float = 0.2
    command_min_speed_m_s: float = 0.1
    command_timeout_s: float = 0.5
    altitude_tolerance_m: float = 1.0
    max_gap_s: float = 2.0
    max_skip_cells: int = MAX_SKIP_CELLS


def discretise(
    grid: Grid,
    recording: Recording,
    window_ns: Window,
    settings: DiscretiseSettings,
    demonstration_id: str,
    end_reason: EndReason,
) -> Demonstration:
    """The demonstration flown within a window of stamps, both ends included.

    Only stamps decide, so the order in which poses and commands arrived beside each other does not matter.
    Samples are dropped, and counted in the audit, when they have no stamp, their stamp repeats or goes
    backward, a coordinate is no number, they lie outside the grid, or off its altitude by more than the
    tolerance (climb, landing). The first sample left gives the first state: no state precedes it. Hovering
    makes no move; how long it lasted is in the stamps.

    The action of a move is the direction commanded when the cell was left, i.e. by the last command
    stamped before the first sample in the next cell, not older than `command_timeout_s`, at least
    `command_min_speed_m_s` fast and not diagonal. Otherwise the motion decides, counted as ambiguous. Where a
    sample crossed several borders, the cells on the way are inserted (counted in `cell_skips`) and the
    motion decides; where that can't be (see CellTracker) the state before has no known action and is left out.

    The demonstration ends at the final waypoint or in a blocked cell: samples after that are not looked at.
    The state at the end has no action and so is not in `states`. The result's `window_ns` runs from the first
    to the last stamp looked at; discretising that window again gives the same demonstration.

    Returns:
        The demonstration; its end reason is FINAL_WAYPOINT or BLOCKED where that was so, else the one given
        (STOPPED in place of a FINAL_WAYPOINT or BLOCKED that the samples don't show).

    Raises:
        InputError: the hysteresis is not below half a cell.
    """
    tracker = CellTracker(
        grid, settings.hysteresis_m, max_skip_cells=settings.max_skip_cells, max_gap_s=settings.max_gap_s,
    )
    poses = recording.poses
    inside = _in_window(poses.stamps_ns, window_ns)
    if not inside.any():
        audit = Audit(notes=('no positions in the window',))
        return Demonstration(demonstration_id, recording.source, grid, (), (), (), window_ns, _given(end_reason), audit)
    fit = _fitness(grid, poses, settings)
    used = np.flatnonzero(_on_time(poses.stamps_ns, inside) & fit.on_grid)
    track, end = follow(tracker, poses.stamps_ns[used], poses.positions_enu_m[used])
    stamps = poses.stamps_ns[inside]
    cut = int(stamps.min()), int(stamps.max()) if end is None else end
    actions, ambiguous, astray = _actions(track, recording.commands, cut, settings)
    return Demonstration(
        demonstration_id=demonstration_id,
        source=recording.source,
        grid=grid,
        states=tuple(track.states),
        actions=tuple(actions),
        stamps_ns=tuple(track.entered_ns),
        window_ns=cut,
        end_reason=_ended(grid, tracker, end_reason),
        audit=_audit(grid, recording, cut, settings, (fit, track, ambiguous, astray)),
    )


# -- which samples count ---------------------------------------------------------------------------
def _in_window(stamps_ns: Stamps, window_ns: Window) -> Mask:
    return np.asarray((stamps_ns != 0) & (stamps_ns >= window_ns[0]) & (stamps_ns <= window_ns[1]))


def _on_time(stamps_ns: Stamps, inside: Mask) -> Mask:
    """Samples of the window that are newer than all that arrived before them."""
    stamps = np.where(inside, stamps_ns, np.iinfo(np.int64).min)
    newest = np.maximum.accumulate(stamps)
    fresh = np.ones_like(inside)
    fresh[1:] = stamps[1:] > newest[:-1]
    return inside & fresh


class _Fitness(NamedTuple):
    """Which positions are numbers, which of them at the altitude, and which of those on the grid."""

    finite: Mask
    level: Mask
    on_grid: Mask


def _fitness(grid: Grid, poses: PoseSamples, settings: DiscretiseSettings) -> _Fitness:
    x_enu_m, y_enu_m, z_enu_m = poses.positions_enu_m.T
    finite = np.isfinite(x_enu_m) & np.isfinite(y_enu_m) & np.isfinite(z_enu_m)
    level = finite & (np.abs(z_enu_m - grid.altitude_m) <= settings.altitude_tolerance_m)
    on_grid, margin = level, settings.hysteresis_m
    # As CellTracker.is_inside.
    for values, origin, size in zip((x_enu_m, y_enu_m), grid.origin_enu_m, (grid.width, grid.height), strict=True):
        past = values - origin
        on_grid = on_grid & (past >= -margin) & (past <= size * grid.resolution_m + margin)
    return _Fitness(finite, level, on_grid)


# -- actions ---------------------------------------------------------------------------------------
def _actions(
    track: Track, commands: CommandSamples, window_ns: Window, settings: DiscretiseSettings,
) -> tuple[list[int], int, int]:
    """Actions of the moves, how many of them the motion decided, and how many went elsewhere than commanded."""
    kept = _in_window(commands.stamps_ns, window_ns) & np.isfinite(commands.velocities_enu_m_s).all(axis=1)
    stamps_ns = commands.stamps_ns[kept]
    order = np.argsort(stamps_ns, kind='stable')
    stamps_ns, velocities = stamps_ns[order], commands.velocities_enu_m_s[kept][order]
    in_force = np.searchsorted(stamps_ns, np.asarray(track.left_ns, dtype=np.int64), side='left') - 1
    actions, ambiguous, astray = [], 0, 0
    for motion, left_ns, inserted, index in zip(track.motions, track.left_ns, track.inserted, in_force, strict=True):
        commanded = None
        if not inserted and index >= 0 and left_ns - int(stamps_ns[index]) <= settings.command_timeout_s * NS:
            east_m_s, north_m_s, _ = velocities[index].tolist()
            commanded = direction(east_m_s, north_m_s, settings.command_min_speed_m_s)
        ambiguous += commanded is None and not inserted
        astray += commanded is not None and commanded != motion
        actions.append(motion if commanded is None else commanded)
    return actions, ambiguous, astray


def direction(east_m_s: float, north_m_s: float, min_speed_m_s: float) -> int | None:
    """The action that a velocity points at, None when it is too slow or near a diagonal."""
    east, north = abs(east_m_s), abs(north_m_s)
    if float(np.hypot(east, north)) < min_speed_m_s or min(east, north) > TIE_RATIO * max(east, north) or east == north:
        return None
    if east > north:
        return int(Action.EAST if east_m_s > 0 else Action.WEST)
    return int(Action.NORTH if north_m_s > 0 else Action.SOUTH)


# -- the end and the audit -------------------------------------------------------------------------
def _given(end_reason: EndReason) -> EndReason:
    return EndReason.STOPPED if end_reason in (EndReason.FINAL_WAYPOINT, EndReason.BLOCKED) else end_reason


def _ended(grid: Grid, tracker: CellTracker, end_reason: EndReason) -> EndReason:
    if not tracker.finished:
        return _given(end_reason)
    return EndReason.FINAL_WAYPOINT if tracker.state == grid.goal_state else EndReason.BLOCKED


def _audit(
    grid: Grid, recording: Recording, window_ns: Window, settings: DiscretiseSettings, moves: tuple[_Fitness, Track, int, int],
) -> Audit:
    """Counts over the samples of the final window; each sample is counted for the first reason that fits."""
    poses, (fit, track, ambiguous, astray) = recording.poses, moves
    inside = _in_window(poses.stamps_ns, window_ns)
    where = np.flatnonzero(inside)
    unstamped = _count(poses.stamps_ns[where[0] : where[-1] + 1] == 0)
    on_time = _on_time(poses.stamps_ns, inside)
    finite, level, used = (on_time & mask for mask in fit)
    gaps = np.diff(poses.stamps_ns[used])
    max_gap_s = float(np.float32(gaps.max() / NS)) if gaps.size else 0.0  # As it travels in the message.
    numbers = {
        'nan': _count(on_time & ~finite),
        'off_altitude': _count(finite & ~level),
        'used': _count(used),
        'astray': astray,
        'start_ns': window_ns[0],
        'commands': _count(_in_window(recording.commands.stamps_ns, window_ns)),
    }
    return Audit(
        samples=_count(inside) + unstamped,
        late=_count(inside & ~on_time),
        unstamped=unstamped,
        out_of_grid=_count(level & ~used),
        cell_skips=track.skips,
        ambiguous_actions=ambiguous,
        max_gap_s=max_gap_s,
        notes=_notes(grid, settings, track, numbers, max_gap_s),
    )


def _count(mask: Mask) -> int:
    return int(np.count_nonzero(mask))


def _notes(
    grid: Grid, settings: DiscretiseSettings, track: Track, numbers: dict[str, int], max_gap_s: float,
) -> tuple[str, ...]:
    """One sentence for each thing that a person should know."""
    breaks, start_ns = track.breaks[:MAX_BREAK_NOTES], numbers['start_ns']
    more = len(track.breaks) - len(breaks)
    tolerance = f'{settings.altitude_tolerance_m:g} m off the altitude of {grid.altitude_m:g} m'
    said = (
        (numbers['used'] == 0, 'no sample lies on the grid at its altitude'),
        (numbers['nan'], f'{numbers["nan"]} positions are not numbers and were dropped'),
        (numbers['off_altitude'], f'{numbers["off_altitude"]} samples more than {tolerance} were not used'),
        (max_gap_s > settings.max_gap_s, f'{max_gap_s:.2f} s passed between two used samples'),
        (track.states and not numbers['commands'], 'no commands were recorded: the motion decided every move'),
        (numbers['astray'], f'{numbers["astray"]} moves went elsewhere than commanded; the command is the action'),
        *((True, f'{note}, {(stamp_ns - start_ns) / NS:.1f} s into the flight') for stamp_ns, note in breaks),
        (more > 0, f'{more} more stretches of moves are not known'),
    )
    return tuple(note for condition, note in said if condition)

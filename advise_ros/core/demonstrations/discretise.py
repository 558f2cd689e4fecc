"""Samples of one flight -> a demonstration on the grid, with an audit of what was not used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from advise_ros.core.demonstrations.action_rule import ActionVerdict, Commands, Decided
from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.demonstrations.samples import STRAY_NS, CommandSamples, PoseSamples, Recording
from advise_ros.core.demonstrations.steps import Movers, crossing_speeds_m_s, decided_moves, has_ended, steps_of
from advise_ros.core.grid.cell_path import Follower
from advise_ros.core.grid.cell_tracker import CellTracker, TrackerSettings
from advise_ros.core.grid.grid import Grid
from advise_ros.core.parameter import parameter, same_as
from advise_ros.core.units import NS

# Sentences about unknown moves in one audit; the rest is counted.
MAX_BREAK_NOTES = 5
# Two positions are further apart than this and faster than anything flies: they are not of one track.
JUMP_M, JUMP_SPEED_M_S = 2.0, 30.0

Mask = npt.NDArray[np.bool_]
Stamps = npt.NDArray[np.int64]
Window = tuple[int, int]


@dataclass(frozen=True)
class DiscretiseSettings:
    """How samples become moves: parameters of the recorder."""

    hysteresis_m: float = same_as(TrackerSettings, 'hysteresis_m')
    command_min_speed_m_s: float = parameter(0.1, 'slower commands have no direction', low=0.0, high=10.0)
    command_timeout_s: float = parameter(0.5, 'an older command says nothing about a move', low=0.05, high=60.0)
    altitude_tolerance_m: float = parameter(
        1.0, 'samples further from the grid altitude are not on the route', low=0.1, high=1000.0,
    )
    max_gap_s: float = parameter(
        2.0, 'a longer gap between samples is noted in the audit, and cells skipped in it are not guessed', low=0.05, high=3600.0,
    )
    max_skip_cells: int = same_as(TrackerSettings, 'max_skip_cells')


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
    Samples are dropped, and counted in the audit, when they have no stamp, their stamp repeats, goes backward or is far
    from those of the others, a coordinate is no number, they lie outside the grid, or off its altitude by more than the
    tolerance (climb, landing). The first sample left gives the first state: no state precedes it. Hovering
    makes no move; how long it lasted is in the stamps.

    The action of a move is the direction flown, or the one commanded all the way where the vehicle was pushed elsewhere
    (see action_rule.py; counted in the audit). Moves that nobody made, in a mode in which the autopilot flies itself or
    without a command, are left out and counted. A command that was held towards the edge of the grid for a whole cell's way
    is a step that stays in its state. Where a sample crossed several borders, the cells on the way are inserted (counted in
    `cell_skips`) and the motion decides; where that can't be (see CellTracker) the state before has no known action
    and is left out.

    The demonstration ends at the final waypoint or in a blocked cell, if somebody flew there: samples after that are not
    looked at. The state at the end has no action and so is not in `states`. The result's `window_ns` runs from the first
    to the last stamp looked at; discretising that window again gives the same demonstration.

    Args:
        grid: states and actions.
        recording: positions, commands and states of the vehicle, in any order.
        window_ns: first and last stamp.
        settings: thresholds and tolerances.
        demonstration_id: of the result.
        end_reason: why the window ends there.

    Returns:
        The demonstration; its end reason is FINAL_WAYPOINT or BLOCKED where that was so, else the one given
        (STOPPED in place of a FINAL_WAYPOINT or BLOCKED that the samples don't show).

    Raises:
        InputError: the hysteresis is not below half a cell.
    """
    followed = follow(grid, recording, window_ns, settings)
    if followed is None:
        audit = Audit(notes=('no positions in the window',))
        return Demonstration(demonstration_id, recording.source, grid, (), (), (), window_ns, _given(end_reason), audit)
    cut = followed.window_ns
    level_ns = _level_ns(recording.poses, followed)
    steps = steps_of(followed.follower, followed.decided, followed.commands, followed.movers, level_ns)
    return Demonstration(
        demonstration_id=demonstration_id,
        source=recording.source,
        grid=grid,
        states=tuple(step.state for step in steps),
        actions=tuple(step.action for step in steps),
        stamps_ns=tuple(step.entered_ns for step in steps),
        window_ns=cut,
        end_reason=_ended(grid, followed.follower.state) if followed.ended else _given(end_reason),
        audit=_audit(grid, recording, cut, settings, followed),
    )


def new_tracker(grid: Grid, settings: DiscretiseSettings) -> CellTracker:
    """One at the beginning of a flight."""
    return CellTracker(
        grid, settings.hysteresis_m, max_skip_cells=settings.max_skip_cells, max_gap_s=settings.max_gap_s,
    )


class Followed(NamedTuple):
    """A flight up to where it ends.

    Attributes:
        window_ns: first and last stamp looked at.
        fit: of all positions of the recording.
        decided: one for each move of the follower's track.
        commands: those in the window.
        ended: it came to the final waypoint or into a blocked cell.
    """

    window_ns: Window
    fit: Fitness
    follower: Follower
    decided: list[Decided]
    commands: Commands
    movers: Movers
    ended: bool

    def count(self, verdict: ActionVerdict) -> int:
        """How many moves were decided so."""
        return sum(one.verdict is verdict for one in self.decided)

    def modes(self) -> str:
        """Those in which the autopilot moved the vehicle by itself."""
        left_ns = self.follower.track.left_ns
        names = [
            self.movers.mode(at_ns) for one, at_ns in zip(self.decided, left_ns, strict=True)
            if one.verdict is ActionVerdict.ITSELF
        ]
        return ', '.join(dict.fromkeys(names))


def follow(grid: Grid, recording: Recording, window_ns: Window, settings: DiscretiseSettings) -> Followed | None:
    """The flight within a window of stamps; None where no position has such a stamp.

    Args:
        grid: states and actions.
        recording: as for `discretise`.
        window_ns: first and last stamp, both included.
        settings: as for `discretise`.
    """
    poses, movers = recording.poses, Movers(recording.events)
    inside = _in_window(poses.stamps_ns, window_ns)
    if not inside.any():
        return None
    fit = fitness(grid, poses, settings)
    used = np.flatnonzero(_on_time(poses.stamps_ns, inside) & fit.on_grid)
    fixes = poses.stamps_ns[used], poses.positions_enu_m[used]
    follower = Follower(new_tracker(grid, settings))
    follower.take(*fixes)
    first_ns, last_ns = int(poses.stamps_ns[inside].min()), int(poses.stamps_ns[inside].max())
    cut = first_ns, last_ns if follower.end_ns is None else follower.end_ns
    commands = _commands_in(recording.commands, cut, settings)
    speeds_m_s = crossing_speeds_m_s(follower, *fixes)
    decided = decided_moves(follower, speeds_m_s, commands, movers, commanded=_is_commanded(recording, cut))
    ended = has_ended(follower, decided)
    if follower.end_ns is not None and not ended:  # Nobody flew there.
        cut = first_ns, last_ns
        commands = _commands_in(recording.commands, cut, settings)
    return Followed(cut, fit, follower, decided, commands, movers, ended)


# -- which samples count ---------------------------------------------------------------------------
def _in_window(stamps_ns: Stamps, window_ns: Window) -> Mask:
    return np.asarray((stamps_ns > 0) & (stamps_ns >= window_ns[0]) & (stamps_ns <= window_ns[1]))


def _on_time(stamps_ns: Stamps, inside: Mask) -> Mask:
    """Samples of the window that are newer than all that arrived before them."""
    stamps = np.where(inside, stamps_ns, np.iinfo(np.int64).min)
    newest = np.maximum.accumulate(stamps)
    fresh = np.ones_like(inside)
    fresh[1:] = stamps[1:] > newest[:-1]
    return inside & fresh


def _level_ns(poses: PoseSamples, followed: Followed) -> Stamps:
    """Stamps of the positions at the altitude, on the grid or off it."""
    inside = _in_window(poses.stamps_ns, followed.window_ns)
    return poses.stamps_ns[_on_time(poses.stamps_ns, inside) & followed.fit.level]


class Fitness(NamedTuple):
    """Which positions are numbers, which of them at the altitude, and which of those on the grid."""

    finite: Mask
    level: Mask
    on_grid: Mask


def fitness(grid: Grid, poses: PoseSamples, settings: DiscretiseSettings) -> Fitness:
    x_enu_m, y_enu_m, z_enu_m = poses.positions_enu_m.T
    finite = np.isfinite(x_enu_m) & np.isfinite(y_enu_m) & np.isfinite(z_enu_m)
    level = finite & (np.abs(z_enu_m - grid.altitude_m) <= settings.altitude_tolerance_m)
    on_grid, margin = level, settings.hysteresis_m
    # As CellTracker.is_inside.
    for values, origin, size in zip((x_enu_m, y_enu_m), grid.origin_enu_m, (grid.width, grid.height), strict=True):
        past = values - origin
        on_grid = on_grid & (past >= -margin) & (past <= size * grid.resolution_m + margin)
    return Fitness(finite, level, on_grid)


# -- commands --------------------------------------------------------------------------------------
def _commands_in(commands: CommandSamples, window_ns: Window, settings: DiscretiseSettings) -> Commands:
    """The commands of a window of stamps, both ends included."""
    stamps_ns, velocities = commands
    kept = _in_window(stamps_ns, window_ns)
    return Commands(
        CommandSamples(stamps_ns[kept], velocities[kept]), settings.command_min_speed_m_s, settings.command_timeout_s,
    )


def _is_commanded(recording: Recording, window_ns: Window) -> bool:
    """There were commands up to the end of the window."""
    stamps_ns = recording.commands.stamps_ns
    return recording.commanded_ns <= window_ns[1] or bool(((stamps_ns > 0) & (stamps_ns <= window_ns[1])).any())


# -- the end and the audit -------------------------------------------------------------------------
def _given(end_reason: EndReason) -> EndReason:
    return EndReason.STOPPED if end_reason in (EndReason.FINAL_WAYPOINT, EndReason.BLOCKED) else end_reason


def _ended(grid: Grid, state: int | None) -> EndReason:
    return EndReason.FINAL_WAYPOINT if state == grid.goal_state else EndReason.BLOCKED


def _audit(
    grid: Grid, recording: Recording, window_ns: Window, settings: DiscretiseSettings, found: Followed,
) -> Audit:
    """Counts over the samples of the final window; each sample is counted for the first reason that fits."""
    poses, fit, track = recording.poses, found.fit, found.follower.track
    inside = _in_window(poses.stamps_ns, window_ns)
    on_time = _on_time(poses.stamps_ns, inside)
    where = np.flatnonzero(on_time)
    inside[where[-1] + 1 :] = False  # A recorder is done by then: what is later still is not looked at.
    unstamped, strays = (_count(poses.stamps_ns[where[0] : where[-1] + 1] == stamp_ns) for stamp_ns in (0, STRAY_NS))
    finite, level, used = (on_time & mask for mask in fit)
    gaps = np.diff(poses.stamps_ns[used])
    max_gap_s = float(np.float32(gaps.max() / NS)) if gaps.size else 0.0  # As it travels in the message.
    numbers = {
        'nan': _count(on_time & ~finite),
        'off_altitude': _count(finite & ~level),
        'used': _count(used),
        'stray': strays,
        'astray': found.count(ActionVerdict.ASTRAY),
        'drifted': found.count(ActionVerdict.DRIFTED),
        'itself': found.count(ActionVerdict.ITSELF),
        'start_ns': window_ns[0],
        'commands': _count(_in_window(recording.commands.stamps_ns, window_ns)),
    }
    return Audit(
        samples=_count(inside) + unstamped + strays,
        late=_count(inside & ~on_time) + strays,
        unstamped=unstamped,
        out_of_grid=_count(level & ~used),
        cell_skips=track.skips,
        ambiguous_actions=sum(
            one.verdict is ActionVerdict.BY_MOTION and not inserted
            for one, inserted in zip(found.decided, track.inserted, strict=True)
        ),
        max_gap_s=max_gap_s,
        notes=(
            *_notes(grid, settings, found, numbers, max_gap_s),
            *_jumps(poses.stamps_ns[finite], poses.positions_enu_m[finite], window_ns[0]),
        ),
    )


def _jumps(stamps_ns: Stamps, positions_enu_m: npt.NDArray[np.float64], start_ns: int) -> tuple[str, ...]:
    """One sentence where positions jump, as they do when the origin of the local frame is set anew."""
    ways_m = np.linalg.norm(np.diff(positions_enu_m, axis=0), axis=1)
    jumps = np.flatnonzero((ways_m > JUMP_M) & (ways_m > JUMP_SPEED_M_S * np.diff(stamps_ns) / NS))
    if not jumps.size:
        return ()
    at_s = (stamps_ns[jumps[0] + 1] - start_ns) / NS
    how = f'positions jump by {ways_m[jumps[0]]:.0f} m' if jumps.size == 1 else (
        f'positions jump {jumps.size} times, by up to {ways_m[jumps].max():.0f} m, first'
    )
    return (f'{how} {at_s:.1f} s into the flight: the origin of their frame was set anew, or they are of several vehicles',)


def _count(mask: Mask) -> int:
    return int(np.count_nonzero(mask))


def _notes(
    grid: Grid, settings: DiscretiseSettings, found: Followed, numbers: dict[str, int], max_gap_s: float,
) -> tuple[str, ...]:
    """One sentence for each thing that a person should know."""
    track = found.follower.track
    breaks, start_ns = track.breaks[:MAX_BREAK_NOTES], numbers['start_ns']
    more = len(track.breaks) - len(breaks)
    tolerance = f'{settings.altitude_tolerance_m:g} m off the altitude of {grid.altitude_m:g} m'
    said = (
        (numbers['used'] == 0, 'no sample lies on the grid at its altitude'),
        (numbers['nan'], f'{numbers["nan"]} positions are not numbers and were dropped'),
        (numbers['off_altitude'], f'{numbers["off_altitude"]} samples more than {tolerance} were not used'),
        (max_gap_s > settings.max_gap_s, f'{max_gap_s:.2f} s passed between two used samples'),
        (numbers['stray'], f'{numbers["stray"]} positions have stamps far from the others and were not used'),
        (
            track.states and not numbers['commands'] and not numbers['drifted'] and not numbers['itself'],
            'no commands were recorded: the motion decided every move',
        ),
        (numbers['astray'], f'{numbers["astray"]} moves went elsewhere than commanded; the command is the action'),
        (numbers['drifted'], f'{numbers["drifted"]} moves without a command are left out: the vehicle drifted'),
        (numbers['itself'], f'{numbers["itself"]} moves are left out: the autopilot flew by itself ({found.modes()})'),
        *((True, f'{note}, {(stamp_ns - start_ns) / NS:.1f} s into the flight') for stamp_ns, note in breaks),
        (more > 0, f'{more} more stretches of moves are not known'),
    )
    return tuple(note for condition, note in said if condition)

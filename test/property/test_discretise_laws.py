"""Laws of the tracker and of discretisation."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings, discretise
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.demonstrations.samples import PoseSamples, Recording
from advise_ros.core.grid.cell_path import Follower
from advise_ros.core.grid.cell_tracker import CellTracker, Fix
from advise_ros.core.grid.grid import Grid
from advise_ros.core.units import NS
from support.flown import GRID, commands_of, flight, joined, round_trip

SETTINGS = DiscretiseSettings()
OPEN = Grid(2.0, 5, 5, (-1.0, -1.0), 5.0, waypoints=(24, 4, 20, 0))
# A start on the first waypoint, a blocked cell, cells that the route comes by twice.
NARROW = Grid(1.0, 4, 3, (0.3, -0.7), 5.0, waypoints=(5, 3, 0, 3), blocked=(6,))
END = EndReason.END_OF_LOG


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    """Random walks with noise, jumps, gaps, and samples that are late, unstamped, NaN or off the grid."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    n = draw(st.integers(1, 300))
    steps = rng.normal(0.0, draw(st.sampled_from([0.05, 0.3, 1.5])), (n, 3))
    positions = np.array([4.0, 4.0, 5.0]) + np.cumsum(steps, axis=0) * [1, 1, 0.1]
    stamps = np.cumsum(rng.choice([10**7, 10**8, 3 * 10**9], size=n, p=[0.2, 0.75, 0.05])).astype(np.int64)
    for value in (0, None):
        chosen = rng.random(n) < draw(st.sampled_from([0.0, 0.05]))
        stamps[chosen] = value if value is not None else rng.choice(stamps, chosen.sum())
    positions[rng.random(n) < 0.02] = np.nan
    poses = PoseSamples(stamps, positions)
    return Recording(poses, commands_of(poses))


def run(recording: Recording, window_ns: tuple[int, int], end_reason: EndReason = END, grid: Grid = OPEN) -> Demonstration:
    return discretise(grid, recording, window_ns, SETTINGS, 'x', end_reason)


@given(recordings())
@settings(max_examples=150, deadline=None)
def test_discretising_the_resulting_window_again_gives_the_same(recording: Recording) -> None:
    found = run(recording, (1, 2**62))
    assert run(recording, found.window_ns, found.end_reason) == found


@given(recordings())
@settings(max_examples=150, deadline=None)
def test_states_follow_each_other_where_nothing_is_unknown(recording: Recording) -> None:
    found = run(recording, (1, 2**62))
    assert list(found.stamps_ns) == sorted(found.stamps_ns)
    layers = [OPEN.next_waypoint(state) for state in found.states]
    assert layers == sorted(layers)
    assert not any(OPEN.is_terminal(state) for state in found.states)
    if not any('not known' in note or 'left out' in note for note in found.audit.notes):
        for here, there in zip(found.states, found.states[1:], strict=False):
            assert there in {OPEN.successor(here, action) for action in range(4)}


@given(recordings())
@settings(max_examples=100, deadline=None)
def test_the_live_tracker_and_the_vectorised_rule_agree(recording: Recording) -> None:
    stamps = recording.poses.stamps_ns.copy()
    stamps[:] = np.arange(1, len(stamps) + 1) * 10**8
    positions = np.nan_to_num(recording.poses.positions_enu_m, nan=3.0)
    positions[:, 2] = OPEN.altitude_m
    tracker = CellTracker(OPEN, SETTINGS.hysteresis_m, max_skip_cells=SETTINGS.max_skip_cells, max_gap_s=SETTINGS.max_gap_s)
    states = [tracker.update(x, y, int(stamp)) for stamp, (x, y, _) in zip(stamps, positions, strict=True)]
    found = run(Recording(PoseSamples(stamps, positions)), (1, 2**62))
    visited = [state for i, state in enumerate(states) if state is not None and (i == 0 or state != states[i - 1])]
    if found.audit.notes and any('drifted' in note for note in found.audit.notes):
        return
    seen = [s for s in found.states if s in set(visited)]
    assert set(seen) <= set(visited) and tracker.finished == (found.end_reason in (EndReason.FINAL_WAYPOINT, EndReason.BLOCKED))
    if not found.audit.cell_skips:
        assert list(found.states) == visited[:-1]


@given(
    st.integers(0, 2**32), st.integers(1, 250), st.sampled_from([0.02, 0.2, 0.6, 2.0]),
    st.sampled_from([0.0, 0.1, 0.49]), st.sampled_from([OPEN, NARROW]),
)


@settings(max_examples=300, deadline=None)
def test_a_flight_at_once_is_tracked_as_fix_by_fix(seed: int, n: int, step_m: float, hysteresis_m: float, grid: Grid) -> None:
    rng = np.random.default_rng(seed)
    trackers = [CellTracker(grid, hysteresis_m, max_skip_cells=2, max_gap_s=1.0) for _ in range(2)]
    walk = np.asarray(grid.origin_enu_m) + rng.uniform(0, 4, 2) + np.cumsum(rng.normal(0.0, step_m, (n, 2)), axis=0)
    walk[::7] = np.round(walk[::7] * 10) / 10  # On borders and on the lines of the hysteresis, too.
    walk = walk[[trackers[0].is_inside(x, y) for x, y in walk.tolist()]]
    stamps = np.cumsum(rng.choice([10**7, 2 * 10**9], size=len(walk), p=[0.9, 0.1])).astype(np.int64)
    fixes = [Fix(stamp, x, y) for stamp, (x, y) in zip(stamps.tolist(), walk.tolist(), strict=True)]
    moves, broken, end_ns = [], [], None
    for before, now in zip([Fix(0, 0.0, 0.0), *fixes], fixes, strict=False):
        state, step = trackers[0].state, trackers[0].step(before, now)
        if step is not None and not step.broken and state is not None:
            moves += zip((state, *step.states), step.actions, [now.stamp_ns] * len(step.actions), strict=False)
        broken += [now.stamp_ns] if step is not None and step.broken else []
        end_ns = now.stamp_ns if end_ns is None and trackers[0].finished else end_ns
    follower = Follower(trackers[1])
    blocks = np.sort(rng.integers(0, len(walk) + 1, 3))
    for part in np.split(np.arange(len(walk)), blocks):
        follower.take(stamps[part], walk[part])
    track, found_end_ns = follower.track, follower.end_ns
    assert list(zip(track.states, track.motions, track.left_ns, strict=True)) == moves
    assert [stamp_ns for stamp_ns, _ in track.breaks] == broken
    assert (found_end_ns, trackers[1].state) == (end_ns, trackers[0].state)


@given(st.integers(0, 10**6), st.integers(1, 40), st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_commands_may_arrive_in_any_order(seed: int, samples: int, start: int) -> None:
    recording = flight(OPEN, round_trip(OPEN), start_ns=1 + start)
    order = np.random.default_rng(seed).permutation(len(recording.commands.stamps_ns))
    shuffled = recording._replace(commands=type(recording.commands)(*(a[order] for a in recording.commands)))
    assert run(shuffled, (1, 2**62)) == run(recording, (1, 2**62))


@given(st.lists(st.integers(2, 11), min_size=1, max_size=4))
@settings(max_examples=40, deadline=None)
def test_flights_in_one_recording_are_those_of_each_alone(lengths: list[int]) -> None:
    route = round_trip()
    flown = [flight(GRID, route[:length], start_ns=(1 + index) * 1000 * NS) for index, length in enumerate(lengths)]
    together = demonstrations_of(GRID, joined(*flown), SETTINGS).demonstrations
    alone = [d for one in flown for d in demonstrations_of(GRID, one, SETTINGS).demonstrations]
    assert [d.states for d in together] == [d.states for d in alone] == [tuple(d.states) for d in alone]
    assert [d.window_ns for d in together] == [d.window_ns for d in alone]

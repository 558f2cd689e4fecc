"""The real recording that ships, as log and as bag: what is found in it stays what it is."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from advise_ros.core.demonstrations.demonstration import Demonstration, EndReason
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of, waypoints_reached
from advise_ros.core.demonstrations.recorder import Recorder
from advise_ros.core.demonstrations.samples import NO_COMMANDS
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.learner import learn
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.sources import read_recording
from support.paths import ROOT

BAG, LOG = ROOT / 'bags' / 'arducopter_five_flights', ROOT / 'bags' / 'arducopter_flight1.tlog'
GRID = load_grid(ROOT / 'config' / 'grid_6x6.yaml')
EXPECTED = json.loads((Path(__file__).parent / 'arducopter_five_flights.json').read_text())
SETTINGS = DiscretiseSettings()


def moves(demonstration: Demonstration) -> str:
    return ''.join('NESW'[action] for action in demonstration.actions)


def from_bag() -> tuple[Demonstration, ...]:
    return demonstrations_of(GRID, read_recording(BAG), SETTINGS).demonstrations


def test_the_five_flights_are_what_they_were() -> None:
    found = from_bag()
    assert [moves(d) for d in found] == [flight['moves'] for flight in EXPECTED]
    assert [list(d.states) for d in found] == [flight['states'] for flight in EXPECTED]
    assert [d.window_ns[1] - d.window_ns[0] for d in found] == [flight['duration_ns'] for flight in EXPECTED]


def test_each_flight_visits_the_waypoints_in_order_with_a_clean_audit() -> None:
    for found in from_bag():
        assert found.end_reason is EndReason.FINAL_WAYPOINT and waypoints_reached(found) == 4
        audit = found.audit
        assert (audit.late, audit.unstamped, audit.out_of_grid, audit.cell_skips, audit.ambiguous_actions) == (0,) * 5
        assert audit.max_gap_s < 0.1 and audit.notes == ()
        assert [GRID.successor(*pair) for pair in zip(found.states, found.actions, strict=True)][:-1] == list(found.states[1:])


def test_the_log_of_the_first_flight_tells_the_same_as_the_bag() -> None:
    (found,) = demonstrations_of(GRID, read_recording(LOG), SETTINGS).demonstrations
    first = from_bag()[0]
    assert (found.states, found.actions, found.stamps_ns, found.window_ns) == (
        first.states, first.actions, first.stamps_ns, first.window_ns,
    )


@pytest.mark.parametrize('missing', ['events', 'commands', 'both'])
def test_states_and_commands_of_the_vehicle_can_be_missing(missing: str) -> None:
    recording = read_recording(BAG)
    without = recording._replace(
        events=recording.events if missing == 'commands' else (),
        commands=recording.commands if missing == 'events' else NO_COMMANDS,
    )
    found = demonstrations_of(GRID, without, SETTINGS).demonstrations
    assert [moves(d) for d in found] == [flight['moves'] for flight in EXPECTED]


@pytest.mark.parametrize('every', [2, 5, 10])
def test_fewer_positions_give_the_same_moves(every: int) -> None:
    recording = read_recording(BAG)
    thin = recording._replace(poses=type(recording.poses)(*(array[::every] for array in recording.poses)))
    assert [moves(d) for d in demonstrations_of(GRID, thin, SETTINGS).demonstrations] == [f['moves'] for f in EXPECTED]


def test_played_live_the_recorder_gives_the_same() -> None:
    recording = read_recording(BAG)
    live = Recorder(GRID, SETTINGS, recording.source, by_flights=True)
    entries = [
        *((event.stamp_ns, 0, event) for event in recording.events),
        *((int(stamp), 1, tuple(p.tolist())) for stamp, p in zip(*recording.poses, strict=True)),
        *((int(stamp), 2, tuple(v.tolist())) for stamp, v in zip(*recording.commands, strict=True)),
    ]
    found = []
    for stamp_ns, kind, value in sorted(entries, key=lambda entry: entry[:2]):
        if kind:
            (live.pose if kind == 1 else live.command)(stamp_ns, value)
        else:
            live.vehicle(value)
        found += [output.demonstration for output in live.take(stamp_ns / 1e9) if output.demonstration]
    assert tuple(found) == from_bag()


def test_the_learner_runs_on_them() -> None:
    learned = learn(GRID, LearnSettings(acquisition='occupancy'), from_bag(), ())
    assert learned.n_demonstrations == 5 and np.isfinite(learned.reward).all()
    assert learned.query is not None and learned.query.states


def test_the_script_makes_the_log_again(tmp_path: Path) -> None:
    script = runpy.run_path(str(ROOT / 'bags' / 'make_bags.py'))
    recording = read_recording(LOG)
    script['cut_first_flight'](LOG, recording, tmp_path / 'again.tlog')
    script['write_bag'](recording, tmp_path / 'bag')
    assert (tmp_path / 'again.tlog').read_bytes() == LOG.read_bytes()
    made, read = read_recording(tmp_path / 'bag'), read_recording(LOG)
    assert (made.poses.positions_enu_m == read.poses.positions_enu_m).all()
    assert made.events == tuple(event for event in read.events if event.in_air is not None)

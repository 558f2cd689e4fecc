"""The demonstrations file."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from advise_ros.core.demonstrations.demonstration import Demonstration, known, standing
from advise_ros.core.demonstrations.discretise import DiscretiseSettings
from advise_ros.core.demonstrations.recorded_flights import demonstrations_of
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.recording.demofile import load_demonstrations, save_demonstrations, to_record
from advise_ros.recording.gridfile import grid_to_mapping
from support.flown import GRID, flight, joined, round_trip


def write(path: Path, records: list[dict[str, Any]]) -> None:
    path.write_text(json.dumps({'grid': grid_to_mapping(GRID), 'demonstrations': records}))


def two() -> tuple[Demonstration, ...]:
    recording = joined(flight(GRID, round_trip()), flight(GRID, round_trip()[:3], start_ns=10**13))
    return demonstrations_of(GRID, recording, DiscretiseSettings()).demonstrations


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / 'demos.json'
    save_demonstrations(path, two())
    assert load_demonstrations(path, GRID) == two()
    written = json.loads(path.read_text())
    assert written['grid'] == grid_to_mapping(GRID)
    assert {'id', 'source', 'states', 'actions', 'stamps_ns', 'audit'} <= written['demonstrations'][0].keys()
    assert list(tmp_path.iterdir()) == [path]


def test_the_fields_of_the_format_are_enough(tmp_path: Path) -> None:
    path = tmp_path / 'demos.json'
    write(path, [{'id': 'a', 'source': 'hand', 'states': [0], 'actions': [1], 'stamps_ns': [7], 'audit': {}}])
    (found,) = load_demonstrations(path, GRID)
    assert found.states == (0,) and found.window_ns == (7, 7)


@pytest.mark.parametrize(
    ('change', 'expected'),
    [
        ({'states': [999]}, 'a state is outside'),
        ({'actions': [4]}, 'an action is outside'),
        ({'actions': []}, 'must be of one length'),
        ({'actions': ['N']}, 'not a list of whole numbers'),
        ({'states': None}, 'not a list of whole numbers'),
        ({'end_reason': 'TIRED'}, "'TIRED' is missing or unknown"),
        ({'audit': 3}, 'entry 0 is malformed'),
        ({'audit': {'late': 'few'}}, 'not a number'),
        ({'window_ns': [1]}, 'not a pair'),
    ],
)
def test_malformed_entries_are_named(tmp_path: Path, change: dict[str, Any], expected: str) -> None:
    path = tmp_path / 'demos.json'
    record = {**to_record(two()[0]), 'states': [0], 'actions': [1], 'stamps_ns': [7], **change}
    write(path, [record])
    with pytest.raises(InputError) as caught:
        load_demonstrations(path, GRID)
    assert expected in str(caught.value) and str(path) in str(caught.value)


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('{', 'not JSON'),
        ('{}', "it has no 'grid' and list 'demonstrations'"),
        ('{"grid": 3, "demonstrations": []}', 'its grid is malformed'),
        ('{"grid": GRID, "demonstrations": [3]}', 'entry 0 is malformed'),
        ('{"grid": GRID, "demonstrations": [{}]}', "'stamps_ns' is missing"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / 'demos.json'
    path.write_text(text.replace('GRID', json.dumps(grid_to_mapping(GRID))))
    with pytest.raises(InputError, match=expected):
        load_demonstrations(path, GRID)


def test_of_another_grid_it_is_said_what_differs_and_how_to_make_it_again(tmp_path: Path) -> None:
    path, recording = tmp_path / 'demos.json', tmp_path / 'flight.tlog'
    recording.touch()
    save_demonstrations(path, [replace(one, source=str(recording)) for one in two()])
    other = replace(GRID, resolution_m=1.5, waypoints=GRID.waypoints[:-1], blocked=(GRID.waypoints[-1],))
    with pytest.raises(InputError) as caught:
        load_demonstrations(path, other)
    said = str(caught.value)
    assert f'resolution {GRID.resolution_m} m there and 1.5 m here' in said
    assert f'waypoints {places(GRID)} there and {places(other)} here' in said
    assert f'blocked cells 0 there and 1 ({list(GRID.xy(GRID.waypoints[-1]))} only) here' in said
    assert 'origin' not in said and 'altitude' not in said and 'size' not in said
    assert f'./advise discretise {recording} --grid' in said


def places(grid: Grid) -> list[list[int]]:
    return [list(grid.xy(cell)) for cell in grid.waypoints]


def test_a_list_of_an_earlier_version_is_not_learnt_from_in_silence(tmp_path: Path) -> None:
    path = tmp_path / 'demos.json'
    path.write_text(json.dumps([to_record(one) for one in two()]))
    with pytest.raises(InputError, match='does not say which grid it was made on; make it again'):
        load_demonstrations(path, GRID)


def test_files_that_cannot_be_used(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='no such file'):
        load_demonstrations(tmp_path / 'none.json', GRID)
    with pytest.raises(InputError, match='cannot be written'):
        save_demonstrations(tmp_path / 'no' / 'where.json', two())


def test_a_demonstration_without_moves_takes_its_namesake_back() -> None:
    first, second = two()
    empty = Demonstration(first.demonstration_id, '', GRID, (), (), (), (0, 0), first.end_reason, first.audit)
    assert standing((first, second, empty)) == (second,)
    assert standing((empty, first)) == (first,)


def test_of_two_namesakes_the_later_one_is_taken_back_first() -> None:
    """A recorder that was started again, or a file: its flights are counted from 1 too."""
    first, second = two()
    namesake = replace(second, demonstration_id=first.demonstration_id)
    empty = Demonstration(first.demonstration_id, '', GRID, (), (), (), (0, 0), first.end_reason, first.audit)
    assert standing((first, namesake, empty)) == (first,)
    assert standing((first, namesake, empty, empty)) == ()
    assert standing((first, empty, namesake)) == (namesake,)


def test_what_comes_again_is_known_by_all_its_stamps() -> None:
    first, second = two()
    assert known(first, (second, first))
    assert not known(first, (second,))
    assert not known(replace(first, window_ns=(0, 1)), (first,))


def test_a_byte_order_mark_in_front_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / 'demos.json'
    save_demonstrations(path, two())
    path.write_bytes(b'\xef\xbb\xbf' + path.read_bytes())
    assert load_demonstrations(path, GRID) == two()


def test_an_empty_list_is_no_start(tmp_path: Path) -> None:
    write(tmp_path / 'demos.json', [])
    with pytest.raises(InputError, match=r'demos\.json: it holds no demonstration; make it again'):
        load_demonstrations(tmp_path / 'demos.json', GRID)


def test_one_id_for_two_demonstrations_is_refused(tmp_path: Path) -> None:
    records = [to_record(one) for one in two()]
    write(tmp_path / 'demos.json', [records[0], records[1], records[0]])
    with pytest.raises(InputError, match="entries 0 and 2 have the same id 'flight-001'; give each its own"):
        load_demonstrations(tmp_path / 'demos.json', GRID)


def test_what_was_read_of_a_recording_is_no_part_of_its_path(tmp_path: Path) -> None:
    """Another grid: the command to make the file again names the recording."""
    recording = tmp_path / 'flight.tlog'
    recording.write_bytes(b'')
    for read in ('', ' (positions /pose, commands none, state none)', ' (positions of vehicle 1)'):
        save_demonstrations(tmp_path / 'demos.json', [replace(two()[0], source=f'{recording}{read}')])
        with pytest.raises(InputError, match=f'discretise {recording} --grid'):
            load_demonstrations(tmp_path / 'demos.json', replace(GRID, altitude_m=7.0))

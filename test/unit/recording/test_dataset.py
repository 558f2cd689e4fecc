"""Many recordings become one dataset, on one core, on all, or on a cluster."""

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from distributed import LocalCluster

from advise_ros.commands.discretise import run
from advise_ros.core.demonstrations.demonstration import Demonstration
from advise_ros.core.errors import InputError
from advise_ros.recording.dataset import load_dataset
from advise_ros.recording.demofile import load_demonstrations
from advise_ros.recording.gridfile import load_grid
from support.paths import ROOT

LOG, BAG = ROOT / 'bags' / 'arducopter_flight1.tlog', ROOT / 'bags' / 'arducopter_five_flights'
GRID = str(ROOT / 'config' / 'grid_6x6.yaml')


@pytest.fixture(scope='module')
def season(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory of recordings, one of which is none."""
    directory = tmp_path_factory.mktemp('season')
    shutil.copy(LOG, directory / 'a.tlog')
    shutil.copytree(BAG, directory / 'day2' / BAG.name)
    (directory / 'day2' / 'broken.mcap').write_bytes(b'\x89MCAP0\r\n and then nothing')
    return directory


def from_one_core(season: Path, out: Path) -> tuple[Demonstration, ...]:
    assert run([str(season), '--grid', GRID, '--out', str(out), '--jobs', '1']) == 2
    return load_demonstrations(out, load_grid(GRID))


def test_a_directory_of_recordings_becomes_a_dataset(season: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = from_one_core(season, tmp_path / 'flights')
    assert [one.demonstration_id for one in found] == [f'flight-{number:03}' for number in range(1, 7)]
    assert found[0].states == found[1].states  # The log of a flight and its bag tell the same.
    dataset = load_dataset(tmp_path / 'flights' / 'dataset.yaml')
    assert dataset.grid == load_grid(GRID) and dataset.demonstrations == found
    paths = {Path(path).relative_to(season).as_posix(): count for path, count in dataset.recordings.items()}
    assert paths == {'a.tlog': 1, 'day2/arducopter_five_flights': 5, 'day2/broken.mcap': 0}
    assert len(dataset.failures) == 1 and 'broken.mcap holds nothing whole' in dataset.failures[0]
    assert capsys.readouterr().err.splitlines() == [f'error: {dataset.failures[0]}']


def test_all_cores_and_a_cluster_find_the_same(season: Path, tmp_path: Path) -> None:
    expected = from_one_core(season, tmp_path / 'one')
    assert run([str(season), '--grid', GRID, '--out', str(tmp_path / 'cores'), '--jobs', '2']) == 2
    assert load_demonstrations(tmp_path / 'cores', load_grid(GRID)) == expected
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, processes=False) as cluster:
        address = cluster.scheduler_address
        assert run([str(season), '--grid', GRID, '--out', str(tmp_path / 'dask'), '--dask', address]) == 2
    assert load_demonstrations(tmp_path / 'dask', load_grid(GRID)) == expected


def test_a_dataset_and_a_list_hold_the_same(tmp_path: Path) -> None:
    assert run([str(BAG), '--grid', GRID, '--out', str(tmp_path / 'x.json')]) == 0
    assert run([str(BAG), '--grid', GRID, '--out', str(tmp_path / 'x')]) == 0
    both = [load_demonstrations(tmp_path / name, load_grid(GRID)) for name in ('x.json', 'x')]
    assert both[0] == both[1]


def test_the_arrays_are_documented_and_without_pickle(tmp_path: Path) -> None:
    run([str(BAG), '--grid', GRID, '--out', str(tmp_path)])
    with np.load(tmp_path / 'demonstrations.npz', allow_pickle=False) as arrays:
        assert {name: array.shape for name, array in arrays.items()} == {
            'ids': (5,), 'sources': (5,), 'notes': (5,), 'begins': (6,), 'states': (148,), 'actions': (148,),
            'stamps_ns': (148,), 'windows_ns': (5, 2), 'end_reasons': (5,), 'audits': (5, 6), 'max_gaps_s': (5,),
        }  # fmt: skip


def values_of(directory: Path) -> dict:
    return yaml.safe_load((directory / 'dataset.yaml').read_text())


def write(directory: Path, values: object) -> None:
    (directory / 'dataset.yaml').write_text(yaml.safe_dump(values))


def lie(directory: Path) -> None:
    """Arrays that are sound but do not belong together."""
    with np.load(directory / 'demonstrations.npz') as arrays:
        held = {**arrays, 'begins': np.array([0, 99])}
    np.savez(directory / 'demonstrations.npz', **held)
    digest = hashlib.sha256((directory / 'demonstrations.npz').read_bytes()).hexdigest()
    write(directory, {**values_of(directory), 'arrays': {'file': 'demonstrations.npz', 'sha256': digest}})


@pytest.mark.parametrize(
    ('spoil', 'words'),
    [
        (lambda d: (d / 'demonstrations.npz').unlink(), 'cannot be read'),
        (lambda d: (d / 'demonstrations.npz').write_bytes(b'PK'), 'is not the one that it was written with'),
        (lambda d: (d / 'dataset.yaml').unlink(), 'cannot be read'),
        (lambda d: write(d, []), 'is no dataset or damaged'),
        (lambda d: write(d, {**values_of(d), 'advise_dataset': 9}), 'its format is 9, this version reads 1'),
        (lambda d: write(d, {**values_of(d), 'grid': {}}), "key 'resolution' is missing"),
        (lambda d: write(d, {**values_of(d), 'settings': {'luck': 1}}), 'is no dataset or damaged'),
        (lie, 'do not fit each other'),
    ],
)
def test_a_damaged_dataset_is_one_sentence(tmp_path: Path, spoil: Callable[[Path], object], words: str) -> None:
    run([str(LOG), '--grid', GRID, '--out', str(tmp_path)])
    spoil(tmp_path)
    with pytest.raises(InputError, match=words) as caught:
        load_demonstrations(tmp_path, load_grid(GRID))
    assert '\n' not in str(caught.value)


def test_a_dataset_of_another_grid_is_refused(tmp_path: Path) -> None:
    run([str(LOG), '--grid', GRID, '--out', str(tmp_path)])
    with pytest.raises(InputError, match='was made on another grid'):
        load_demonstrations(tmp_path, load_grid(ROOT / 'config' / 'grid_demo.yaml'))


def test_no_cluster_and_no_recordings_are_one_sentence_each(
    season: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    assert run([str(season), '--grid', GRID, '--dask', 'nowhere']) == 2
    assert "no Dask scheduler answers at 'nowhere'" in capsys.readouterr().err
    (tmp_path / 'empty').mkdir()
    assert run([str(tmp_path / 'empty'), '--grid', GRID]) == 2
    assert 'is no bag, and there is no recording in it' in capsys.readouterr().err

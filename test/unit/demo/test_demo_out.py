"""What a demo leaves in its directory of results when it is refused: nothing."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from advise_ros.commands import demo
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.demo.console import DemoConsole
from advise_ros.demo.out import out_directory, refuse_a_full_disk
from advise_ros.supervisor import Supervisor


def run_in(out: Path, problem: AdviseError) -> None:
    """A run that has written something when it ends by a problem."""
    with out_directory(out):
        (out / 'logs').mkdir()
        (out / 'demonstrations.json').touch()
        raise problem


def test_a_refused_run_leaves_no_directory_that_it_made(tmp_path: Path) -> None:
    out = tmp_path / 'results' / 'today'
    with pytest.raises(InputError, match='refused'):
        run_in(out, InputError('refused'))
    assert not list(tmp_path.iterdir())


def test_an_empty_directory_of_the_person_stays_and_stays_empty(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='refused'):
        run_in(tmp_path, InputError('refused'))
    assert tmp_path.is_dir()
    assert not list(tmp_path.iterdir())


def test_a_run_that_failed_keeps_its_logs(tmp_path: Path) -> None:
    out = tmp_path / 'results'
    with pytest.raises(AdviseError, match='died'):
        run_in(out, AdviseError('a node died'))
    assert (out / 'logs').exists()


def test_watching_makes_no_directory_before_the_first_child(tmp_path: Path) -> None:
    with Supervisor(tmp_path / 'logs'):
        assert not (tmp_path / 'logs').exists()


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('policy: {ros__parameters: {speed_m_s: -2.0}}', 'policy: .*speed_m_s'),
        ('recorder: {ros__parameters: {hysteresis: 0.1}}', "recorder: parameter 'hysteresis' is unknown; did you mean"),
        ('simulator: {ros__parameters: {gust: 0.1}}', "simulator: parameter 'gust' is unknown"),
    ],
)
def test_a_parameter_of_any_node_is_refused_before_anything_is_made(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / 'params.yaml').write_text(text)
    options = demo.parse(['--out', str(tmp_path / 'out'), '--params-file', str(tmp_path / 'params.yaml')])
    with pytest.raises(InputError, match=said):
        demo.run(options, DemoConsole())
    assert not (tmp_path / 'out').exists()


def test_a_grid_that_cannot_be_read_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    options = demo.parse(['--out', str(tmp_path / 'out'), '--grid', str(tmp_path / 'none.yaml')])
    with pytest.raises(InputError, match=r'none\.yaml'):
        demo.run(options, DemoConsole())
    assert not (tmp_path / 'out').exists()


def test_a_disk_that_is_nearly_full_is_refused_with_what_is_needed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, 'disk_usage', lambda path: SimpleNamespace(free=120 << 20))
    refuse_a_full_disk(tmp_path / 'not' / 'there', 20)
    with pytest.raises(InputError, match='has 120 MiB left, and a run needs 150; free some'):
        refuse_a_full_disk(tmp_path / 'not' / 'there', 50)

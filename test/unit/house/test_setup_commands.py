"""What runs in the environment: ./advise, make, and the proof on bare machines."""

from __future__ import annotations

import importlib
import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from support.setting_up import ROOT, run, tools

__all__ = ['tools']


# -- ./advise ---------------------------------------------------------------------------------
def test_advise_names_what_there_is() -> None:
    done = run('./advise', '--help')
    assert done.returncode == 0
    assert ' mavlink_bridge ' in done.stdout
    wrong = run('./advise', 'polcy')
    assert wrong.returncode == 2
    assert wrong.stderr.startswith("error: 'polcy' is unknown; did you mean 'policy'?; known: advise ")
    assert run('./advise').returncode == 2


def test_advise_without_set_up_says_what_to_run(tmp_path: Path) -> None:
    shutil.copy(ROOT / 'advise', tmp_path)
    done = run(str(tmp_path / 'advise'), 'policy')
    assert (done.returncode, done.stderr) == (2, f"error: the environment is not built yet; run 'make setup' in {tmp_path}\n")


def test_advise_in_a_moved_checkout_says_what_to_run(tmp_path: Path) -> None:
    shutil.copy(ROOT / 'advise', tmp_path)
    for folder in ('.venv', 'install/advise_ros/lib/advise_ros'):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / 'install' / 'stamp').touch()
    (tmp_path / '.venv' / 'environment.sh').write_text('advise_root=/home/anna/before\n')
    done = run(str(tmp_path / 'advise'), 'python')
    assert done.returncode == 2
    assert done.stderr == (
        f"error: this checkout is in {tmp_path} now and was set up in /home/anna/before; run 'make setup' here\n"
    )


def test_advise_in_a_polluted_shell_runs_its_own_python(tmp_path: Path) -> None:
    (tmp_path / 'numpy.py').write_text('raise SystemExit("polluted")')
    env = {'PYTHONPATH': str(tmp_path), 'PYTHONHOME': str(tmp_path), 'LC_ALL': 'C', 'HOME': str(tmp_path / 'none')}
    done = run('./advise', 'python', '-c', 'import numpy, sys; print(sys.stdout.encoding, "ö")', **env)
    assert (done.stdout, done.stderr) == ('utf-8 ö\n', '')


def test_advise_without_a_home_keeps_ros_logs_in_the_checkout(tmp_path: Path) -> None:
    env = {name: value for name, value in os.environ.items() if name not in ('HOME', 'ROS_LOG_DIR', 'ROS_HOME')}
    ask = ['./advise', 'python', '-c', 'import os; print(os.environ.get("ROS_LOG_DIR"))']
    for home in ({}, {'HOME': str(tmp_path / 'none')}):
        done = subprocess.run(ask, cwd=ROOT, env=env | home, text=True, capture_output=True, check=True)
        assert done.stdout == f'{ROOT}/log/ros\n'
    done = subprocess.run(ask, cwd=ROOT, env=env | {'HOME': str(tmp_path)}, text=True, capture_output=True, check=True)
    assert done.stdout == 'None\n'


def test_advise_runs_from_anywhere_through_a_link_with_arguments_as_they_are(tmp_path: Path) -> None:
    (tmp_path / 'link').symlink_to(ROOT / 'advise')
    script = 'import os, sys, advise_msgs; print(os.getcwd(), os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"], sys.argv[1:])'
    env = {name: value for name, value in os.environ.items() if name != 'ROS_AUTOMATIC_DISCOVERY_RANGE'}
    done = subprocess.run(
        [tmp_path / 'link', 'python', '-c', script, 'a b', '*'],
        cwd=tmp_path, env=env, text=True, capture_output=True, check=True,
    )
    assert done.stdout == f"{tmp_path} LOCALHOST ['a b', '*']\n"


# -- Makefile ---------------------------------------------------------------------------------
def test_options_of_the_demo_reach_it_as_they_are() -> None:
    done = run('make', '-n', 'demo', "OUT=Anna's first day", 'SEED=3')
    (line,) = [line for line in done.stdout.splitlines() if 'advise demo' in line]
    assert shlex.split(line)[:7] == ['exec', './advise', 'demo', '--seed', '3', '--out', "Anna's first day"]


# -- tools/test_bare.py -----------------------------------------------------------------------
def test_the_readme_names_what_set_up_needs_of_a_minimal_system(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / 'tools'))
    bare = importlib.import_module('test_bare')
    assert {'git', 'make', 'python3', 'python3-venv', 'build-essential'} <= set(bare.readme_packages())


def test_bare_systems_say_what_they_need_of_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / 'tools'))
    bare = importlib.import_module('test_bare')
    monkeypatch.setattr(shutil, 'which', lambda name: None)
    monkeypatch.setattr(os, 'geteuid', lambda: 1000)
    with pytest.raises(bare.RefusedError, match=r'debootstrap.*missing .apt install debootstrap.*only root can'):
        bare.look_at_the_machine()


def test_what_a_bare_system_takes_over_is_never_written_through_a_link_that_leads_out_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / 'tools'))
    bare = importlib.import_module('test_bare')
    (tmp_path / 'bundle.crt').write_text('of this machine')
    outside = tmp_path / 'precious'
    outside.write_text('of this machine too')
    system = bare.System(tmp_path / 'system', 'bookworm')
    inside = Path(f'{system.root}{tmp_path}')
    inside.mkdir(parents=True)
    (inside / 'bundle.crt').symlink_to(outside)
    system._take_over(tmp_path / 'bundle.crt')
    assert outside.read_text() == 'of this machine too'
    assert (inside / 'bundle.crt').read_text() == 'of this machine'
    (tmp_path / 'elsewhere').mkdir()
    (system.root / 'etc').symlink_to(tmp_path / 'elsewhere')
    with pytest.raises(bare.RefusedError, match='lies outside of'):
        system._take_over(Path('/etc/hosts'))

"""Set-up's own decisions: which Python, what lacks, what is out of date. The whole of it runs before these tests do."""

from __future__ import annotations

import importlib
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODULES = ('prerequisites', 'shell', 'packages', 'build', 'setup_env')


@pytest.fixture
def tools(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """The modules of tools/, imported as set-up imports them."""
    monkeypatch.syspath_prepend(str(ROOT / 'tools'))
    yield SimpleNamespace(**{name: importlib.import_module(name) for name in MODULES})
    for name in MODULES:
        sys.modules.pop(name, None)


def run(*command: str, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=ROOT, env={**os.environ, **env}, text=True, capture_output=True, check=False)


def fake_python(folder: Path, name: str, version: tuple[int, int]) -> None:
    """MOCK: an interpreter that claims a version and has nothing else."""
    path = folder / name
    path.write_text(f'#!/bin/sh\nexec {sys.executable} -c "import sys; sys.version_info = {(*version, 0)}\n$4"\n')
    path.chmod(0o755)


# -- tools/find_python.sh ---------------------------------------------------------------------
def find_python(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The script with nothing but `folder` on its path, outside of any finished set-up."""
    script = str(ROOT / 'tools' / 'find_python.sh')
    return subprocess.run(
        ['/bin/sh', script, *arguments], cwd=folder, env={'PATH': str(folder)}, text=True, capture_output=True, check=False,
    )


def test_without_python_it_says_what_to_install(tmp_path: Path) -> None:
    done = find_python(tmp_path)
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr == (
        'error: Python 3.10 to 3.13 is needed and no Python was found: sudo apt install python3 python3-venv python3-dev\n'
    )


@pytest.mark.parametrize('version', [(3, 9), (3, 14), (2, 7)])
def test_a_python_of_another_version_is_not_taken(tmp_path: Path, version: tuple[int, int]) -> None:
    fake_python(tmp_path, 'python3', version)
    assert find_python(tmp_path).returncode == 2
    named = find_python(tmp_path, str(tmp_path / 'python3'))
    assert named.returncode == 2
    assert f'PYTHON={tmp_path}/python3 is no Python 3.10 to 3.13' in named.stderr


def test_a_python_that_lacks_parts_is_taken_only_when_there_is_no_better(tmp_path: Path) -> None:
    (tmp_path / 'python3.11').write_text(f'#!/bin/sh\ncase "$4" in *ensurepip*) exit 1;; esac\nexec {sys.executable} "$@"\n')
    (tmp_path / 'python3.11').chmod(0o755)
    assert find_python(tmp_path).returncode == 0
    (tmp_path / 'python3.10').symlink_to(sys.executable)
    assert find_python(tmp_path).stdout.strip() == str(tmp_path / 'python3.10')


# -- tools/prerequisites.py -------------------------------------------------------------------
def lacking(tools: SimpleNamespace, root: Path) -> str:
    with pytest.raises(tools.prerequisites.SetupError) as caught:
        tools.prerequisites.check(root)
    assert '\n' not in str(caught.value)
    return str(caught.value)


def test_here_nothing_lacks(tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, 'disk_usage', lambda path: SimpleNamespace(free=3e9))  # Set-up has taken its share already.
    tools.prerequisites.check(ROOT)


@pytest.mark.parametrize(
    ('owner', 'name', 'value', 'sentence'),
    [
        (platform, 'machine', lambda: 'aarch64', 'this machine is Linux aarch64, and the ROS 2 wheels exist for Linux x86_64'),
        (platform, 'libc_ver', lambda: ('glibc', '2.17'), 'glibc 2.17, and glibc 2.28 or newer is needed; use Debian 12'),
        (platform, 'libc_ver', lambda: ('', ''), 'the C library here is not glibc'),
        (importlib.util, 'find_spec', lambda name: None, "has no 'venv' module: sudo apt install python3."),
        (shutil, 'which', lambda name: None, "no C and C++ compiler was found ('cc' is not there): sudo apt install"),
        (shutil, 'disk_usage', lambda path: SimpleNamespace(free=1e9), 'has 1.0 GB left, and set-up takes up to 2.5 GB'),
    ],
)
def test_what_lacks_is_told_with_its_remedy(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, value: Any, sentence: str,
) -> None:
    monkeypatch.delenv('CC', raising=False)
    monkeypatch.setattr(owner, name, value)
    assert sentence in lacking(tools, ROOT)


@pytest.mark.parametrize(
    ('output', 'sentence'),
    [
        ('Caused by: dns error: failed to lookup address', 'check the network'),
        ('NewConnectionError: Failed to establish a new connection: [Errno 101]', 'check the network'),
        ('ERROR: No matching distribution found for ros-rcl==9.2.8', 'check the network (and the proxy or index settings'),
        ('OSError: [Errno 28] No space left on device', 'the disk is full'),
        ('error: Hash mismatch for numpy', 'not the one that requirements/lock.txt names'),
        ('fatal error: Python.h: No such file or directory', 'header files of Python'),
    ],
)
def test_failures_of_known_causes_are_one_sentence(tools: SimpleNamespace, output: str, sentence: str) -> None:
    assert sentence in tools.prerequisites.reason(output)


def test_an_unknown_failure_is_not_guessed_at(tools: SimpleNamespace) -> None:
    assert tools.prerequisites.reason('Segmentation fault') is None


# -- tools/setup_env.py -----------------------------------------------------------------------
def test_another_ros_is_refused_by_name(tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, 'which', lambda name: f'/opt/ros/bin/{name}')
    monkeypatch.setenv('ROS_DISTRO', 'humble')
    with pytest.raises(tools.prerequisites.SetupError, match="ROS 2 'humble' is sourced, and this project runs on Jazzy"):
        tools.setup_env.sourced_ros()
    monkeypatch.setenv('ROS_DISTRO', 'jazzy')
    assert tools.setup_env.sourced_ros()
    monkeypatch.delenv('ROS_DISTRO')
    assert not tools.setup_env.sourced_ros()


def test_a_stamp_vouches_for_finished_work_only(tools: SimpleNamespace, tmp_path: Path) -> None:
    stamp = tmp_path / 'stamp'
    tools.setup_env.renew(stamp, 'one', lambda: None)
    assert tools.setup_env.stamped(stamp, 'one')
    assert not tools.setup_env.stamped(stamp, 'two')

    def interrupted() -> None:
        assert not stamp.exists()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tools.setup_env.renew(stamp, 'two', interrupted)
    assert not tools.setup_env.stamped(stamp, 'one')
    assert not tools.setup_env.stamped(stamp, 'two')


def test_a_build_is_out_of_date_when_what_colcon_reads_has_changed(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:
    for name in ('msg_defs', 'config', 'launch'):
        shutil.copytree(ROOT / name, tmp_path / name)
    for name in ('package.xml', 'setup.py', 'setup.cfg', 'colcon_defaults.yaml'):
        shutil.copy(ROOT / name, tmp_path)
    monkeypatch.setattr(tools.setup_env, 'ROOT', tmp_path)
    digests = [tools.setup_env.build_digest('e')]

    def changed() -> bool:
        digests.append(tools.setup_env.build_digest('e'))
        return digests[-1] != digests[-2]

    assert not changed()
    (tmp_path / 'config' / 'advise.yaml').write_text('{}')  # Linked into install/: an edit needs no build ...
    assert not changed()
    (tmp_path / 'config' / 'new.yaml').write_text('{}')  # ... but a new file has to be linked.
    assert changed()
    (tmp_path / 'msg_defs' / 'msg' / 'Policy.msg').write_text('uint32 version\n')
    assert changed()
    (tmp_path / 'setup.py').write_text('')
    assert changed()


def test_wheels_name_this_python_and_the_files_of_a_cache_stay_as_they_are(tools: SimpleNamespace, tmp_path: Path) -> None:
    cached, share = tmp_path / 'cached.cmake', tmp_path / 'venv' / 'share'
    builder = '/opt/python/cp311-cp311'
    cached.write_text(f'"{builder}/include/python3.11;{builder}/lib/python3.11/site-packages/numpy/_core/include;/usr/include"')
    share.mkdir(parents=True)
    (share / 'a.cmake').hardlink_to(cached)
    shell = SimpleNamespace(run=lambda *ignored: '/here/include\n/here/numpy\n')
    tools.packages._name_this_python(shell, tmp_path / 'venv')
    assert (share / 'a.cmake').read_text() == '"/here/include;/here/numpy;/usr/include"'
    assert builder in cached.read_text()


def test_lock_files_name_no_index_and_hash_every_package(tools: SimpleNamespace) -> None:
    for name in ('lock.txt', 'system-lock.txt', 'bootstrap-lock.txt'):
        text = (ROOT / 'requirements' / name).read_text()
        assert '://' not in text
        requirements = [block for block in text.split('\n') if block[:1].isalnum()]
        assert requirements
        assert all('==' in line and line.endswith('\\') for line in requirements)


# -- ./advise ---------------------------------------------------------------------------------
def test_advise_names_what_there_is() -> None:
    done = run('./advise', '--help')
    assert done.returncode == 0
    assert ' mavlink_bridge ' in done.stdout
    wrong = run('./advise', 'polcy')
    assert wrong.returncode == 2
    assert wrong.stderr.startswith("error: 'polcy' is unknown; known: advise ")
    assert run('./advise').returncode == 2


def test_advise_without_set_up_says_what_to_run(tmp_path: Path) -> None:
    shutil.copy(ROOT / 'advise', tmp_path)
    done = run(str(tmp_path / 'advise'), 'policy')
    assert (done.returncode, done.stderr) == (2, f"error: the environment is not built yet; run 'make setup' in {tmp_path}\n")


def test_advise_runs_from_anywhere_through_a_link_with_arguments_as_they_are(tmp_path: Path) -> None:
    (tmp_path / 'link').symlink_to(ROOT / 'advise')
    script = 'import os, sys, advise_msgs; print(os.getcwd(), os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"], sys.argv[1:])'
    env = {name: value for name, value in os.environ.items() if name != 'ROS_AUTOMATIC_DISCOVERY_RANGE'}
    done = subprocess.run(
        [tmp_path / 'link', 'python', '-c', script, 'a b', '*'],
        cwd=tmp_path, env=env, text=True, capture_output=True, check=True,
    )
    assert done.stdout == f"{tmp_path} LOCALHOST ['a b', '*']\n"

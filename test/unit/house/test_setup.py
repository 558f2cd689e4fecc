"""What set-up needs of a machine: which Python, what is missing, in one sentence with its remedy."""

from __future__ import annotations

import importlib
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from support.setting_up import ROOT, command, tools

__all__ = ['tools']


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


def test_without_python_it_says_all_that_is_to_be_installed(tmp_path: Path) -> None:
    done = find_python(tmp_path)
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr == (
        'error: set-up needs Python 3.10 to 3.13 and a C and C++ compiler, and there is no Python here: '
        'sudo apt install python3 python3-venv build-essential\n'
    )
    for name in ('cc', 'c++'):
        command(tmp_path, name, 'exit 0')
    command(tmp_path, 'id', 'echo 0')  # Root needs no sudo, and a minimal system has none.
    assert find_python(tmp_path).stderr.endswith('no Python here: apt install python3 python3-venv\n')


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
        (importlib.util, 'find_spec', lambda name: None, "set-up needs the 'venv' module of Python 3."),
        (shutil, 'which', lambda name: None, "a C and C++ compiler ('cc' and 'c++' not there)"),
        (shutil, 'disk_usage', lambda path: SimpleNamespace(free=1e9), 'has 1.0 GB left, and set-up takes up to 2.5 GB'),
    ],
)
def test_what_lacks_is_told_with_its_remedy(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, value: Any, sentence: str,
) -> None:
    monkeypatch.delenv('CC', raising=False)
    monkeypatch.delenv('CXX', raising=False)
    monkeypatch.setattr(owner, name, value)
    assert sentence in lacking(tools, ROOT)


def test_all_that_lacks_is_said_at_once_with_one_line_to_install_it(
    tools: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:
    for variable in ('CC', 'CXX'):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(importlib.util, 'find_spec', lambda name: None)
    monkeypatch.setattr(shutil, 'which', lambda name: None)
    monkeypatch.setattr(sysconfig, 'get_paths', lambda: {'include': str(tmp_path)})
    monkeypatch.setattr(shutil, 'disk_usage', lambda path: SimpleNamespace(free=1e9))
    monkeypatch.setattr(os, 'geteuid', lambda: 1000)
    number = f'{sys.version_info.major}.{sys.version_info.minor}'
    said = lacking(tools, ROOT)
    assert '1.0 GB left' in said
    assert said.endswith(f': sudo apt install python{number}-venv build-essential python{number}-dev')
    monkeypatch.setattr(os, 'geteuid', lambda: 0)
    assert ': apt install ' in lacking(tools, ROOT)


@pytest.mark.parametrize('path', ["/home/Anna's", '/data/a:b', '/data/a;b', '/data/a,b', '/home/jörg', '/data/$HOME', '/a#'])
def test_a_path_that_build_tools_misread_is_refused_with_the_letter(tools: SimpleNamespace, path: str) -> None:
    (missing,) = tools.prerequisites._path(Path(path))
    assert f'the path {path!r} holds ' in missing.what
    assert 'move the checkout to a path of ASCII letters' in missing.what


@pytest.mark.parametrize('path', ['/home/anna/my drones', '/data/a-b_c.d/100'])
def test_a_path_with_spaces_will_do(tools: SimpleNamespace, path: str) -> None:
    assert tools.prerequisites._path(Path(path)) == []


@pytest.mark.parametrize(
    ('output', 'sentence'),
    [
        ('Caused by: dns error: failed to lookup address', 'check the network'),
        ('NewConnectionError: Failed to establish a new connection: [Errno 101]', 'check the network'),
        ('ERROR: No matching distribution found for ros-rcl==9.2.8', 'check the network (and the proxy or index settings'),
        ('SSLError(SSLCertVerificationError(1, "[SSL: CERTIFICATE_VERIFY_FAILED] certificate verify failed', 'PIP_CERT=FILE'),
        ('OSError: [Errno 28] No space left on device', 'the disk is full'),
        ('error: Hash mismatch for numpy', 'not the one that requirements/lock.txt names'),
        ('fatal error: Python.h: No such file or directory', 'header files of Python'),
    ],
)
def test_failures_of_known_causes_are_one_sentence(tools: SimpleNamespace, output: str, sentence: str) -> None:
    assert sentence in tools.prerequisites.reason(output)


def test_an_unknown_failure_is_not_guessed_at(tools: SimpleNamespace) -> None:
    assert tools.prerequisites.reason('Segmentation fault') is None

"""Ctrl-C or SIGTERM at any moment of an executable's life: while its libraries are read, and in it."""

from __future__ import annotations

import signal
import subprocess
import sys
from importlib.metadata import distribution
from importlib.util import find_spec
from pathlib import Path

import pytest

from advise_ros.missing_packages import MODULES as NEEDED
from advise_ros.missing_packages import remedy
from support.paths import ROOT

# Not signal.pause(): a signal that comes right before it would be waited for in vain.
WAIT = "import itertools, time; print('here', flush=True); [time.sleep(0.05) for _ in itertools.count()]"
MODULES = {
    'slow_to_read': f'{WAIT}\ndef main():\n    raise AssertionError',
    'at_work': f'def main():\n    {WAIT}',
}


@pytest.mark.parametrize('module', MODULES)
@pytest.mark.parametrize(('number', 'code'), [(signal.SIGINT, 0), (signal.SIGTERM, 130)])
def test_an_interruption_is_no_traceback(module: str, number: signal.Signals, code: int, tmp_path: Path) -> None:
    (tmp_path / 'package').mkdir()
    for name, text in MODULES.items():
        (tmp_path / 'package' / f'{name}.py').write_text(text)
    start = f"import sys; sys.path[:0] = [{str(ROOT)!r}]; from advise_ros.front import Front; Front('package', {code}).{module}()"
    with subprocess.Popen([sys.executable, '-c', start], cwd=tmp_path, stdout=-1, stderr=-1, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == 'here\n'
        process.send_signal(number)
        try:
            _, said = process.communicate(timeout=60)
        finally:
            process.kill()
    assert (process.returncode, said) == (code, '')


def test_a_second_interruption_on_the_way_out_changes_nothing(tmp_path: Path) -> None:
    """A terminal and `ros2 launch` both send one; Python has no handler any more when it takes its modules apart."""
    (tmp_path / 'package').mkdir()
    (tmp_path / 'package' / 'last.py').write_text(
        'import os, signal\n'
        'class Last:\n'
        '    def __del__(self, kill=os.kill, pid=os.getpid(), number=signal.SIGINT):\n'
        '        kill(pid, number)\n'
        'kept = Last()\n'
        'def main():\n'
        '    pass\n'
    )
    start = f"import sys; sys.path[:0] = [{str(ROOT)!r}]; from advise_ros.front import Front; Front('package', 0).last()"
    done = subprocess.run([sys.executable, '-c', start], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, '')


def test_every_executable_begins_there() -> None:
    begun = {point.name: point.value for point in distribution('advise_ros').entry_points if point.group == 'console_scripts'}
    assert begun['policy'] == 'advise_ros.front:nodes.policy'
    assert {value.rpartition('.')[0] for value in begun.values()} == {'advise_ros.front:nodes', 'advise_ros.front:commands'}


def test_missing_packages_are_named_all_at_once_with_the_line_that_installs_them(tmp_path: Path) -> None:
    (tmp_path / 'package').mkdir()
    (tmp_path / 'package' / 'node.py').write_text('import highspy.deep\n')
    # As in a workspace without them: this Python sees the standard library and this package alone.
    start = f"import sys; sys.path[:0] = [{str(ROOT)!r}]; from advise_ros.front import Front; Front('package', 0).node()"
    done = subprocess.run([sys.executable, '-S', '-c', start], cwd=tmp_path, capture_output=True, text=True, check=False, env={})
    assert (done.returncode, done.stdout) == (2, '')
    assert 'Traceback' not in done.stderr
    assert 'lacks babel, clarabel, ' in done.stderr
    assert f'--require-hashes -r {ROOT}/requirements/system-lock.txt' in done.stderr


def test_a_module_of_ros_and_one_of_our_own_are_not_taken_for_a_package() -> None:
    assert 'source ROS 2 Jazzy' in str(remedy('rclpy.node'))
    assert remedy('advise_ros.nodes.nonsense') is None


def test_each_package_that_is_asked_for_has_its_module_named() -> None:
    wanted = {line for line in (ROOT / 'requirements' / 'app.in').read_text().split('\n') if line and not line.startswith('#')}
    assert set(NEEDED.values()) == wanted
    assert [name for name in NEEDED if find_spec(name) is None] == []

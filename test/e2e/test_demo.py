"""The demo as a newcomer runs it: the whole story, an interruption, a node that dies, wrong usage."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from support.demo_site import SMALL_SITE
from support.processes import executable, living_in_domain

PATIENCE_S = 600.0
SHORT = (*SMALL_SITE, '--flights', '2', '--answers', '2')


def pid_in_domain(domain: str, command: str) -> int:
    (found,) = [number for number, line in living_in_domain(domain).items() if command in line]
    return found


def wait_until(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, f'waited in vain for {what}'
        time.sleep(0.05)


def wait_for_pilot(demo: subprocess.Popen[str], out: Path) -> None:
    """Until the whole graph runs."""
    log = out / 'logs' / 'pilot.log'
    wait_until(lambda: log.exists() or demo.poll() is not None, 'the pilot')
    assert log.exists(), demo.communicate()


def start(env: dict[str, str], out: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [executable('demo'), '--out', str(out), *arguments], env=env, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )


def run(env: dict[str, str], out: Path, *arguments: str) -> tuple[int, str, str]:
    demo = start(env, out, *arguments)
    stdout, stderr = demo.communicate(timeout=PATIENCE_S)
    return demo.returncode, stdout, stderr


@pytest.mark.timeout(900)
def test_the_story_from_rough_flights_to_a_replayed_bag(ros_env: dict[str, str], tmp_path: Path) -> None:
    code, stdout, stderr = run(ros_env, tmp_path / 'out', *SHORT)
    assert code == 0, stdout + stderr
    assert '2 rough demonstrations flown and recorded' in stdout
    assert 'with advice: reached the end, round the garden' in stdout
    assert 'another route, no new lesson: reached the end, round the garden' in stdout
    assert 'equal byte for byte' in stdout
    page = (tmp_path / 'out' / 'report.html').read_text()
    asked = page.count('(simulated-expert)')
    assert page.count('<svg') == 2 + asked, 'the site, the policies and what was shown of each question'
    assert re.search(r'<td>garden</td><td class="n bad">entered</td>', page), 'the planner does not know of it'
    assert not living_in_domain(ros_env['ROS_DOMAIN_ID'])
    verdict = tmp_path / 'verdict.json'
    command = [executable('replay'), str(tmp_path / 'out' / 'bag'), '--json', str(verdict)]
    replay = subprocess.run(command, env=ros_env, check=False, capture_output=True)
    assert replay.returncode == 0
    assert json.loads(verdict.read_text())


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGKILL])
def test_nothing_is_left_behind(ros_env: dict[str, str], tmp_path: Path, number: signal.Signals) -> None:
    demo = start(ros_env, tmp_path / 'out', *SHORT)
    wait_for_pilot(demo, tmp_path / 'out')
    if number == signal.SIGINT:
        os.killpg(demo.pid, number)  # As a terminal does by Ctrl-C.
    else:
        demo.kill()
    _, stderr = demo.communicate(timeout=PATIENCE_S)
    if number == signal.SIGINT:
        assert demo.returncode == 130
        assert stderr == 'stopped; every process of the demo has ended\n'
    wait_until(lambda: not living_in_domain(ros_env['ROS_DOMAIN_ID']), 'the end of all children')


def test_the_death_of_a_node_is_reported_with_its_last_lines(ros_env: dict[str, str], tmp_path: Path) -> None:
    demo = start(ros_env, tmp_path / 'out', *SHORT)
    wait_for_pilot(demo, tmp_path / 'out')
    os.kill(pid_in_domain(ros_env['ROS_DOMAIN_ID'], 'lib/advise_ros/recorder'), signal.SIGKILL)
    _, stderr = demo.communicate(timeout=PATIENCE_S)
    assert demo.returncode == 1
    assert 'recorder was killed by SIGKILL; its last lines' in stderr
    assert not living_in_domain(ros_env['ROS_DOMAIN_ID'])


@pytest.mark.parametrize(
    ('arguments', 'said'),
    [
        (('--flights', '0'), '--flights is 0; it must be 1 or more'),
        (('--speedup', '1e9'), '--speedup is 1000000000.0; it must be 0.1 to 100'),
        (('--grid', 'nowhere.yaml'), 'nowhere.yaml'),
        (('--params-file', 'nowhere.yaml'), 'nowhere.yaml cannot be read'),
    ],
)
def test_wrong_usage_is_one_sentence(
    ros_env: dict[str, str], tmp_path: Path, arguments: tuple[str, ...], said: str,
) -> None:
    code, _, stderr = run(ros_env, tmp_path / 'out', *arguments)
    assert code == 2
    assert said in stderr
    assert len(stderr.strip().splitlines()) == 1

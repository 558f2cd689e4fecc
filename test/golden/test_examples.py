"""The examples run as they stand, and say what they promise; those that fly in test/ros/test_client_examples.py."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import ROOT

EXAMPLES = ROOT / 'examples'


def run(example: str, *arguments: str) -> str:
    command = [sys.executable, str(EXAMPLES / example), *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_flight_is_recorded_from_samples() -> None:
    assert run('record_flight.py').splitlines()[1:] == [f'in cell ({x}, 0) go EAST' for x in range(5)]


def test_a_bag_is_read() -> None:
    assert re.findall(r'^flight-\d+: (\d+) moves', run('read_bag.py'), re.MULTILINE) == ['22', '32', '34', '24', '36']


def test_a_policy_is_learnt_from_a_file(tmp_path: Path) -> None:
    demonstrations = str(tmp_path / 'demos.json')
    made = ['discretise', 'bags/arducopter_five_flights', '--grid', 'config/grid_6x6.yaml', '--out', demonstrations]
    subprocess.run([ROOT / 'advise', *made], cwd=ROOT, check=True, capture_output=True)
    said = run('learn_from_file.py', demonstrations)
    assert len(re.findall(r'^   (?:[<>v^] ?){6}$', said, re.MULTILINE)) == 4 * 6
    assert re.search(r'^Flying to waypoint \d: .*\?', said, re.MULTILINE)


def test_answers_bring_the_policy_to_the_last_waypoint() -> None:
    reached = re.findall(r'the policy reaches (\d) of 4 waypoints', run('ask_and_answer.py'))
    assert reached[0] < '4' and reached[-1] == '4'


def test_a_session_replays_in_pytest(tmp_path: Path) -> None:
    shutil.copytree(ROOT / 'bags' / 'arducopter_session', tmp_path / 'arducopter_session')
    command = [sys.executable, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', str(EXAMPLES / 'test_replay.py')]
    done = subprocess.run([*command, '--advise-bags', str(tmp_path)], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert '2 passed' in done.stdout, done.stdout


def test_a_domain_of_ones_own_is_learnt() -> None:
    said = run('own_domain.py')
    assert re.search(r'^clustered: goal reached in .*100 % after', said, re.MULTILINE)


def test_an_acquisition_of_ones_own_asks_otherwise() -> None:
    usual, own = (line.partition(': ')[2] for line in run('own_acquisition.py').splitlines())
    assert '?' in usual and '?' in own and usual != own


@pytest.mark.parametrize('example', sorted(path.name for path in EXAMPLES.glob('*.py')))
def test_the_page_lists_each_example_and_each_is_short(example: str) -> None:
    assert f'examples/{example}' in (EXAMPLES / 'README.md').read_text(encoding='utf-8')
    assert len((EXAMPLES / example).read_text(encoding='utf-8').splitlines()) <= 45

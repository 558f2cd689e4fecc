"""The promises of docs/safety.md in their short form, as `make promises` runs the long one."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import ROOT

# What fails is found by what never comes; how fast it is on a quiet machine is what `make promises` tells.
SLACK_S = '5'


@pytest.mark.timeout(900)  # Two minutes on a quiet machine.
def test_the_vehicle_stands_whatever_fails(tmp_path: Path) -> None:
    ledger = tmp_path / 'ledger.json'
    command = [sys.executable, str(ROOT / 'tools' / 'promises.py'), '--short', '--slack', SLACK_S, '--json', str(ledger)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = json.loads(ledger.read_text())
    assert {row['promise'] for row in rows} >= {
        'zero velocity', 'the vehicle stands', 'the flight goes on', 'recovery', 'control goes on', 'the fence', 'answers',
    }
    assert all(row['trials'] > 0 and row['kept'] for row in rows)

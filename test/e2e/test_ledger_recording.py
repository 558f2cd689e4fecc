"""The short form of `make ledger-recording`."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[2] / 'tools' / 'ledger_recording.py'


TROUBLES = ('logger killed', 'their writer killed', 'full disk', 'file cut off', 'one bit flipped', 'malformed bags')


@pytest.mark.timeout(600)
def test_recordings_survive_what_they_promise(tmp_path: Path) -> None:
    ledger = tmp_path / 'ledger.json'
    done = subprocess.run(
        [sys.executable, str(TOOL), '--short', '--json', str(ledger)], capture_output=True, text=True, timeout=580, check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    rows = json.loads(ledger.read_text())
    assert all(any(row['trouble'].startswith(trouble) for row in rows) for trouble in TROUBLES)
    assert all(row['kept'] and row['trials'] > 0 for row in rows)
    assert done.stdout.splitlines()[-1].startswith(f'recording ledger: all {len(rows)} kept; ')

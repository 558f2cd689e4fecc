"""The short form of `make ledger-recording`."""

import json
import subprocess
import sys
from pathlib import Path

TOOL = Path(__file__).parents[2] / 'tools' / 'ledger_recording.py'


def test_recordings_survive_what_they_promise(tmp_path: Path) -> None:
    ledger = tmp_path / 'ledger.json'
    done = subprocess.run(
        [sys.executable, str(TOOL), '--short', '--json', str(ledger)], capture_output=True, text=True, timeout=250, check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    rows = json.loads(ledger.read_text())
    assert len(rows) == 5 and all(row['kept'] and row['trials'] > 0 for row in rows)
    assert done.stdout.splitlines()[-1].startswith('recording ledger: all 5 kept; ')

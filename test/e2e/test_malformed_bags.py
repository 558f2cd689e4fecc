"""Whatever is wrong with a bag, replay and discretise say so in one sentence, or replay what is whole."""

from pathlib import Path

import numpy as np
import pytest

from advise_ros.replay import learning
from support.recordings.verdicts import verdicts

TRIALS = 24


def test_every_malformed_bag_gets_a_clear_verdict_in_little_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The long form is in `make ledger-recording`."""
    monkeypatch.setattr(learning, 'learn', learning.learn)  # Put back what the trials replace.
    for row in verdicts(tmp_path, np.random.default_rng(0), TRIALS):
        assert row.kept, row

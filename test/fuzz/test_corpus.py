"""Every input that fuzzing kept is replayed; inputs that once broke a promise are among them."""

from __future__ import annotations

from pathlib import Path

import pytest

from fuzz.targets import TARGETS

CORPUS = Path(__file__).parent / 'corpus'


@pytest.mark.parametrize('name', sorted(TARGETS))
def test_what_fuzzing_found_breaks_no_promise(name: str) -> None:
    inputs = sorted((CORPUS / name).iterdir())
    assert len(inputs) >= 10
    for path in inputs:
        TARGETS[name](path.read_bytes())

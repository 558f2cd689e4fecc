"""--help of every executable: an example to copy, and what to do after it."""

from __future__ import annotations

import re
import sys
from importlib import import_module
from importlib.metadata import distribution

import pytest

EXECUTABLES = {
    point.name: point.value.removeprefix('advise_ros.front:')
    for point in distribution('advise_ros').entry_points if point.group == 'console_scripts'
}


@pytest.mark.parametrize('name', EXECUTABLES)
def test_it_has_an_example_and_a_next_step(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr('sys.argv', [name, '--help'])
    monkeypatch.setattr('os._exit', sys.exit)  # Some leave without waiting for the middleware's threads.
    with pytest.raises(SystemExit) as left:
        import_module(f'advise_ros.{EXECUTABLES[name]}').main()
    said = capsys.readouterr().out
    assert not left.value.code
    assert re.search(rf'(?im)^ *examples?\b.*(\n.*)?(ros2 run advise_ros|\./advise) {name}\b', said), said
    assert re.search(r'(?m)^ *Next: \S', said), said

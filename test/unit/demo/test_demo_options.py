"""Options of the demo: each mistake is one sentence, before anything starts."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from advise_ros.commands import demo
from advise_ros.core.errors import InputError
from advise_ros.demo.console import DemoConsole
from advise_ros.demo.options import node_parameters, share


@pytest.mark.parametrize(
    ('arguments', 'expected'),
    [
        (['--seed', '-1'], '--seed is -1; it must be 0 to'),
        (['--flights', '0'], '--flights is 0; it must be 1 or more'),
        (['--speedup', 'nan'], '--speedup is nan; it must be 0.1 to 100'),
        (['--out', '{tmp}/file'], 'is a file; name a new directory by --out'),
        (['--out', '{tmp}'], 'holds something already'),
    ],
)
def test_wrong_options_are_refused(arguments: list[str], expected: str, tmp_path: Path) -> None:
    (tmp_path / 'file').touch()
    with pytest.raises(InputError, match=re.escape(expected)):
        demo.parse([argument.format(tmp=tmp_path) for argument in arguments])


def test_a_directory_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / 'file').touch()
    options = demo.parse(['--out', str(tmp_path / 'file' / 'results')])
    with pytest.raises(InputError, match=r'results cannot be made \(Not a directory\)'):
        demo.run(options, DemoConsole())


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('a: [1', 'it is not a YAML file'),
        ('hello', 'not made of nodes with ros__parameters'),
        ('advise: 3', 'not made of nodes with ros__parameters'),
        ('advise: {gamma: 0.5}', 'not made of nodes with ros__parameters'),
    ],
)
def test_what_is_no_parameter_file_is_refused(text: str, expected: str, tmp_path: Path) -> None:
    file = tmp_path / 'params.yaml'
    file.write_text(text)
    with pytest.raises(InputError, match=re.escape(expected)):
        node_parameters(file, 'advise')


def test_the_demos_own_parameter_file_is_read() -> None:
    assert node_parameters(share('demo.yaml'), 'simulator')['ready_after_s'] > 0

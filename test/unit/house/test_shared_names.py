"""What the whole package shares is defined in one place, and a class name means one thing."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

import pytest

from advise_ros.core import units

PACKAGE = Path(units.__file__).parents[1]
# Names that two classes still have; none is to come in.
SHARED = {'Layout', 'Learned', 'Problem'}


def defined(path: Path) -> set[str]:
    """Names that a module binds at its top level by an assignment."""
    names: set[str] = set()
    for node in ast.parse(path.read_text(encoding='utf-8')).body:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        names |= {name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)}
    return names


@pytest.mark.parametrize('name', ['NS', 'Vector', 'ZERO', 'MAP_FRAME'])
def test_units_and_the_frame_are_defined_once(name: str) -> None:
    assert [path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob('*.py') if name in defined(path)] == ['core/units.py']


def test_a_class_name_is_given_once() -> None:
    classes = Counter(
        node.name for path in PACKAGE.rglob('*.py') for node in ast.walk(ast.parse(path.read_text(encoding='utf-8')))
        if isinstance(node, ast.ClassDef)
    )
    assert {name for name, count in classes.items() if count > 1} <= SHARED

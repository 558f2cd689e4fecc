"""Public functions say what their arguments are, and what they raise: counted, so that the share does not fall.

    PYTHONPATH=test ./advise python test/unit/house/test_docstrings.py     # the share of each folder, and what lacks it
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from support.paths import ROOT

PACKAGE = ROOT / 'advise_ros'
# Arrays, and what has a unit.
QUANTITY = re.compile(r'Floats|Ints|Bools|Array|Integers|Stamps|Vector|float|_ns\b')
# Shares in per cent below which nothing may fall.
LEAST_ARGS, LEAST_RAISES = 75, 85


class Public(NamedTuple):
    """A public function or method with a docstring."""

    place: str
    folder: str
    doc: str
    arguments: str
    raises: bool


def functions() -> Iterator[Public]:
    """Those of the package; what a name with an underscore hides is not public."""
    for path in sorted(PACKAGE.rglob('*.py')):
        relative = path.relative_to(PACKAGE)
        folder = '/'.join(relative.parts[:2] if relative.parts[0] == 'core' else relative.parts[:1])
        yield from _inside(ast.parse(path.read_text(encoding='utf-8')), relative.as_posix(), folder)


def _inside(parent: ast.Module | ast.ClassDef, place: str, folder: str) -> Iterator[Public]:
    for node in parent.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith('_'):
            yield from _inside(node, f'{place} {node.name}', folder)
        elif isinstance(node, ast.FunctionDef) and not node.name.startswith('_'):
            doc = ast.get_docstring(node)
            if doc is not None:  # Without one, the base class or the protocol has it.
                raises = any(isinstance(inner, ast.Raise) and inner.exc is not None for inner in ast.walk(node))
                yield Public(f'{place} {node.name}', folder, doc, ast.unparse(node.args), raises)


def shares() -> tuple[float, float]:
    """Per cent of those with quantities that have Args, and of those that raise that have Raises."""
    quantities = [one for one in functions() if QUANTITY.search(one.arguments)]
    raising = [one for one in functions() if one.raises]
    return _percent('Args:', quantities), _percent('Raises:', raising)


def _percent(word: str, chosen: list[Public]) -> float:
    return 100 * sum(word in one.doc for one in chosen) / len(chosen)


def test_functions_with_arrays_or_quantities_say_shapes_and_units() -> None:
    assert shares()[0] >= LEAST_ARGS


def test_functions_that_raise_say_so() -> None:
    assert shares()[1] >= LEAST_RAISES


def main() -> None:
    """Print what is counted."""
    found = [one for one in functions() if QUANTITY.search(one.arguments)]
    of, having = Counter(one.folder for one in found), Counter(one.folder for one in found if 'Args:' in one.doc)
    print('\n'.join(f'{folder}: {having[folder]} of {count}' for folder, count in sorted(of.items())))
    print('Args: {:.0f} %, Raises: {:.0f} %'.format(*shares()))
    print('\n'.join(f'without Args: {one.place}' for one in found if 'Args:' not in one.doc))


if __name__ == '__main__':
    main()

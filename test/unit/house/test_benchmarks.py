"""Benchmarks are run by hand: what they import has to be where they look for it."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path

import pytest

from support.paths import ROOT

BENCHMARKS = sorted((ROOT / 'benchmarks').glob('*.py'))


@pytest.mark.parametrize('path', BENCHMARKS, ids=lambda path: path.stem)
def test_what_a_benchmark_imports_is_there(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(path.parent))
    statements = [
        node for node in ast.walk(ast.parse(path.read_text(encoding='utf-8')))
        if isinstance(node, ast.ImportFrom) and node.module and node.module != '__future__'
    ]
    assert statements
    missing = [
        f'{node.module}.{name.name}' for node in statements for name in node.names
        if not hasattr(importlib.import_module(node.module), name.name) and not _is_module(f'{node.module}.{name.name}')
    ]
    assert not missing


def _is_module(name: str) -> bool:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError:
        return False
    return True

"""A digest of Python source that comments, docstrings and blank lines do not change, in any version of Python."""

from __future__ import annotations

import ast
import hashlib
import io
import tokenize
from pathlib import Path

DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
DIGITS = 16


def of_directory(directory: Path) -> str:
    """DIGITS hexadecimal digits for the code of all modules below a directory and their paths in it."""
    found = hashlib.sha256()
    for file in sorted(directory.rglob('*.py')):
        found.update(file.relative_to(directory).as_posix().encode() + b'\0' + code(file.read_text(encoding='utf-8')).encode())
    return found.hexdigest()[:DIGITS]


def code(source: str) -> str:
    """The lines of a module that do something, without the comments at their ends."""
    lines = source.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            text = node.body[0]
            lines[text.lineno - 1 : text.end_lineno] = [''] * ((text.end_lineno or text.lineno) - text.lineno + 1)
    return '\n'.join(line.rstrip() for line in lines if line.strip())

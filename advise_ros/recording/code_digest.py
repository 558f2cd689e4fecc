"""A digest of code without its comments: the same for all sources that do the same."""

from __future__ import annotations

import ast
import hashlib
import io
import tokenize
from functools import cache
from pathlib import Path

from advise_ros.recording import kept_digest

CORE = Path(__file__).parents[1] / 'core'
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
DIGITS = 16


@cache
def core_digest() -> str:
    """The digest of core/'s code: the kept one, unless its sources are others than those that it was made of.

    To make it takes longer than all else at a node's start.
    """
    return kept_digest.DIGEST if hash_of_sources(CORE) == kept_digest.SOURCES else digest_of_code(CORE)


def hash_of_sources(directory: Path) -> str:
    """Hash of all modules below a directory, byte for byte, and of their paths in it."""
    found = hashlib.sha256()
    for file in sorted(directory.rglob('*.py')):
        source = file.read_bytes()
        found.update(f'{file.relative_to(directory).as_posix()}\0{len(source)}\0'.encode() + source)
    return found.hexdigest()


def digest_of_code(directory: Path) -> str:
    """DIGITS hexadecimal digits for the code of all modules below a directory and their paths in it."""
    found = hashlib.sha256()
    for file in sorted(directory.rglob('*.py')):
        found.update(file.relative_to(directory).as_posix().encode() + b'\0' + _code(file.read_text(encoding='utf-8')).encode())
    return found.hexdigest()[:DIGITS]


def _code(source: str) -> str:
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

"""The page of the tables: they stand between markers, and the text around them is a person's."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from advise_ros.core.errors import InputError

BEGIN, END = '<!-- table: {} -->', '<!-- end of table -->'


def filled(page: str, tables: Mapping[str, str]) -> str:
    """A page with these tables in place of what stood between their markers; those without markers come last."""
    for name, table in tables.items():
        block = f'{BEGIN.format(name)}\n\n{table}\n\n{END}'
        there = re.search(f'{re.escape(BEGIN.format(name))}.*?{re.escape(END)}', page, re.DOTALL)
        page = f'{page[: there.start()]}{block}{page[there.end() :]}' if there else f'{page}\n{block}\n'
    return page


def write_page(path: Path, title: str, tables: Mapping[str, str]) -> None:
    """Renew the tables of a page, or begin one.

    Raises:
        InputError: it cannot be read or written.
    """
    try:
        page = path.read_text(encoding='utf-8') if path.exists() else f'# {title}\n'
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(filled(page, tables), encoding='utf-8')
    except (OSError, UnicodeDecodeError) as problem:
        reason = getattr(problem, 'strerror', None) or 'it is no text in UTF-8'
        raise InputError(f'{path} cannot be written ({reason}); name another page') from problem

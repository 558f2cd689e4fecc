"""Documents name files, pictures, headings and executables that exist."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.paths import ROOT

DOCUMENTS = [
    ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', ROOT / 'bags' / 'README.md', ROOT / 'examples' / 'README.md',
    *sorted((ROOT / 'docs').rglob('*.md')),
]
EXECUTABLES = {
    'python', *(path.stem for folder in ('nodes', 'commands') for path in (ROOT / 'advise_ros' / folder).glob('*.py')),
}
FENCED = re.compile(r'^```.*?^```', re.MULTILINE | re.DOTALL)
# [text](target), [text](target "title"), ![picture](target); the text may hold brackets in code.
LINK = re.compile(r'\]\(([^)\s]+)(?:\s+"[^"]*")?\)')
HEADING = re.compile(r'^#+ +(.+?) *$', re.MULTILINE)


def anchors(document: Path) -> Iterator[str]:
    """The anchors that GitHub makes of a document's headings: lower case, no punctuation, hyphens for blanks."""
    seen: dict[str, int] = {}
    for heading in HEADING.findall(FENCED.sub('', document.read_text(encoding='utf-8'))):
        words = re.sub(r'\[([^\]]*)\]\([^)]*\)', r'\1', heading).lower()
        anchor = re.sub(r'[^\w\- ]', '', words).replace(' ', '-')
        yield f'{anchor}-{seen[anchor]}' if anchor in seen else anchor
        seen[anchor] = seen.get(anchor, 0) + 1


def broken_links(document: Path) -> list[str]:
    text = FENCED.sub('', document.read_text(encoding='utf-8'))
    return [link for link in LINK.findall(text) if '://' not in link and not leads_somewhere(document, link)]


def leads_somewhere(document: Path, link: str) -> bool:
    name, _, anchor = link.partition('#')
    target = document.parent / name if name else document
    return target.exists() and (not anchor or anchor in anchors(target))


def unknown_commands(document: Path) -> list[str]:
    """What follows `./advise` or `ros2 run advise_ros` and is no executable, and scripts that do not exist."""
    text = document.read_text(encoding='utf-8')
    names = re.findall(r'(?:\./advise|ros2 run advise_ros) ([a-z]\w*)', text)
    scripts = re.findall(r'\./advise python ([\w/]+\.py)', text)
    return [name for name in names if name not in EXECUTABLES] + [name for name in scripts if not (ROOT / name).exists()]


def missing_modules(document: Path) -> list[str]:
    """Python files in backquotes, from the root or from the package on, that do not exist."""
    names = re.findall(r'`((?:\w+/)+\w+\.py)`', document.read_text(encoding='utf-8'))
    return [name for name in names if not any((base / name).exists() for base in (ROOT, ROOT / 'advise_ros'))]


every_document = pytest.mark.parametrize('document', DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())


@every_document
def test_every_command_exists(document: Path) -> None:
    assert not unknown_commands(document)


@every_document
def test_every_module_exists(document: Path) -> None:
    assert not missing_modules(document)


@every_document
def test_every_link_leads_somewhere(document: Path) -> None:
    assert not broken_links(document)


@pytest.mark.parametrize('index', ['docs/index.md', 'docs/notebook/index.md'])
def test_an_index_leads_to_every_document_of_its_folder(index: str) -> None:
    page = ROOT / index
    listed = {(page.parent / link.partition('#')[0]).resolve() for link in LINK.findall(page.read_text(encoding='utf-8'))}
    assert {document.name for document in set(page.parent.glob('*.md')) - listed} == {page.name}


def test_the_readme_stays_short() -> None:
    assert len((ROOT / 'README.md').read_bytes()) < 11_000, 'move details to docs/'


def test_a_missing_file_and_a_missing_heading_are_broken_links(tmp_path: Path) -> None:
    page = tmp_path / 'page.md'
    page.write_text('# A `b`, c!\n\n## Two\n\n## Two\n\n[1](other.md) [2](#a-b-c) [3](#d) [4](#two-1) [5](page.md#two-2)\n')
    assert broken_links(page) == ['other.md', '#d', 'page.md#two-2']


def test_a_missing_executable_and_a_missing_script_are_unknown_commands(tmp_path: Path) -> None:
    page = tmp_path / 'page.md'
    page.write_text('./advise policy\nros2 run advise_ros swim\n./advise python tools/none.py\n')
    assert unknown_commands(page) == ['swim', 'tools/none.py']


def test_a_module_that_moved_is_missing(tmp_path: Path) -> None:
    page = tmp_path / 'page.md'
    page.write_text('`core/errors.py` `advise_ros/core/errors.py` `core/elsewhere/errors.py`')
    assert missing_modules(page) == ['core/elsewhere/errors.py']

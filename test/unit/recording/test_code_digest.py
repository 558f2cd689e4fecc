"""The digest that bags are compared by: of the code alone, and kept beside it so that a node starts quickly."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from advise_ros.recording import code_digest

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def nothing_remembered() -> Iterator[None]:
    code_digest.core_digest.cache_clear()
    yield
    code_digest.core_digest.cache_clear()


def test_comments_and_docstrings_do_not_change_the_digest_and_code_does(tmp_path: Path) -> None:
    bare = 'def f(a):\n    return f"{a} # 1"\n'
    documented = '"""A module."""\n\n# Why.\ndef f(a):\n    """Say.\n\n    More.\n    """\n    return f"{a} # 1"  # Because.\n'
    told = {source: digest_of(tmp_path, source) for source in (bare, documented, bare.replace('1', '2'), 'x = """A."""\n')}
    assert told[bare] == told[documented]
    assert len(set(told.values())) == 3


def digest_of(folder: Path, source: str) -> str:
    (folder / 'module.py').write_text(source)
    return code_digest.digest_of_code(folder)


def test_the_kept_digest_is_that_of_the_sources() -> None:
    done = subprocess.run([sys.executable, ROOT / 'tools' / 'core_digest.py', '--check'], check=False)
    assert done.returncode == 0, 'run ./advise python tools/core_digest.py'


def test_the_kept_digest_is_taken_as_long_as_no_source_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = code_digest.digest_of_code(code_digest.CORE)
    monkeypatch.delattr(code_digest, 'digest_of_code')
    assert code_digest.core_digest() == wanted


def test_of_other_sources_it_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(code_digest, 'CORE', tmp_path)
    (tmp_path / 'module.py').write_text('x = 1\n')
    assert code_digest.core_digest() == code_digest.digest_of_code(tmp_path)


@pytest.mark.parametrize('change', [('b.py', 'x = 1\n'), ('a.py', 'x = 1  # Why.\n')])
def test_any_byte_and_any_name_changes_the_hash_of_sources(tmp_path: Path, change: tuple[str, str]) -> None:
    for folder, (name, text) in {'before': ('a.py', 'x = 1\n'), 'after': change}.items():
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text(text)
    assert code_digest.hash_of_sources(tmp_path / 'before') != code_digest.hash_of_sources(tmp_path / 'after')

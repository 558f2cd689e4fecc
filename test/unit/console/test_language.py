"""The languages of the page and of `ask`: every text has a translation with the same placeholders."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Iterator
from types import ModuleType

import pytest

from advise_ros.console.language import Words, languages, of_browser, of_terminal, words
from advise_ros.core.errors import InputError
from support.setting_up import ROOT

PLACEHOLDER = re.compile(r'\{\w*\}')
OTHERS = [code for code in languages() if code != 'en']


@pytest.fixture
def texts(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    monkeypatch.syspath_prepend(str(ROOT / 'tools'))
    yield importlib.import_module('texts')
    sys.modules.pop('texts', None)


@pytest.mark.parametrize('code', OTHERS)
def test_no_text_lacks_a_translation(code: str, texts: ModuleType) -> None:
    assert not texts.missing(code), 'run ./advise python tools/texts.py and fill in what it names'


@pytest.mark.parametrize('code', OTHERS)
def test_placeholders_are_the_same(code: str, texts: ModuleType) -> None:
    for message in texts.read(code):
        given = (message.id,) if isinstance(message.id, str) else message.id
        for text in (message.string,) if isinstance(message.string, str) else message.string:
            wanted = {name for one in given for name in PLACEHOLDER.findall(one)} if given[0] else set()
            assert set(PLACEHOLDER.findall(text)) == wanted or not given[0], message.id


@pytest.mark.parametrize('code', OTHERS)
def test_no_translation_is_of_a_text_that_is_no_more(code: str, texts: ModuleType) -> None:
    known = {message.id for message in texts.collected()}
    assert {message.id for message in texts.read(code)} <= known


@pytest.mark.parametrize(('accepted', 'chosen', 'found'), [
    ('de-AT,de;q=0.9,en;q=0.5', '', 'de'), ('en-GB,en;q=0.9,de;q=0.2', '', 'en'), ('de;q=0.2, en;q=0.8', '', 'en'),
    ('fr,de;q=0.5', '', 'de'), ('fr', '', 'en'), ('', '', 'en'), ('de', 'en', 'en'), ('en', 'de', 'de'), ('de', 'xx', 'de'),
    ('*;q=oh, ,;;', '', 'en'), ('de;q=0', '', 'en'),
])  # fmt: skip
def test_the_browser_s_language(accepted: str, chosen: str, found: str) -> None:
    assert of_browser(accepted, chosen) == found


@pytest.mark.parametrize(('environment', 'found'), [
    ({'LANG': 'de_DE.UTF-8'}, 'de'), ({'LANG': 'C.UTF-8'}, 'en'), ({}, 'en'),
    ({'LANG': 'en_US.UTF-8', 'LANGUAGE': 'de:en'}, 'de'),
    ({'LANG': 'de_DE.UTF-8', 'LC_ALL': 'C'}, 'en'),
])  # fmt: skip
def test_the_terminal_s_language(environment: dict[str, str], found: str) -> None:
    assert of_terminal(environment) == found


def test_numbers_and_plurals() -> None:
    german, english = words('de'), words('en')
    assert (german.number(1234.5, 1), english.number(1234.5, 1)) == ('1.234,5', '1,234.5')
    assert (german.percent(0.834), english.percent(0.834)) == ('83\u00a0%', '83\u00a0%')
    assert english.tn('{n} cell', '{n} cells', 1) == '1 cell'
    assert english.tn('{n} cell', '{n} cells', 2) == '2 cells'
    assert english.t('Hello {name}', name='{Anna}') == 'Hello {Anna}'


def test_an_unknown_language_is_named() -> None:
    with pytest.raises(InputError, match=r"language 'xx' is unknown; there are en, de"):
        words('xx')


def test_english_needs_no_catalogue() -> None:
    assert not Words('en').texts

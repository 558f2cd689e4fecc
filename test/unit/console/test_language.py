"""The languages of the page and of `ask`: every text has a translation with the same placeholders."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType

import pytest

from advise_ros.console.language import LOCALE, Translator, languages, of_browser, of_terminal, words
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
        for number, text in enumerate((message.string,) if isinstance(message.string, str) else message.string):
            wanted = PLACEHOLDER.findall(given[min(number, len(given) - 1)])
            assert set(PLACEHOLDER.findall(text)) == set(wanted) or not given[0], message.id


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
    assert not Translator('en').texts


# -- no text beside the function ----------------------------------------------------------------------
STATIC = LOCALE.parent / 'static'
TEMPLATES = re.compile(r'`\s*(<.*?)`', re.DOTALL)
TRANSLATED = re.compile(r'\b(?:t|tn|mark)\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)')
# Translator of a sentence, rather than names in a program.
SENTENCE = re.compile(r"'[^'\n]*[A-Za-z]{2,}[ ,]+[a-z]{2,}[^'\n]*'")
READ_OUT = ('aria-label', 'placeholder', 'title', 'alt')
# The product's name, and a key's sign.
NAMES = {'advise', 'Enter', 'o', 's', 'u', 'm', 'a', 't', 'N', 'x'}


class Texts(HTMLParser):
    """What a template shows as it stands there, and what its bindings say."""

    def __init__(self) -> None:
        super().__init__()
        self.shown: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in READ_OUT:
                self.shown.append(value or '')
            elif name.startswith((':', '@', 'v-')):
                self._look(value or '')

    def handle_data(self, data: str) -> None:
        for said in re.findall(r'\{\{(.*?)\}\}', data, re.DOTALL):
            self._look(said)
        self.shown.append(re.sub(r'\{\{.*?\}\}', '', data, flags=re.DOTALL))

    def _look(self, code: str) -> None:
        self.shown += SENTENCE.findall(TRANSLATED.sub('', code))


def untranslated(script: str) -> list[str]:
    """Texts of a module of the page that do not go through the function."""
    found = []
    for template in TEMPLATES.findall(script):
        parser = Texts()
        parser.feed(template)
        found += [text.strip() for text in parser.shown if re.search(r'[A-Za-z]', text) and text.strip() not in NAMES]
    code = re.sub(r'(?m)//.*$', '', TEMPLATES.sub('', script))
    code = re.sub(r"(?m)^(?:import|export) .* from '.*';$|context\.font = .*", '', code)
    code = re.sub(r"(?:closest|matches)(?:\?\.)?\('[^']*'\)|(?<=[{,])\s*'[^']*'(?=: )", '', code)  # Selectors, names.
    return found + SENTENCE.findall(TRANSLATED.sub('', code))


@pytest.mark.parametrize('path', sorted(STATIC.glob('*.js')), ids=lambda path: path.name)
def test_the_page_has_no_text_beside_the_function(path: Path) -> None:
    assert not untranslated(path.read_text(encoding='utf-8'))


@pytest.mark.parametrize('script', [
    'export default `<p>Some words</p>`', 'export default `<p aria-label="A label"></p>`', "let a = 'Some words here';",
    "export default `<p>{{ open ? 'Is open now' : t('Closed') }}</p>`", 'x = `<b :title="\'Two words\'"></b>`',
])  # fmt: skip
def test_such_a_text_is_found(script: str) -> None:
    assert untranslated(script)

"""The texts of the page and of `ask` in the person's language: gettext catalogues, one a language, read by Babel.

A text is its English wording. `Translator.t('Your answer')` translates it; `{name}` in it is replaced by what is given under
that name. A new language is a file locale/CODE/LC_MESSAGES/advise_ros.po, nothing else; a text that it lacks stays English.
"""

from __future__ import annotations

import gettext
import os
from collections.abc import Mapping
from datetime import datetime, timezone
from functools import cache
from pathlib import Path
from typing import Any

from babel import Locale
from babel.core import negotiate_locale, parse_locale
from babel.dates import format_time
from babel.messages.pofile import read_po
from babel.numbers import format_decimal, format_percent

from advise_ros.core.errors import InputError

LOCALE = Path(__file__).parent / 'locale'
CATALOGUE = 'LC_MESSAGES/advise_ros.po'
ENGLISH = 'en'


@cache
def languages() -> tuple[str, ...]:
    """Codes of all languages, English first."""
    return (ENGLISH, *sorted(path.name for path in LOCALE.iterdir() if (path / CATALOGUE).is_file()))


def mark(text: str) -> str:
    """The text itself, marked to be collected: it is translated where it is shown."""
    return text


class Translator:
    """Texts, numbers and times of day in one language.

    Attributes:
        code: of the language, e.g. 'de'.
        texts: English -> translation; English of one -> translations in the order of the language's plurals.
    """

    def __init__(self, code: str) -> None:
        self.code = code
        self.texts: dict[str, str | list[str]] = {}
        self._plural = gettext.c2py('n != 1')  # type: ignore[attr-defined]
        if code != ENGLISH:
            self._load(LOCALE / code / CATALOGUE)

    def _load(self, path: Path) -> None:
        with path.open('rb') as file:
            catalogue = read_po(file, locale=self.code)
        self._plural = gettext.c2py(catalogue.plural_expr)  # type: ignore[attr-defined]
        for message in catalogue:
            if message.id and isinstance(message.id, str):
                self.texts[message.id] = str(message.string or message.id)
            elif message.id:
                self.texts[message.id[0]] = [str(text) for text in message.string]

    def t(self, text: str, /, **given: object) -> str:
        """The text in this language, `{name}` replaced by `given`."""
        found = self.texts.get(text, text)
        return (found if isinstance(found, str) else found[0]).format_map(given) if given else str(found)

    def tn(self, one: str, many: str, n: int, /, **given: object) -> str:
        """Likewise of a number: `one` is the English text for 1, `many` for others; `{n}` is the number."""
        found = self.texts.get(one)
        text = found[min(self._plural(n), len(found) - 1)] if isinstance(found, list) else one if n == 1 else many
        return text.format_map({'n': self.number(n), **given})

    def number(self, value: float, digits: int = 0) -> str:
        """E.g. '1,5'."""
        return format_decimal(value, f'#,##0.{"0" * digits}' if digits else '#,##0', locale=self.code)

    def percent(self, share: float) -> str:
        """A share from 0 to 1, e.g. '83 %'."""
        return format_percent(share, '#,##0\u00a0%', locale=self.code)

    def clock(self, seconds: float) -> str:
        """The time of day here, of seconds since 1970, e.g. '14:05'."""
        here = datetime.fromtimestamp(seconds, tz=timezone.utc).astimezone()
        return format_time(here, 'short', locale=self.code).replace('\u202f', ' ')


@cache
def words(code: str) -> Translator:
    """The texts of a language.

    Raises:
        InputError: there is no such language.
    """
    if code not in languages():
        raise InputError(f"language '{code}' is unknown; there are {', '.join(languages())}")
    return Translator(code)


def of_browser(accepted: str, chosen: str = '') -> str:
    """The language that a person gets.

    Args:
        accepted: the browser's Accept-Language, e.g. 'de-AT,de;q=0.9,en;q=0.5'.
        chosen: what the person has chosen earlier, or whoever started the page; counts first where it is known.
    """
    if chosen in languages():
        return chosen
    ranked = sorted(filter(None, map(_weighted, accepted.split(','))), key=lambda pair: -pair[1])
    return negotiate_locale([name for name, _ in ranked], languages(), sep='-') or ENGLISH


def _weighted(part: str) -> tuple[str, float] | None:
    """E.g. 'de;q=0.9' -> ('de', 0.9); None for what is none or not wanted."""
    name, _, weight = part.strip().partition(';q=')
    try:
        parse_locale(name, sep='-')
        share = float(weight or 1)
    except ValueError:
        return None
    return (name, share) if share > 0 else None


def of_terminal(environment: Mapping[str, str] = os.environ) -> str:
    """The language of LANGUAGE, LC_ALL, LC_MESSAGES or LANG, English where none of them is known."""
    for name in ('LANGUAGE', 'LC_ALL', 'LC_MESSAGES', 'LANG'):
        if value := environment.get(name, '').split(':')[0].split('.')[0]:
            return negotiate_locale([value], languages()) or ENGLISH
    return ENGLISH


def catalogue(code: str) -> dict[str, Any]:
    """What the page needs of a language: its code, its texts, and the names of all languages in themselves."""
    names = {one: str(Locale.parse(one).get_display_name(one)).capitalize() for one in languages()}
    return {'code': code, 'texts': words(code).texts, 'names': names}

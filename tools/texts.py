"""Collects the texts of the page and of the commands, and brings every catalogue up to date: new ones come in empty.

    ./advise python tools/texts.py           # then fill in what it names
    ./advise python tools/texts.py --check   # only name what is missing
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

from babel.messages.catalog import Catalog
from babel.messages.extract import extract_from_file
from babel.messages.pofile import read_po, write_po

from advise_ros.console.language import CATALOGUE, ENGLISH, LOCALE, languages

PACKAGE = LOCALE.parent.parent
# In Python: .t('...'), .tn('...', '...', n), mark('...').
CALLS = {'t': None, 'tn': (1, 2), 'mark': None}
# In JavaScript likewise, in the templates too, which no parser of JavaScript reads.
TEXT = r"'((?:[^'\\]|\\.)*)'"
CALL = re.compile(rf'(?<![\w.])(?:this\.)?(?:t|mark)\(\s*{TEXT}|\btn\(\s*{TEXT},\s*{TEXT}')

# Without dates and names, which would be another one for everybody who runs this.
HEADER = """# Texts of advise_ros: {code}.
msgid ""
msgstr ""
"Language: {code}\\n"
"Plural-Forms: {plurals};\\n"
"MIME-Version: 1.0\\n"
"Content-Type: text/plain; charset=utf-8\\n"
"Content-Transfer-Encoding: 8bit\\n"

"""


def found() -> Iterator[tuple[str | tuple[str, str], str]]:
    """Every text with the file that it is in."""
    for path in sorted((PACKAGE / 'console').glob('static/*.js')):
        if path.name == 'language.js':
            continue
        for one, singular, plural in CALL.findall(path.read_text(encoding='utf-8')):
            yield (singular, plural) if singular else one, path.name
    for path in sorted({*PACKAGE.glob('console/*.py'), *PACKAGE.glob('commands/*.py'), *PACKAGE.glob('nodes/*.py')}):
        if 'console.language import' not in path.read_text(encoding='utf-8'):
            continue
        for _, message, _, _ in extract_from_file('python', str(path), keywords=CALLS, options={'encoding': 'utf-8'}):
            yield message, path.name


def collected() -> Catalog:
    """All of them, in order."""
    catalogue = Catalog(project='advise_ros', charset='utf-8', fuzzy=False)
    for message, name in sorted(found(), key=lambda pair: (pair[1], str(pair[0]))):
        catalogue.add(message, locations=[(name, 0)])
    return catalogue


def read(code: str) -> Catalog:
    with (LOCALE / code / CATALOGUE).open('rb') as file:
        return read_po(file, locale=code)


def missing(code: str) -> list[str]:
    """Texts that a language lacks."""
    known = read(code)
    return [str(one.id) for one in collected() if one.id and not _whole(known.get(_key(one.id)))]


def _key(message: str | tuple[str, ...]) -> str:
    return message if isinstance(message, str) else message[0]


def _whole(message: object) -> bool:
    given = getattr(message, 'string', '')
    return bool(given) and all(given if isinstance(given, tuple) else (given,)) and not getattr(message, 'fuzzy', True)


def update(code: str) -> None:
    known = read(code)
    known.update(collected(), no_fuzzy_matching=True)
    known.obsolete.clear()
    with (LOCALE / code / CATALOGUE).open('wb') as file:
        file.write(HEADER.format(code=code, plurals=known.plural_forms.rstrip(';')).encode())
        write_po(file, known, width=120, include_lineno=False, omit_header=True)


def main() -> int:
    lacking = 0
    for code in languages():
        if code == ENGLISH:
            continue
        if '--check' not in sys.argv:
            update(code)
        for text in missing(code):
            print(f'{code}: {text}')
            lacking += 1
    return 1 if lacking else 0


if __name__ == '__main__':
    sys.exit(main())

"""The command lines of all commands: a mistyped option or choice is met with the one that was likely meant."""

from __future__ import annotations

import argparse
import difflib
import re
from collections.abc import Iterable
from typing import NoReturn

UNKNOWN = re.compile(r'unrecognized arguments: (--?[\w-]+)')
CHOICE = re.compile(r"invalid choice: '([^']*)' \(choose from (.*)\)")


def nearest(word: str, known: Iterable[str]) -> str:
    """'; did you mean X?' where a known word is close, else ''."""
    found = difflib.get_close_matches(word.lower().replace('_', '-'), [one.lower() for one in known], n=1)
    return f'; did you mean {found[0]}?' if found else ''


class CommandParser(argparse.ArgumentParser):
    """An ArgumentParser that says what was likely meant; an option is never taken for a longer one that begins like it."""

    def error(self, message: str) -> NoReturn:
        """End with exit code 2.

        Args:
            message: what is wrong.
        """
        unknown, choice = UNKNOWN.search(message), CHOICE.search(message)
        if unknown:
            message += nearest(unknown[1], self._option_string_actions) or f'; {self.prog} --help lists all'
        elif choice:
            message += nearest(choice[1], re.findall(r'[\w.-]+', choice[2]))
        super().error(message)

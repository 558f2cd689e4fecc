"""Why a text is no YAML, in words that say what to change."""

from __future__ import annotations


def in_words(problem: Exception) -> str:
    """A problem that PyYAML or the decoding of a file raised, with its line where there is one."""
    mark = getattr(problem, 'problem_mark', None)
    where = f' (line {mark.line + 1})' if mark else ''
    if mark and "'\\t'" in str(getattr(problem, 'problem', '')):
        return f'line {mark.line + 1} is indented by a tab; YAML takes spaces only, put two in its place'
    return f'it is not a YAML file{where}'

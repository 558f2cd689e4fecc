"""What a person does on the page, checked before it goes anywhere: what a browser sends is not to be trusted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from advise_ros.core.advice.advice import Answer, Verdict
from advise_ros.core.errors import InputError

NAME_MAX, COMMENT_MAX, STATES_MAX = 60, 500, 1_000_000
FORM_MAX = 20
ID_MAX = 2**63 - 1

# Acts that are one std_srvs/Trigger call: act -> service.
TRIGGERS = {
    'undo': 'advise/undo',
    'hold': 'policy/stop',
    'record_start': 'recorder/start',
    'record_stop': 'recorder/stop',
    'record_discard': 'recorder/discard',
    'takeoff': 'mavlink_bridge/takeoff',
    'land': 'mavlink_bridge/land',
    'take_over': 'mavlink_bridge/take_over',
}


def answer_of(given: Mapping[str, Any]) -> Answer:
    """The answer that a page has sent.

    Raises:
        InputError: it is none.
    """
    verdict = _integer(given, 'verdict', len(Verdict) - 1)
    return Answer(
        query_id=_integer(given, 'query', ID_MAX), verdict=verdict,
        preferred=_numbers(given, 'preferred', 16), avoided=_numbers(given, 'avoided', 16),
        expert_id=_text(given, 'by', NAME_MAX), comment=_text(given, 'comment', COMMENT_MAX),
        part=_numbers(given, 'part', STATES_MAX),
    )


def asked_states(given: Mapping[str, Any]) -> tuple[int, ...]:
    """The states of the question that the person saw.

    Raises:
        InputError: they are no numbers.
    """
    return _numbers(given, 'states', STATES_MAX)


def advice_id(given: Mapping[str, Any]) -> int:
    """Which answer is to be taken back.

    Raises:
        InputError: it is no number.
    """
    return _integer(given, 'advice', ID_MAX)


def route_form(given: Mapping[str, Any]) -> str:
    """The ending of a file's name.

    Raises:
        InputError: it is no text.
    """
    return _text(given, 'form', FORM_MAX)


def demonstration_id(given: Mapping[str, Any]) -> str:
    """Which demonstration is meant.

    Raises:
        InputError: it is no id.
    """
    found = _text(given, 'demonstration', NAME_MAX)
    if not found:
        raise InputError('demonstration is empty')
    return found


def lesson_name(given: Mapping[str, Any]) -> str:
    """What a person calls a demonstration; '' takes its name away.

    Raises:
        InputError: it is too long.
    """
    return _text(given, 'name', NAME_MAX).strip()


def unique_id(given: Mapping[str, Any]) -> str:
    """The page's own id of an answer, by which one that is sent again is known.

    Raises:
        InputError: it is missing or too long.
    """
    found = _text(given, 'uid', 64)
    if not found:
        raise InputError('uid is empty')
    return found


def _integer(given: Mapping[str, Any], name: str, high: int) -> int:
    value = given.get(name)
    if type(value) is not int or not 0 <= value <= high:
        raise InputError(f'{name} must be a whole number from 0 to {high}')
    return value


def _numbers(given: Mapping[str, Any], name: str, most: int) -> tuple[int, ...]:
    values = given.get(name, [])
    if not isinstance(values, list) or len(values) > most:
        raise InputError(f'{name} must be a list of at most {most} numbers')
    if any(type(value) is not int or not 0 <= value <= STATES_MAX for value in values):
        raise InputError(f'{name} must hold whole numbers from 0 to {STATES_MAX}')
    return tuple(values)


def _text(given: Mapping[str, Any], name: str, longest: int) -> str:
    """Plain text of one line; what does not print is dropped."""
    value = given.get(name, '')
    if not isinstance(value, str) or len(value) > longest:
        raise InputError(f'{name} must be a text of at most {longest} characters')
    return ''.join(character for character in value if character.isprintable())

"""Profiles of topics that a parameter overrides: qos_overrides./TOPIC.publisher.reliability and so on.

https://design.ros2.org/articles/qos_configurability.html
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any

from advise_ros.core.errors import InputError

PREFIX = 'qos_overrides.'
ENTITIES = ('publisher', 'subscription')
ALLOWED: Mapping[str, tuple[str, ...]] = {
    'history': ('keep_last', 'keep_all', 'system_default'),
    'reliability': ('reliable', 'best_effort', 'system_default'),
    'depth': (),
}


class QosOverrides:
    """What a node was given, and what of it was made use of.

    Args:
        given: all parameter overrides of the node.

    Raises:
        InputError: an override has not the form, or no value of its policy.
    """

    def __init__(self, given: Mapping[str, Any]) -> None:
        self._given = {name: _checked(name, value) for name, value in given.items() if name.startswith(PREFIX)}
        self._opened: set[str] = set()

    def override(self, topic: str, entity: str) -> bool:
        """Whether something is given for what is being opened.

        Args:
            topic: with its namespace, as remapped.
            entity: publisher or subscription.
        """
        self._opened.add(f'{topic}.{entity}')
        return any(_of(name) == f'{topic}.{entity}' for name in self._given)

    @property
    def unused(self) -> str:
        """What fits nothing that was opened, in one sentence; '' if there is nothing."""
        for name in self._given:
            if _of(name) not in self._opened:
                near = difflib.get_close_matches(_of(name), sorted(self._opened), n=1, cutoff=0.3)
                hint = f"; did you mean '{PREFIX}{near[0]}.{name.rsplit('.', 1)[1]}'?" if near else ''
                return f"parameter '{name}' fits no topic that this node opens{hint}"
        return ''


def _of(name: str) -> str:
    """The topic and publisher or subscription of a parameter."""
    return name.removeprefix(PREFIX).rsplit('.', 1)[0]


def _checked(name: str, value: Any) -> Any:
    topic, _, rest = name.removeprefix(PREFIX).partition('.')
    entity, _, policy = rest.partition('.')
    if not topic.startswith('/') or entity not in ENTITIES:
        raise InputError(f"parameter '{name}' is no override of a profile; write {PREFIX}/TOPIC.publisher.reliability")
    if policy not in ALLOWED:
        raise InputError(f"parameter '{name}': '{policy}' cannot be overridden; those that can: {', '.join(ALLOWED)}")
    if policy == 'depth':
        if type(value) is not int or not 1 <= value <= 1_000_000:
            raise InputError(f"parameter '{name}' is {value!r}; allowed: 1 to 1000000")
    elif value not in ALLOWED[policy]:
        raise InputError(f"parameter '{name}' is {value!r}; allowed: {' | '.join(map(repr, ALLOWED[policy]))}")
    return value

"""What a node waits for at its start, said once in its log, and what it has when that has come; the same for all nodes."""

from __future__ import annotations

import re

WAITS = re.compile(r'^(?:still )?waiting for (?P<what>.+)$|^(?P<none>no pose yet)$')
# End of a topic's or service's name, or a word of the sentence -> what makes it.
MADE_BY = {
    'cmd_vel': 'policy, pilot or teleop', 'advise/policy': 'advise', 'advise/query': 'advise', 'advise/answer': 'advise',
    'demonstration': 'recorder', 'heartbeat': 'the vehicle, or name another url', 'vehicle': 'the vehicle, or name another url',
    'companion': 'mavlink_bridge', 'pose': 'mavlink_bridge, or guard beside another bridge', 'odom': 'mavlink_bridge',
    'positions': 'mavlink_bridge, or guard beside another bridge',
}


class StartWaits:
    """Sentences for the log of a node that starts; nothing more once it has what it waited for."""

    def __init__(self) -> None:
        self._open: dict[str, str] = {}
        self._said: set[str] = set()
        self._over = False

    def news(self, status: str) -> list[str]:
        """What is to be said of a status, in order.

        Args:
            status: the node's sentence; several are divided by semicolons.
        """
        if self._over:
            return []
        now = {what: _sentence(what) for part in status.split('; ') if (what := _waited_for(part))}
        news = [text for what, text in now.items() if what not in self._said]
        news += [f'has {what}' for what in self._open if what not in now]
        self._over = bool(self._said) and not now
        self._said |= now.keys()
        self._open = now
        return news


def _waited_for(part: str) -> str:
    found = WAITS.match(part.strip())
    return '' if found is None else (found['what'] or 'a pose')


def _sentence(what: str) -> str:
    maker = next((maker for name, maker in MADE_BY.items() if re.search(rf'(^|\W){name}(\W|$)', what)), '')
    return f'waiting for {what}{f": start {maker}" if maker else ""}'

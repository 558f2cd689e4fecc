"""A session whose accepted answers are on the disk before the service replies."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path

from advise_ros.core.advice.advice import Code, Outcome
from advise_ros.core.errors import AdviseError
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.recording.sessionfile import Loaded, SessionFile

NOTHING = Loaded((), 0, ())


class LiveSession(Session):
    """A session whose settings may change under way."""

    def change(self, settings: LearnSettings, budget: int) -> None:
        """Go on with other settings: what was learnt is due anew, from the same demonstrations and answers.

        Args:
            settings: of the policies to come.
            budget: answers that the person is willing to give in all, -1 unlimited.
        """
        self.settings, self.budget = settings, budget
        self._learned = None


class SavedSession:
    """A `core.session.Session` and the session file that keeps its log.

    Attributes:
        session: the session as it stands.
        loaded: what the file held at the start.
    """

    def __init__(self, session: LiveSession, path: str | Path) -> None:
        """An empty path keeps nothing.

        Raises:
            InputError: as SessionFile.
        """
        self.session = session
        self._file = SessionFile(path, session.grid) if str(path) else None
        self.loaded = self._file.loaded if self._file else NOTHING
        self._asked = self.loaded.last_query_id
        if self._file:
            session.restore(tuple(entry.record for entry in self.loaded.entries), last_query_id=self._asked)

    def commit(self, act: Callable[[Session], Outcome], stamp_ns: int) -> Outcome:
        """Change the session and write its record; if it cannot be written, nothing has happened and the code is NOT_SAVED.

        Args:
            act: changes the session.
            stamp_ns: of the entry.
        """
        draft = copy.copy(self.session)
        outcome = act(draft)
        if outcome.record is not None and self._file is not None:
            try:
                self._file.append_advice(outcome.record, stamp_ns)
            except AdviseError as problem:
                sentence = f'{problem}; nothing was changed, free some space and say it again'
                return Outcome(False, Code.NOT_SAVED, sentence, budget_left=outcome.budget_left)
        self.session = draft
        return outcome

    def note_asked(self, query_id: int) -> None:
        """Keep the id of a query that is about to be published: no later one may bear it.

        Raises:
            AdviseError: it could not be written.
        """
        if self._file is not None and query_id > self._asked:
            self._file.append_asked(query_id)
            self._asked = query_id

    def close(self) -> None:
        if self._file is not None:
            self._file.close()

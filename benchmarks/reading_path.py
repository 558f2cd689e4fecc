"""How much of our own code one policy passes: files and functions of `learn` after an answer, and of a session's answer.

    ./advise python benchmarks/reading_path.py [--acquisition occupancy]

Prints Markdown: a newcomer who follows an answer to the policy has to open these files.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

import advise_ros
from advise_ros.core.advice.advice import Answer, Verdict
from advise_ros.core.grid.grid import Grid
from advise_ros.core.irl.settings import LearnSettings
from advise_ros.core.learning.session import Session
from advise_ros.core.people.trial import TrialSettings, fly

GRID = Grid(2.0, 6, 6, (-1.0, -1.0), 5.0, (5, 35, 30, 0))
PACKAGE = str(Path(advise_ros.__file__).parent)


class Passed:
    """Files and functions of the package that were entered, and how often a call went from one file to another."""

    def __init__(self) -> None:
        self.functions: dict[tuple[str, str], int] = {}
        self.changes = 0

    def __call__(self, frame: FrameType, event: str, _: Any) -> None:
        """As `sys.setprofile` wants it."""
        code = frame.f_code
        if event != 'call' or not code.co_filename.startswith(PACKAGE) or code.co_name.startswith('<'):
            return
        key = code.co_filename.removeprefix(PACKAGE + '/'), code.co_qualname if hasattr(code, 'co_qualname') else code.co_name
        self.functions[key] = self.functions.get(key, 0) + 1
        caller = frame.f_back.f_code.co_filename if frame.f_back else ''
        self.changes += caller.startswith(PACKAGE) and caller != code.co_filename

    @property
    def files(self) -> list[str]:
        """In the order in which they were entered."""
        return list(dict.fromkeys(file for file, _ in self.functions))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--acquisition', default='occupancy')
    session = Session(GRID, LearnSettings(acquisition=parser.parse_args().acquisition))
    for flight in fly(GRID, TrialSettings(), np.random.default_rng(0)):
        session.add(flight)
    for number in range(2):  # Also what is imported and remembered at the first time.
        work = session.snapshot()
        assert work is not None
        passed = Passed()
        sys.setprofile(passed)
        session.adopt(work.run())
        sys.setprofile(None)
        if number == 0 and session.query is not None:
            session.submit(Answer(session.query.query_id, Verdict.ANSWER, (1,), (3,)))
    print(f'{len(passed.files)} files, {len(passed.functions)} functions, {passed.changes} calls from one file to another\n')
    print('| file | functions, and how often each |\n| --- | --- |')
    for file in passed.files:
        names = [f'{name} {number}' for (place, name), number in passed.functions.items() if place == file]
        print(f'| {file} | {", ".join(names)} |')


if __name__ == '__main__':
    main()

"""The verdict of a replay, for people and for programs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from advise_ros.replay.session import RecordedSession
from advise_ros.replay.stage import Stage

CLOCK_NOTE = 'header stamps of policies and questions come from a clock and are taken as recorded'


@dataclass(frozen=True)
class Report:
    """All stages of one bag.

    Attributes:
        session: what was replayed.
        stages: in the order of the data's way.
        seconds: that the replay took.
    """

    session: RecordedSession
    stages: tuple[Stage, ...]
    seconds: float

    @property
    def agrees(self) -> bool:
        return all(stage.agrees for stage in self.stages)

    @property
    def asked(self) -> str:
        """What equality meant, in one sentence."""
        if self.session.same_platform:
            return 'equal bytes were asked: the bag was made by the same package versions on the same kind of machine'
        return 'equal decisions were asked, and floats within 1e-6: ' + _why_not(self.session.made_on)

    @property
    def verdict(self) -> str:
        checked = sum(stage.checked for stage in self.stages)
        equal = sum(stage.equal for stage in self.stages)
        if self.agrees:
            return f'{equal} of {checked} agree: the session follows from what the bag holds'
        return f'{equal} of {checked} agree: the session does NOT follow from what the bag holds'

    def as_json(self) -> dict[str, Any]:
        session = self.session
        return {
            'bag': str(session.bag.path), 'namespace': session.namespace or '/', 'messages': session.bag.count,
            'recorded_s': session.seconds, 'replay_s': self.seconds,
            'asked': 'bytes' if session.same_platform else 'decisions', 'asked_why': self.asked,
            'agrees': self.agrees, 'stages': [asdict(stage) for stage in self.stages],
            'made_on': dict(session.made_on),
        }


def _why_not(made_on: Any) -> str:
    if not made_on:
        return 'the bag does not tell where it was made'
    return 'the bag was made by other package versions or on another kind of machine'


def show(report: Report, console: Console) -> None:
    """Print the table, the first difference of each stage, and the verdict."""
    session = report.session
    pace = session.seconds / report.seconds if report.seconds else 0.0
    console.print(
        f'{session.bag.path}: {session.bag.count} messages over {session.seconds:.1f} s, '
        f'replayed in {report.seconds:.1f} s ({pace:.0f} times real time)', highlight=False, markup=False, soft_wrap=True,
    )
    console.print(_table(report))
    for stage in report.stages:
        for line in (f'first difference in {stage.name}: {stage.difference}' if stage.difference else '', *stage.notes):
            if line:
                console.print(f'- {line}', highlight=False, markup=False, soft_wrap=True)
    console.print(f'- {report.asked}; {CLOCK_NOTE}', highlight=False, markup=False, soft_wrap=True)
    console.print(report.verdict, style='green' if report.agrees else 'red', highlight=False)


def _table(report: Report) -> Table:
    table = Table(box=box.SIMPLE)
    table.add_column('rebuilt')
    for name in ('checked', 'equal'):
        table.add_column(name, justify='right')
    table.add_column('verdict')
    for stage in report.stages:
        mark = 'none in the bag' if not stage.checked else 'equal' if stage.agrees else '[red]differs[/red]'
        table.add_row(stage.name, str(stage.checked), str(stage.equal), mark)
    return table

"""The verdict of a replay: for people, as JSON and as JUnit XML, which CI systems show."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any
from xml.etree import ElementTree as ET

from rich import box
from rich.console import Console
from rich.table import Table

from advise_ros.recording import platform
from advise_ros.replay.decisions import digest
from advise_ros.replay.session import RecordedSession
from advise_ros.replay.stage import Rebuilt, Stage

# Stages whose messages are rebuilt whole; the others compare what follows of a message, or count.
OF_MESSAGES = ('demonstrations', 'policies', 'queries', 'commands')
CLOCK_NOTE = 'header stamps of policies and questions come from a clock and are taken as recorded'


@dataclass(frozen=True)
class ReplayReport:
    """All stages of one bag.

    Attributes:
        session: what was replayed.
        stages: in the order of the data's way.
        rebuilt: what came out and what it decided.
        seconds: that the replay took.
        baseline: name of what the decisions were compared with, '' for none.
        beside: the stages of that comparison; where there is one, it alone makes the verdict.
    """

    session: RecordedSession
    stages: tuple[Stage, ...]
    rebuilt: Rebuilt
    seconds: float
    baseline: str = ''
    beside: tuple[Stage, ...] = ()

    @property
    def asked_stages(self) -> tuple[Stage, ...]:
        """Those that make the verdict."""
        return self.beside or self.stages

    @property
    def agrees(self) -> bool:
        return all(stage.agrees for stage in self.asked_stages)

    @property
    def asked(self) -> str:
        """What equality meant, in one sentence."""
        if self.beside:
            return 'the decisions of the baseline were asked, not its times; numbers within 1e-6'
        if self.session.overrides:
            return 'decisions with other parameters are compared with those of the bag'
        if self.session.same_platform:
            return 'equal bytes were asked: the bag was made by the same package versions on the same kind of machine'
        why = _why_not(self.session.made_on)
        if self.session.missing:
            why += f'; its messages have no {", ".join(self.session.missing)}'
        return 'equal decisions were asked, and floats within 1e-6: ' + why

    @property
    def in_bytes(self) -> tuple[int, int]:
        """How many rebuilt messages have the recorded bytes, whatever was asked, and how many there are."""
        stages = [stage for stage in self.stages if stage.name.split(',')[0] in OF_MESSAGES]
        return sum(stage.in_bytes for stage in stages), sum(stage.checked for stage in stages)

    @property
    def byte_verdict(self) -> str:
        same, of = self.in_bytes
        return f'{same} of {of} rebuilt messages are equal byte for byte'

    @property
    def verdict(self) -> str:
        checked = sum(stage.checked for stage in self.asked_stages)
        equal = sum(stage.equal for stage in self.asked_stages)
        counted = f'{equal} of {checked} agree'
        if self.beside:
            return f'{counted}: the session decides {"as" if self.agrees else "NOT as"} {self.baseline} did'
        if self.session.overrides:
            return f'{equal} of {checked} would be as they were' + ('' if self.agrees else ', the others would have CHANGED')
        verdict = f'{counted}: the session {"follows" if self.agrees else "does NOT follow"} from what the bag holds'
        return verdict if self.agrees or self.session.same_cores else verdict + self._other_version

    @property
    def _other_version(self) -> str:
        """What else may have made a difference."""
        theirs, ours = (str(made.get('core', ''))[:8] for made in (self.session.made_on, platform.describe()))
        return (
            f', or another version decides otherwise: the bag was made by core {theirs or "unknown"}, this is core {ours}; '
            'replay it by that version to see which of the two it is'
        )

    @property
    def inputs(self) -> str:
        """Digest of the positions."""
        return digest(self.session.recording.poses)

    def as_json(self) -> dict[str, Any]:
        session = self.session
        return {
            'bag': str(session.bag.path), 'namespace': session.namespace or '/', 'messages': session.bag.count,
            'recorded_s': session.seconds, 'replay_s': self.seconds,
            'asked': 'bytes' if session.same_platform and not session.overrides else 'decisions', 'asked_why': self.asked,
            'agrees': self.agrees, 'stages': [asdict(stage) for stage in self.stages],
            'baseline': self.baseline, 'beside': [asdict(stage) for stage in self.beside],
            'overrides': {node: dict(values) for node, values in session.overrides.items()},
            'made_on': dict(session.made_on), 'inputs': self.inputs, 'decisions': self.rebuilt.decisions,
        }


def _why_not(made_on: Any) -> str:
    if not made_on:
        return 'the bag does not say where it was made'
    return 'the bag was made by other package versions or on another kind of machine'


def show(report: ReplayReport, console: Console) -> None:
    """Print the table, the first difference of each stage, and the verdict."""
    session = report.session
    pace = session.seconds / report.seconds if report.seconds else 0.0
    console.print(
        f'{session.bag.path}: {session.bag.count} messages over {session.seconds:.1f} s, '
        f'replayed in {report.seconds:.1f} s ({pace:.0f} times real time)', highlight=False, markup=False, soft_wrap=True,
    )
    for node, values in session.overrides.items():
        for name, value in values.items():
            console.print(f'- what if {node}.{name} were {value}', highlight=False, markup=False, soft_wrap=True)
    console.print(_table(report))
    for stage in report.asked_stages:
        first = 'change' if session.overrides and not report.beside else 'difference'
        for line in (f'first {first} in {stage.name}: {stage.difference}' if stage.difference else '', *stage.notes):
            if line:
                console.print(f'- {line}', highlight=False, markup=False, soft_wrap=True)
    console.print(f'- {report.asked}; {CLOCK_NOTE}', highlight=False, markup=False, soft_wrap=True)
    if not (session.overrides or report.beside):
        console.print(f'- {report.byte_verdict}', highlight=False, markup=False, soft_wrap=True)
    console.print(report.verdict, style='green' if report.agrees else 'red', highlight=False, soft_wrap=True)


def _table(report: ReplayReport) -> Table:
    table = Table(box=box.SIMPLE)
    table.add_column('rebuilt')
    for name in ('checked', 'equal'):
        table.add_column(name, justify='right')
    table.add_column('verdict')
    what_if = report.session.overrides and not report.beside
    same, other = ('as it was', 'changes') if what_if else ('equal', 'differs')
    for stage in report.asked_stages:
        mark = same if stage.agrees else f'[red]{other}[/red]'
        if not stage.checked:
            mark = 'not compared' if stage.notes else 'none in the bag'
        elif stage.agrees_in_bytes:
            mark = 'equal byte for byte'
        table.add_row(stage.name, str(stage.checked), str(stage.equal), mark)
    return table


def to_junit(report: ReplayReport) -> str:
    """One test suite, named by the bag."""
    bag, stages = report.session.bag.path.name, report.asked_stages
    failures = sum(not stage.agrees for stage in stages)
    suite = ET.Element('testsuite', {
        'name': f'replay {bag}', 'tests': str(len(stages)), 'failures': str(failures), 'errors': '0',
        'skipped': str(sum(not stage.checked for stage in stages)), 'time': f'{report.seconds:.3f}',
    })  # fmt: skip
    for stage in stages:
        case = ET.SubElement(suite, 'testcase', {'classname': f'replay.{bag}', 'name': stage.name, 'time': '0'})
        if not stage.agrees:
            wrong = f'{stage.checked - stage.equal} of {stage.checked} differ'
            ET.SubElement(case, 'failure', {'message': stage.difference, 'type': 'difference'}).text = wrong
        elif not stage.checked:
            ET.SubElement(case, 'skipped', {'message': 'none in the bag'})
        if stage.notes:
            ET.SubElement(case, 'system-out').text = '\n'.join(stage.notes)
    ET.SubElement(suite, 'system-out').text = f'{report.asked}\n{report.byte_verdict}\n{report.verdict}'
    suites = ET.Element('testsuites')
    suites.append(suite)
    ET.indent(suites)
    return ET.tostring(suites, encoding='unicode', xml_declaration=True) + '\n'

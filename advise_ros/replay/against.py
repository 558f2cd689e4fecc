"""Whether a session decides as a baseline did: another bag, or the JSON that an earlier replay wrote."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from advise_ros.core.errors import InputError
from advise_ros.replay.check import check
from advise_ros.replay.decisions import Decision, first_change
from advise_ros.replay.report import ReplayReport
from advise_ros.replay.stage import Stage

# These follow from positions: they can be compared only where those are the same.
OF_POSITIONS = ('commands', 'flight statuses')
STAGES = ('demonstrations', 'policies', 'queries', *OF_POSITIONS)


class Baseline(NamedTuple):
    """What is to be reached again: the decisions of each stage, and the positions that they rest on."""

    name: str
    inputs: str
    decisions: Mapping[str, list[Decision]]


def load_baseline(path: str | Path, namespace: str | None = None) -> Baseline:
    """A baseline: of a bag what it says was published, of a JSON file what was rebuilt then.

    Raises:
        InputError: it is neither, or as `check`.
    """
    if Path(path).suffix != '.json':
        report = check(path, namespace)
        return Baseline(str(path), report.inputs, report.rebuilt.recorded)
    try:
        values = json.loads(Path(path).read_text(encoding='utf-8'))
        return Baseline(str(path), str(values['inputs']), _checked(values['decisions']))
    except OSError as problem:
        raise InputError(f'baseline {path} cannot be read ({problem.strerror}); name a bag or a file by replay --json') from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f'baseline {path} is not by replay --json; name a bag or such a file') from None


def _checked(decisions: Any) -> dict[str, list[Decision]]:
    if not all(isinstance(one, dict) for found in decisions.values() for one in found):
        raise TypeError('no decisions')
    return dict(decisions)


def against(report: ReplayReport, baseline: Baseline) -> tuple[Stage, ...]:
    """Stage by stage, what was rebuilt beside the baseline; times do not count."""
    same_inputs = report.inputs == baseline.inputs
    found = []
    for name in STAGES:
        stage = Stage(f'{name} as in the baseline')
        if name in OF_POSITIONS and not same_inputs:
            stage.notes.append(f'{name} were not compared: the positions are not those of the baseline')
        else:
            _compare(stage, name, report.rebuilt.decisions.get(name, []), baseline.decisions.get(name, []))
        found.append(stage)
    return tuple(found)


def _compare(stage: Stage, name: str, new: list[Decision], old: list[Decision]) -> None:
    for number, (one, other) in enumerate(zip_longest(new, old), start=1):
        if one is None or other is None:
            stage.count(f'number {number} of the {name} is {"missing" if one is None else "one more than in the baseline"}')
        else:
            change = first_change(one, other)
            stage.count(f'number {number} of the {name}: {change}'.replace(' would be ', ' is ') if change else '')

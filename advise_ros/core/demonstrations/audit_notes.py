"""What a recorder says in a demonstration's audit beyond what its samples tell."""

from __future__ import annotations

from dataclasses import replace

from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.grid.grid import Grid

BEGINNING_UNHEARD = (
    'the climb to the route was not heard: the vehicle may have been on its way already, '
    'and waypoints that it had reached are expected once more'
)
TAKEN_BACK = 'taken back: discarded after it was published'


def beginning_unheard(found: Demonstration) -> Demonstration:
    """The demonstration with a note that its climb was not heard."""
    return replace(found, audit=replace(found.audit, notes=(BEGINNING_UNHEARD, *found.audit.notes)))


def taken_back(demonstration_id: str, source: str, grid: Grid, now_ns: int) -> Demonstration:
    """What takes an earlier demonstration back: its id and no moves."""
    audit = Audit(notes=(TAKEN_BACK,))
    return Demonstration(demonstration_id, source, grid, (), (), (), (now_ns, now_ns), EndReason.STOPPED, audit)

"""Which of several vehicles in a recording fly: those that climb; one that stands has positions, too."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

# Who climbs less than this share of what the one that climbs most does, stands.
FLYING_SHARE = 0.5

ItemT = TypeVar('ItemT')


def those_that_fly(vehicles: Sequence[ItemT], climb_m: Callable[[ItemT], float]) -> list[ItemT]:
    """Some of the vehicles, in their order.

    Args:
        vehicles: at least one.
        climb_m: the highest position of a vehicle less the lowest.
    """
    highest_m = max(map(climb_m, vehicles))
    return [one for one in vehicles if climb_m(one) >= FLYING_SHARE * highest_m]

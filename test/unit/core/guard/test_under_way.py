"""What is on its way to the vehicle, by the questions that it answered, counts before the fence."""

from __future__ import annotations

import pytest

from advise_ros.core.guard.fence import Braking, box
from advise_ros.core.guard.flown_path import FLOWN_ON_S, FlownPath
from advise_ros.core.guard.return_inside import SPEED_M_S, ReturnInside
from advise_ros.core.guard.rules import GuardVerdict, Limits, held_back
from advise_ros.core.units import ZERO, Vector
from support.guarded_flight import BOUND_M, episode

LIMITS = Limits(fence=box((0.0, 0.0, 2.0), (12.0, 12.0, 8.0)))
WANTED = GuardVerdict((1.0, 0.5, -0.5), 0.1, '')


def test_commands_before_an_answered_question_are_not_under_way_any_more() -> None:
    path = FlownPath()
    path.add((1.0, 0.0, 0.0), 10.0)
    path.add((2.0, 0.0, 0.0), 11.0)
    assert path.under_way(12.0) == ZERO, 'a vehicle that answers nothing'
    path.answered(11.0)
    assert path.under_way(12.0) == pytest.approx((2.0 + 2.0 * FLOWN_ON_S, 0.0, 0.0))
    path.answered(9.0)
    assert path.under_way(12.0) == pytest.approx((2.0 + 2.0 * FLOWN_ON_S, 0.0, 0.0)), 'an answer that was overtaken'


def test_nothing_under_way_or_far_from_the_fence_changes_nothing() -> None:
    assert held_back(WANTED, (6.0, 6.0, 5.0), ZERO, LIMITS) == WANTED
    assert held_back(WANTED, (6.0, 6.0, 5.0), (0.3, 0.2, -0.2), LIMITS) == WANTED


@pytest.mark.parametrize(('under_way', 'flown'), [
    ((7.0, 0.0, 0.0), (0.0, 0.0, -0.5)), ((0.0, 0.0, -4.0), (1.0, 0.5, 0.0)), ((7.0, 0.0, -4.0), ZERO),
])
def test_nothing_is_added_to_what_leads_out_already(under_way: Vector, flown: Vector) -> None:
    verdict = held_back(WANTED, (6.0, 6.0, 5.0), under_way, LIMITS)
    assert verdict.velocity_enu_m_s == pytest.approx(flown)
    assert 'on its way to the vehicle' in verdict.reason


def test_the_less_room_is_left_by_what_is_under_way_the_slower_it_is() -> None:
    speeds = [held_back(GuardVerdict((3.0, 0.0, 0.0), 0.0, ''), (6.0, 6.0, 5.0), (east, 0.0, 0.0), LIMITS).velocity_enu_m_s[0]
              for east in (1.0, 3.0, 5.0, 5.5)]
    assert speeds == sorted(speeds, reverse=True) and len(set(speeds)) == len(speeds)


@pytest.mark.parametrize('high_m', [2.2, 3.0, 12.0])
@pytest.mark.parametrize('reaction_s', [1.1, 8.0])
def test_the_way_back_in_height_stops_before_the_other_side(high_m: float, reaction_s: float) -> None:
    back = ReturnInside(box((0.0, 0.0, 2.0), (12.0, 12.0, high_m)))
    for beyond, sign in ((1.5, 1.0), (high_m + 0.5, -1.0)):
        velocity = back.velocity((6.0, 6.0, beyond), Braking(2.0, reaction_s))
        assert velocity is not None
        assert 0.0 < sign * velocity[2] <= SPEED_M_S
        assert abs(velocity[2]) * reaction_s + velocity[2] ** 2 / 4.0 <= high_m - 2.0 + 1e-9


@pytest.mark.parametrize('number', [131, 132, 165, 5147])
def test_what_once_led_out_does_so_no_more(number: int) -> None:
    """Commands that come after a pause of 3.5 s (5147) and by jitter (131); a position that jumped away and back (132, 165)."""
    flight = episode(0, number, troubled=True)
    assert flight.fly(40.0) <= BOUND_M

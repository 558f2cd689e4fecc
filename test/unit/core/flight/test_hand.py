"""The stick of a person: dead man's rule, diagonals, late input."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from advise_ros.core.flight.hand import FRESH_S, HOLD_S, HandStick, along_one_axis
from advise_ros.core.units import ZERO, Vector

ways = st.floats(-1.0, 1.0)


def moved(*stick: float) -> HandStick:
    hand = HandStick(2.0, 0.5)
    assert hand.move((stick[0], stick[1], stick[2]), sent_s=7.0, now_s=100.0)
    return hand


@pytest.mark.parametrize(('stick', 'velocity'), [
    ((1.0, 0.0, 0.0), (2.0, 0.0, 0.0)),
    ((0.5, -0.9, 0.0), (0.0, -1.8, 0.0)),
    ((-0.9, 0.5, 1.0), (-1.8, 0.0, 0.5)),
    ((0.7, 0.7, 0.0), (0.0, 1.4, 0.0)),  # Of two alike the earlier direction, NORTH.
    ((5.0, 0.0, -5.0), (2.0, 0.0, -0.5)),
    ((0.1, -0.1, 0.1), ZERO),
])
def test_a_stick_is_a_velocity_along_one_axis(stick: Vector, velocity: Vector) -> None:
    assert (moved(*stick).velocity(100.1) or ZERO) == pytest.approx(velocity)


@given(ways, ways)
def test_one_axis_is_left_and_never_more_of_it(east: float, north: float) -> None:
    found = along_one_axis(east, north)
    assert 0.0 in found
    assert max(map(abs, found)) == max(abs(east), abs(north))


def test_without_fresh_input_it_stands_and_then_commands_nothing() -> None:
    hand = moved(1.0, 0.0, 0.0)
    assert hand.velocity(100.0 + FRESH_S) == (2.0, 0.0, 0.0)
    assert hand.velocity(100.0 + FRESH_S + 0.01) == ZERO
    assert hand.velocity(100.0 + FRESH_S + HOLD_S) == ZERO
    assert hand.velocity(100.0 + FRESH_S + HOLD_S + 0.01) is None


def test_let_go_is_zero_at_once() -> None:
    hand = moved(1.0, 0.0, 0.0)
    hand.velocity(100.0)
    hand.let_go()
    assert hand.velocity(100.05) == ZERO


def test_a_stick_at_rest_commands_nothing() -> None:
    assert moved(0.0, 0.0, 0.0).velocity(100.0) is None


def test_what_was_on_its_way_for_too_long_is_not_used() -> None:
    hand = moved(0.0, 0.0, 0.0)
    assert not hand.move((1.0, 0.0, 0.0), sent_s=8.0, now_s=101.0 + FRESH_S + 0.01)
    assert hand.velocity(101.4) is None
    assert hand.move((1.0, 0.0, 0.0), sent_s=9.0, now_s=102.0 + FRESH_S)


@pytest.mark.parametrize('bad', [(math.nan, 0.0, 0.0), (0.0, math.inf, 0.0)])
def test_what_is_no_number_is_not_used(bad: Vector) -> None:
    assert not HandStick(1.0, 1.0).move(bad, sent_s=0.0, now_s=1.0)
    assert not HandStick(1.0, 1.0).move(ZERO, sent_s=math.nan, now_s=1.0)

"""NED <-> ENU and FRD <-> FLU."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from advise_ros.core.units import Vector
from advise_ros.mavlink import frames

number = st.floats(-1e6, 1e6)
vectors = st.tuples(number, number, number)
angles = st.floats(-10.0, 10.0)


def test_axes() -> None:
    assert frames.enu_from_ned((1.0, 2.0, 3.0)) == (2.0, 1.0, -3.0)
    assert frames.flu_from_frd((1.0, 2.0, 3.0)) == (1.0, -2.0, -3.0)


@pytest.mark.parametrize(('ned_deg', 'enu_deg'), [(0, 90), (90, 0), (180, -90), (270, -180), (45, 45)])
def test_headings(ned_deg: float, enu_deg: float) -> None:
    turned = math.degrees(frames.yaw_enu_from_ned(math.radians(ned_deg)))
    assert math.isclose((turned - enu_deg + 180) % 360, 180, abs_tol=1e-9)


@given(vectors)
def test_there_and_back(vector: Vector) -> None:
    assert frames.ned_from_enu(frames.enu_from_ned(vector)) == vector
    assert frames.flu_from_frd(frames.flu_from_frd(vector)) == vector


@given(vectors)
def test_turning_frames_keeps_lengths(vector: Vector) -> None:
    assert math.isclose(math.hypot(*frames.enu_from_ned(vector)), math.hypot(*vector))


@given(angles)
def test_yaw_there_and_back(yaw_rad: float) -> None:
    back = frames.yaw_enu_from_ned(frames.yaw_enu_from_ned(yaw_rad))
    assert math.isclose(math.cos(back - yaw_rad), 1.0, abs_tol=1e-12)
    assert -math.pi <= back < math.pi


@given(angles, angles)
def test_yaw_and_its_rate_turn_the_same_way(yaw_rad: float, rate_rad_s: float) -> None:
    dt_s = 1e-3
    change = frames.yaw_enu_from_ned(yaw_rad + rate_rad_s * dt_s) - frames.yaw_enu_from_ned(yaw_rad)
    wanted = frames.yaw_rate_enu_from_ned(rate_rad_s) * dt_s
    assert math.isclose(frames.wrap_rad(change), wanted, abs_tol=1e-9)


@given(yaw_rad=angles)
def test_yaw_agrees_with_the_vector_it_points_along(yaw_rad: float) -> None:
    nose_enu = frames.enu_from_ned((math.cos(yaw_rad), math.sin(yaw_rad), 0.0))
    turned = frames.yaw_enu_from_ned(yaw_rad)
    assert nose_enu[:2] == pytest.approx((math.cos(turned), math.sin(turned)), abs=1e-9)

"""Outside its fence the vehicle is brought back inside, also when nobody commands; a stop means stand still."""

from __future__ import annotations

import math

import numpy as np
import pytest

from advise_ros.core.guard.fence import Fence, box, corners_from_text, outside_m
from advise_ros.core.guard.flown_path import FlownPath
from advise_ros.core.guard.monitor import GuardMonitor, MonitorSettings
from advise_ros.core.guard.return_inside import MARGIN_M, SPEED_M_S
from advise_ros.core.guard.rules import Command, Limits
from advise_ros.core.units import ZERO, Vector

TICK_S = 0.05
FENCE = box((0.0, 0.0, 2.0), (12.0, 12.0, 8.0))
NS = 10**9


class Drifter:
    """A vehicle that obeys at once and drifts; poses at 20 Hz that arrive later by `late_s`.

    Attributes:
        conditions: of the guard, each change.
        furthest_m: out of the fence in plan.
    """

    def __init__(self, at: Vector, fence: Fence = FENCE, **settings: object) -> None:
        self.at, self.fence = np.array(at), fence
        self.guard = GuardMonitor(Limits(fence=fence), MonitorSettings(**settings))  # type: ignore[arg-type]
        self.now_s, self.late_s, self.conditions, self.furthest_m = 100.0, 0.0, [''], 0.0
        self.flown: Vector | None = None
        self._poses: list[tuple[float, float, Vector]] = []

    def run(self, seconds: float, drift: Vector = ZERO, command: Vector | None = None) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            self._poses.append((self.now_s + self.late_s, self.now_s, tuple(float(value) for value in self.at)))  # type: ignore[arg-type]
            while self._poses and self._poses[0][0] <= self.now_s:
                at_s, stamp_s, at = self._poses.pop(0)
                self.guard.pose(at, 'map', max(at_s, self.now_s - TICK_S), stamp_ns=round(stamp_s * NS))
            if command is not None:
                self.guard.command(Command(command, 'map', 0.0), self.now_s)
            verdict = self.guard.verdict(self.now_s)
            self.flown = None if verdict is None else verdict.velocity_enu_m_s
            if self.guard.condition != self.conditions[-1]:
                self.conditions.append(self.guard.condition)
            self.at = self.at + TICK_S * (np.array(self.flown or ZERO) + np.array(drift))
            self.furthest_m = max(self.furthest_m, outside_m(self.fence, (float(self.at[0]), float(self.at[1]))))


@pytest.mark.parametrize('at', [(13.0, 6.0, 5.0), (13.0, 13.0, 5.0), (-0.2, 11.9, 5.0)])
def test_who_is_outside_is_brought_back_without_any_command_and_then_stands(at: Vector) -> None:
    vehicle = Drifter(at)
    vehicle.run(15.0)
    assert outside_m(FENCE, (vehicle.at[0], vehicle.at[1])) == 0.0
    assert min(vehicle.at[0], vehicle.at[1], 12.0 - vehicle.at[0], 12.0 - vehicle.at[1]) == pytest.approx(MARGIN_M, abs=0.05)
    assert vehicle.flown == ZERO
    assert vehicle.conditions == ['', 'return', 'silence']


def test_it_is_brought_slowly_and_by_the_shortest_way_and_says_so() -> None:
    vehicle = Drifter((14.0, 6.0, 5.0))
    vehicle.run(1.0)
    assert vehicle.flown == pytest.approx((-SPEED_M_S, 0.0, 0.0))
    verdict = vehicle.guard.verdict(vehicle.now_s)
    assert verdict is not None
    assert verdict.reason == 'outside the fence (1.5 m in plan): it is brought back inside'


@pytest.mark.parametrize('drift', [(0.3, 0.0, 0.0), (0.2, 0.2, 0.0), (-0.3, 0.0, 0.0)])
def test_who_drifts_out_while_nobody_commands_stays_within_a_hands_breadth(drift: Vector) -> None:
    vehicle = Drifter((11.0, 6.0, 5.0))
    vehicle.run(120.0, drift)
    assert vehicle.furthest_m < 0.1


def test_a_command_back_in_that_is_faster_is_flown_and_one_that_leads_out_is_not() -> None:
    vehicle = Drifter((14.0, 6.0, 5.0))
    vehicle.run(0.5, command=(-1.0, 0.0, 0.0))
    assert vehicle.flown == pytest.approx((-1.0, 0.0, 0.0))
    assert vehicle.guard.condition == 'limited'
    vehicle.run(0.5, command=(1.0, 1.0, 0.0))
    assert vehicle.flown == pytest.approx((-SPEED_M_S, 0.0, 0.0))
    vehicle.run(20.0, command=(1.0, 0.0, 0.0))
    assert vehicle.at[0] <= 12.05


def test_a_persons_stop_means_stand_still() -> None:
    vehicle = Drifter((14.0, 6.0, 5.0))
    vehicle.run(0.5)
    vehicle.guard.stop('somebody asked for it')
    vehicle.run(5.0)
    assert vehicle.flown == ZERO
    assert not vehicle.guard.returning
    vehicle.guard.release()
    vehicle.run(0.5)
    assert vehicle.flown == pytest.approx((-SPEED_M_S, 0.0, 0.0))


def test_it_can_be_turned_off() -> None:
    vehicle = Drifter((14.0, 6.0, 5.0), return_inside=False)
    vehicle.run(1.0)
    assert vehicle.flown is None
    vehicle.run(1.0, command=(1.0, 0.0, 0.0))
    assert vehicle.flown == ZERO


def test_a_position_that_is_doubted_brings_nothing_back() -> None:
    vehicle = Drifter((14.0, 6.0, 5.0))
    vehicle.run(0.5)
    vehicle.guard.pose((14.0, 6.0, 5.0), 'map', vehicle.now_s, doubt='the GPS has lost its fix')
    verdict = vehicle.guard.verdict(vehicle.now_s)
    assert verdict is not None
    assert verdict.velocity_enu_m_s == ZERO


def test_a_position_that_jumped_outside_is_flown_back_by_a_person_only() -> None:
    vehicle = Drifter((6.0, 6.0, 5.0))
    vehicle.run(1.0, command=ZERO)
    vehicle.at += (11.0, 0.0, 0.0)
    vehicle.run(5.0, command=ZERO)
    assert vehicle.flown == ZERO
    verdict = vehicle.guard.verdict(vehicle.now_s)
    assert verdict is not None
    assert verdict.reason.endswith('it is not brought back inside, as it jumped 11.0 m: fly it back, or release')
    vehicle.run(0.5, command=(-1.0, 0.0, 0.0))
    assert vehicle.flown == pytest.approx((-1.0, 0.0, 0.0))
    assert vehicle.guard.release() == 'it jumped 11.0 m'
    vehicle.run(1.0)
    assert vehicle.flown == pytest.approx((-SPEED_M_S, 0.0, 0.0))


@pytest.mark.parametrize('lasting_s', [0.2, 3.0])
def test_where_a_position_jumped_back_it_is_brought_inside_as_before(lasting_s: float) -> None:
    vehicle = Drifter((11.9, 6.0, 5.0))
    vehicle.run(1.0, command=ZERO)
    vehicle.at += (11.0, 0.0, 0.0)
    vehicle.run(lasting_s, command=ZERO)
    vehicle.at += (-10.7, 0.0, 0.0)  # It has drifted over the border meanwhile.
    vehicle.run(5.0, command=ZERO)
    assert vehicle.conditions[-2:] == ['return', '']
    assert vehicle.at[0] < 12.0


def test_a_jump_that_a_silence_hid_is_known_by_the_way_back() -> None:
    """What is believed is where it was for a second, not where it seemed to be for an instant."""
    vehicle = Drifter((11.9, 6.0, 5.0))
    vehicle.run(2.0, command=ZERO)
    vehicle.now_s += 1.5
    vehicle.at += (11.0, 0.0, 0.0)
    vehicle.run(0.3, command=ZERO)
    vehicle.at += (-10.7, 0.0, 0.0)
    vehicle.run(5.0, command=ZERO)
    assert vehicle.conditions[-2:] == ['return', '']
    assert vehicle.at[0] < 12.0


def test_from_above_it_sinks_and_what_may_stand_on_the_ground_is_not_lifted() -> None:
    high, low, flying = Drifter((6.0, 6.0, 9.0)), Drifter((6.0, 6.0, 0.0)), Drifter((6.0, 6.0, 1.0), lifts=True)
    for vehicle in (high, low, flying):
        vehicle.run(10.0)
    assert high.at[2] == pytest.approx(8.0 - MARGIN_M, abs=0.05)
    assert low.flown is None
    assert flying.at[2] == pytest.approx(2.0 + MARGIN_M, abs=0.05)


@pytest.mark.parametrize('corners', ['0,0 10,0 10,5', '0,0 10,0 10,0.3 0,0.3', '0,0 12,0 12,6 6,6 6,12 0,12'])
@pytest.mark.parametrize('at', [(-0.1, 0.15), (11.0, 0.2), (5.0, -1.0), (7.0, 7.0)])
def test_in_any_fence_it_ends_inside_and_stands(corners: str, at: tuple[float, float]) -> None:
    vehicle = Drifter((*at, 5.0), Fence(corners_from_text(corners), 2.0, 8.0))
    if outside_m(vehicle.fence, at) == 0.0:
        vehicle.at[:2] += 20.0
    vehicle.run(60.0)
    assert outside_m(vehicle.fence, (float(vehicle.at[0]), float(vehicle.at[1]))) == 0.0
    assert vehicle.flown == ZERO
    assert vehicle.conditions == ['', 'return', 'silence']


@pytest.mark.parametrize('late_s', [1.0, 4.0, 10.0])
def test_late_positions_bring_it_back_by_where_it_is_now_and_earlier(late_s: float) -> None:
    """What was commanded meanwhile is counted: it stops inside, and does not swing from side to side."""
    vehicle = Drifter((9.0, 6.0, 5.0))
    vehicle.run(2.0)
    vehicle.late_s = late_s
    vehicle.run(200.0, drift=(0.3, 0.0, 0.0))
    assert vehicle.furthest_m < 0.3
    assert 'return' in vehicle.conditions
    vehicle.furthest_m = 0.0
    vehicle.at[0] = 12.5
    vehicle.run(60.0)
    assert 3.0 < vehicle.at[0] < 12.0
    assert vehicle.flown == ZERO


def test_late_positions_are_flown_by_no_command() -> None:
    vehicle = Drifter((6.0, 6.0, 5.0))
    vehicle.run(2.0, command=(0.2, 0.0, 0.0))
    assert vehicle.flown == (0.2, 0.0, 0.0)
    vehicle.late_s = 2.0
    vehicle.run(4.0, command=(0.2, 0.0, 0.0))
    assert vehicle.flown == ZERO
    verdict = vehicle.guard.verdict(vehicle.now_s)
    assert verdict is not None
    assert verdict.reason == 'pose refused: it came 2.0 s late (if the autopilot was paused: release)'
    vehicle.late_s = 0.0
    vehicle._poses.clear()
    vehicle.run(2.0, command=(0.2, 0.0, 0.0))
    assert vehicle.flown == (0.2, 0.0, 0.0)


def test_after_a_pause_a_release_or_an_answered_question_ends_the_doubt() -> None:
    for asks in (True, False):
        vehicle = Drifter((6.0, 6.0, 5.0))
        vehicle.run(2.0, command=(0.2, 0.0, 0.0))
        vehicle.guard.pose((6.0, 6.0, 5.0), 'map', vehicle.now_s + 3.1, stamp_ns=round((vehicle.now_s + 0.1) * NS))
        vehicle.guard.command(Command((0.2, 0.0, 0.0), 'map', 0.0), vehicle.now_s + 3.1)
        verdict = vehicle.guard.verdict(vehicle.now_s + 3.1)
        assert verdict is not None
        assert verdict.velocity_enu_m_s == ZERO
        at_s = vehicle.now_s + 3.2
        if asks:
            vehicle.guard.clock_bounds(3.0 - 0.005, 3.0 + 0.005, at_s)
        else:
            assert vehicle.guard.release().startswith('it came 3.0 s late')
        vehicle.guard.pose((6.0, 6.0, 5.0), 'map', at_s, stamp_ns=round((at_s - 3.0) * NS))
        vehicle.guard.command(Command((0.2, 0.0, 0.0), 'map', 0.0), at_s)
        verdict = vehicle.guard.verdict(at_s)
        assert verdict is not None
        assert verdict.velocity_enu_m_s == pytest.approx((0.2, 0.0, 0.0))


def test_late_commands_make_it_slower_before_the_fence() -> None:
    speeds = []
    for up_s in (0.0, 2.0):
        vehicle = Drifter((8.0, 6.0, 5.0))
        vehicle.guard.uplink(up_s)
        vehicle.run(0.3, command=(3.0, 0.0, 0.0))
        assert vehicle.flown is not None
        speeds.append(vehicle.flown[0])
    assert speeds[1] < 0.6 * speeds[0]


def test_the_path_flown_is_remembered_as_long_as_it_is_needed() -> None:
    path = FlownPath()
    assert path.since(0.0, 1.0) == ZERO
    for tick in range(4000):
        path.add((1.0, 0.0, -0.5) if tick % 2 else ZERO, 0.05 * tick)
    moved = path.since(170.0, 200.0)
    assert moved == pytest.approx((15.0, 0.0, -7.5), abs=0.1)
    assert len(path._times_s) <= 1201
    assert math.isfinite(path.reached(200.0)[0])

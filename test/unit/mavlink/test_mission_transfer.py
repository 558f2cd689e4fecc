"""Missions onto simulated autopilots with the manners of the real ones, over links that lose, repeat and delay."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from advise_ros.mavlink.messages import dialect
from advise_ros.mavlink.mission_transfer import RETRY_S, TRIES, MissionTransfer, Phase, WireItem
from advise_ros.sim.arducopter import ArduCopter
from advise_ros.sim.px4 import SimulatedPx4
from support.sim_companion import Companion

RELATIVE, WAYPOINT, TAKE_OFF = 3, 16, 22
ITEMS = [
    WireItem(0, WAYPOINT, 473977000, 85456000, 0.0), WireItem(RELATIVE, TAKE_OFF, 473977000, 85456000, 6.0),
    WireItem(RELATIVE, WAYPOINT, 473977420, 85456123, 6.0), WireItem(RELATIVE, WAYPOINT, -473977001, -85456999, 6.125),
    WireItem(RELATIVE, WAYPOINT, 473977000, 85456000, 6.0),
]
KINDS = {'ardupilot': ArduCopter, 'px4': SimulatedPx4}
TURN_S = 0.1
GROUND = (255, 190)


class Line:
    """Both ends, and a link that loses and repeats messages in both directions; time passes by the turn."""

    def __init__(self, kind: str, loss: float = 0.0, seed: int = 0) -> None:
        self.peer = Companion(dialect=KINDS[kind])
        self.now_s = 0.0
        self._loss, self._rng = loss, np.random.default_rng(seed)

    def _times(self) -> int:
        return int(self._rng.choice([0, 1, 2], p=[self._loss, 1.0 - 1.5 * self._loss, self._loss / 2]))

    def serve(self, transfer: MissionTransfer, turns: int = 3000, until: Any = lambda transfer: False) -> MissionTransfer:
        for _ in range(turns):
            for message in transfer.step(self.now_s):
                for reply in [one for _ in range(self._times()) for one in self.peer.say(message, GROUND)]:
                    self.deliver(transfer, reply)
            if transfer.over or until(transfer):
                break
            self.wait(TURN_S)
        return transfer

    def deliver(self, transfer: MissionTransfer, reply: Any) -> None:
        """Over the codec, from the autopilot."""
        wire = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        for _ in range(self._times()):
            transfer.observe(dialect.MAVLink(None).decode(bytearray(reply.pack(wire))))

    def wait(self, seconds: float) -> None:
        self.now_s += seconds
        self.peer.run(seconds)


def transfer(kind: str, items: list[WireItem] = ITEMS) -> MissionTransfer:
    return MissionTransfer((1, 1), GROUND, items, own_first=kind == 'ardupilot')


@pytest.mark.parametrize('kind', KINDS)
def test_a_mission_arrives_and_is_read_back(kind: str) -> None:
    line = Line(kind)
    done = line.serve(transfer(kind))
    assert (done.phase, done.failure, done.sent) == (Phase.DONE, '', len(ITEMS))
    assert line.now_s < RETRY_S, 'nothing had to be sent twice'


@pytest.mark.parametrize('seed', range(20))
@pytest.mark.parametrize('kind', KINDS)
def test_over_a_link_that_loses_a_fifth_it_arrives_whole_or_is_said_not_to(kind: str, seed: int) -> None:
    line = Line(kind, loss=0.2, seed=seed)
    done = line.serve(transfer(kind))
    kept = line.serve(transfer(kind)) if done.failure else done  # What people do then: again.
    assert kept.phase is Phase.DONE, (done.failure, kept.failure)


@pytest.mark.parametrize('kind', KINDS)
def test_half_an_earlier_upload_is_never_taken_for_the_new_one(kind: str) -> None:
    line = Line(kind)
    line.serve(transfer(kind, ITEMS[:3]), until=lambda one: one.sent == 1)  # Given up after its first item.
    line.wait(20.0)
    first = line.serve(transfer(kind))
    if kind == 'px4':  # It keeps the count of the abandoned one, accepts, and has three of five.
        assert first.failure == 'it says that it has 3 items, not the 5 that were sent; try again'
        first = line.serve(transfer(kind))
    assert first.phase is Phase.DONE


@pytest.mark.parametrize('kind', KINDS)
def test_while_somebody_else_uploads_it_is_refused(kind: str) -> None:
    line = Line(kind)
    other = dialect.MAVLink_mission_count_message(1, 1, 9, 0)
    mine = transfer(kind)
    line.serve(mine, until=lambda one: one.phase is Phase.SEND)
    line.peer.say(other, (254, 190))
    done = line.serve(mine)
    assert done.phase is Phase.FAILED and 'denied' in done.failure


def test_what_comes_back_otherwise_is_no_success() -> None:
    line = Line('ardupilot')
    wrong = [*ITEMS[:2], WireItem(1, WAYPOINT, 1, 2, 3.0)]
    assert 'refuses item 3 of 3 (unsupported_frame)' in line.serve(transfer('ardupilot', wrong)).failure
    line = Line('px4')
    done = line.serve(transfer('px4'), until=lambda one: one.phase is Phase.READ)
    bad = dialect.MAVLink_mission_item_int_message(255, 190, 0, 0, WAYPOINT, 0, 1, 0, 0, 0, 0, 473977000, 85456009, 0.0, 0)
    line.deliver(done, bad)
    assert done.phase is Phase.FAILED and 'do not fly it' in done.failure


def test_what_another_ground_station_is_told_is_not_ours() -> None:
    line = Line('px4')
    mine = line.serve(transfer('px4'), until=lambda one: one.phase is Phase.READ)
    read = dialect.MAVLink_mission_item_int_message(254, 190, 0, 0, WAYPOINT, 0, 1, 0, 0, 0, 0, 473977000, 85456009, 0.0, 0)
    line.deliver(mine, read)
    line.deliver(mine, dialect.MAVLink_mission_ack_message(254, 190, dialect.MAV_MISSION_DENIED))
    assert mine.phase is Phase.READ
    assert line.serve(mine).phase is Phase.DONE


def test_without_a_reply_it_ends_and_says_what_did_not_come() -> None:
    line = Line('px4', loss=0.66)
    silent = MissionTransfer((1, 1), GROUND, ITEMS, own_first=False)
    turns = 0
    while not silent.over:
        silent.step(line.now_s)
        line.now_s += TURN_S
        turns += 1
    assert 'the clearing of its mission did not come' in silent.failure and str(TRIES) in silent.failure
    assert turns * TURN_S == pytest.approx(RETRY_S * TRIES, abs=1.0)


def test_messages_of_others_and_of_the_fence_are_passed_over() -> None:
    one = transfer('px4')
    one.step(0.0)
    wire = dialect.MAVLink(None, srcSystem=2, srcComponent=1)
    stranger = dialect.MAVLink(None).decode(bytearray(dialect.MAVLink_mission_ack_message(255, 190, 0, 0).pack(wire)))
    one.observe(stranger)
    wire = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    fence = dialect.MAVLink(None).decode(bytearray(dialect.MAVLink_mission_ack_message(255, 190, 0, 1).pack(wire)))
    one.observe(fence)
    assert one.phase is Phase.CLEAR

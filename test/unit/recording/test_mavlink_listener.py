"""What the recorder takes from a MAVLink link that others share."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from advise_ros.core.demonstrations.known_states import unknown
from advise_ros.core.demonstrations.samples import VehicleEvent
from advise_ros.mavlink.link import Received
from advise_ros.mavlink.messages import Message, dialect
from advise_ros.recording.mavlink_listener import MavlinkListener

SYSTEM = 7


class MockLink:
    """A link on which the listed messages have arrived."""

    def __init__(self, *messages: Message) -> None:
        self.arrived = [Received(message, 0.0, None) for message in messages]
        self.sent: list[Message] = []

    def poll(self) -> list[Received]:
        arrived, self.arrived = self.arrived, []
        return arrived

    def send(self, message: Message) -> bool:
        self.sent.append(message)
        return True

    def answer_to(self, source: object) -> None:
        """There is one peer."""


class Taken(NamedTuple):
    """A recorder that keeps what it is given."""

    events: list[VehicleEvent]
    poses: list[tuple[int, tuple[float, float, float]]]

    def vehicle(self, event: VehicleEvent) -> None:
        self.events.append(event)

    def pose(self, stamp_ns: int, position_enu_m: tuple[float, float, float]) -> None:
        self.poses.append((stamp_ns, position_enu_m))


def of(component: int, message: Message) -> Message:
    message.pack(dialect.MAVLink(None, SYSTEM, component))
    return message


def heartbeat(component: int, kind: int, autopilot: int) -> Message:
    return of(component, dialect.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3))


def position(component: int) -> Message:
    return of(component, dialect.MAVLink_local_position_ned_message(1000, 1.0, 2.0, -3.0, 0.0, 0.0, 0.0))


COPTER = heartbeat(1, dialect.MAV_TYPE_QUADROTOR, dialect.MAV_AUTOPILOT_PX4)


@pytest.mark.parametrize('other', [
    heartbeat(154, dialect.MAV_TYPE_GIMBAL, dialect.MAV_AUTOPILOT_GENERIC),
    heartbeat(100, dialect.MAV_TYPE_CAMERA, dialect.MAV_AUTOPILOT_RESERVED),
    heartbeat(154, dialect.MAV_TYPE_GIMBAL, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA),
    heartbeat(190, dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID),
])
def test_the_vehicle_is_the_multicopter_whatever_else_names_an_autopilot(other: Message) -> None:
    taken, link = Taken([], []), MockLink(other, COPTER, position(1), position(other.get_srcComponent()))
    listener = MavlinkListener(link, taken, simulated=True)  # type: ignore[arg-type]
    listener.poll(1_000_000_000, 0.0)
    listener.poll(11_000_000_000, 10.0)  # No position has come for long: they are asked for.
    assert listener.vehicle == (SYSTEM, 1)
    assert [position_m for _, position_m in taken.poses] == [(2.0, 1.0, 3.0)]
    assert {message.target_component for message in link.sent} == {1}


def test_a_state_that_is_not_repeated_is_not_known_any_more() -> None:
    """As in a recording: the altitude decides from then on."""
    taken, link = Taken([], []), MockLink(COPTER)
    listener = MavlinkListener(link, taken, simulated=True)  # type: ignore[arg-type]
    listener.poll(1_000_000_000, 0.0)
    for second in range(1, 9):
        message = of(1, dialect.MAVLink_local_position_ned_message(1000 * second, 1.0, 2.0, -3.0, 0.0, 0.0, 0.0))
        link.arrived = [Received(message, float(second), None)]
        listener.poll((1 + second) * 1_000_000_000, float(second))
    known, silent = taken.events
    assert known.in_air is None and not known.armed
    assert silent == unknown(7_000_000_000) and silent.armed and silent.in_air is None

"""Live MAVLink -> the recorder: listens beside other links, commands nothing."""

from __future__ import annotations

import math

from advise_ros.core.demonstrations.known_states import SILENCE_NS, unknown
from advise_ros.core.demonstrations.recorder import Recorder
from advise_ros.core.demonstrations.samples import VehicleEvent
from advise_ros.core.units import NS
from advise_ros.mavlink.frames import enu_from_ned
from advise_ros.mavlink.link import Link, Received
from advise_ros.mavlink.messages import (
    EXTENDED_SYS_STATE,
    HEARTBEAT,
    LOCAL_POSITION_NED,
    Message,
    is_multicopter,
    message_interval,
)
from advise_ros.mavlink.stamps import BootOrder, Stamper
from advise_ros.recording.telemetry_frames import SET_POSITION_TARGET_LOCAL_NED
from advise_ros.recording.tlog import after_heartbeat, in_air_from, is_velocity

# The second onboard computer: the first is the bridge.
COMPONENT_ID = 192
POSITION_RATE_HZ, STATE_RATE_HZ = 20.0, 5.0
# An autopilot sends no positions by itself; ask again as long as none come.
ASK_S = 2.0


class MavlinkListener:
    """Positions, setpoints and state of the first multicopter on a link, chosen by its heartbeat as the bridge does.

    Setpoints are seen only where a router passes them on; without them the motion decides the actions.
    """

    def __init__(self, link: Link, recorder: Recorder, *, simulated: bool) -> None:
        self._link, self._recorder = link, recorder
        self._order, self._stamper = BootOrder(), Stamper(simulated=simulated)
        self._known = VehicleEvent(0, False, None)
        self._asked_s = self._position_s = -math.inf
        self._known_s: float | None = None
        self.vehicle: tuple[int, int] | None = None
        self.positions = 0

    def poll(self, now_ns: int, steady_s: float) -> None:
        """Hand on what arrived.

        Args:
            now_ns: the node's clock.
            steady_s: monotonic time.
        """
        for received in self._link.poll():
            self._take(received, now_ns, steady_s)
        if self.vehicle is not None and min(steady_s - self._position_s, steady_s - self._asked_s) > ASK_S:
            self._asked_s = steady_s
            self._link.send(message_interval(self.vehicle, LOCAL_POSITION_NED, POSITION_RATE_HZ))
            self._link.send(message_interval(self.vehicle, EXTENDED_SYS_STATE, STATE_RATE_HZ))

    def _take(self, received: Received, now_ns: int, steady_s: float) -> None:
        message = received.message
        kind, sender = message.get_msgId(), (message.get_srcSystem(), message.get_srcComponent())
        if kind == HEARTBEAT and self.vehicle is None and is_multicopter(message):
            self.vehicle = sender
        if sender == self.vehicle:
            self._link.answer_to(received.source)
            if kind == LOCAL_POSITION_NED:
                self._position_s = steady_s
                self._position(received, now_ns, steady_s)
            elif kind in (HEARTBEAT, EXTENDED_SYS_STATE):
                self._state(message, now_ns)
                self._known_s = steady_s
        elif self.vehicle is not None and kind == SET_POSITION_TARGET_LOCAL_NED:
            self._setpoint(message, now_ns)

    def _position(self, received: Received, now_ns: int, steady_s: float) -> None:
        message = received.message
        if not self._order.is_news(message.time_boot_ms):
            return
        if self._known_s is not None and steady_s - self._known_s > SILENCE_NS / NS:
            self._known_s = None
            self._recorder.vehicle(unknown(now_ns))
        stamp_ns = self._stamper.stamp_ns(message.time_boot_ms, received.at_s, now_ns, steady_s)
        if stamp_ns is not None:
            self.positions += 1
            self._recorder.pose(stamp_ns, enu_from_ned((message.x, message.y, message.z)))

    def _state(self, message: Message, now_ns: int) -> None:
        if message.get_msgId() == HEARTBEAT:
            self._known = after_heartbeat(self._known, message)
        else:
            self._known = self._known._replace(in_air=in_air_from(message.landed_state, self._known.in_air))
        self._recorder.vehicle(self._known._replace(stamp_ns=now_ns))

    def _setpoint(self, message: Message, now_ns: int) -> None:
        if self.vehicle is not None and message.target_system in (0, self.vehicle[0]) and is_velocity(message):
            self._recorder.command(now_ns, enu_from_ned((message.vx, message.vy, message.vz)))

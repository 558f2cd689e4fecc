"""What passes between autopilot and bridge: setpoints, and how the vehicle moves."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, NamedTuple

from advise_ros.mavlink import messages as mav

KEPT = 20_000  # Samples: minutes.
SETPOINT = mav.dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED


class Command(NamedTuple):
    """A setpoint on the wire: when (steady), and its speed."""

    at_s: float
    speed_m_s: float


class Motion(NamedTuple):
    """What the vehicle says of itself: when (steady), speed, and position (east, north, up)."""

    at_s: float
    speed_m_s: float
    position_enu_m: tuple[float, float, float]


class Tap:
    """Setpoints and positions that pass, the newest last; steady receive times. `parameters`: those that were told."""

    def __init__(self) -> None:
        self.commands: deque[Command] = deque(maxlen=KEPT)
        self.motions: deque[Motion] = deque(maxlen=KEPT)
        self.parameters: set[str] = set()

    def __call__(self, direction: str, message: Any, at_s: float) -> None:
        number = message.get_msgId()
        if direction == 'down' and number == SETPOINT:
            self.commands.append(Command(at_s, math.hypot(message.vx, message.vy, message.vz)))
        elif direction == 'up' and number == mav.LOCAL_POSITION_NED:
            speed = math.hypot(message.vx, message.vy, message.vz)
            self.motions.append(Motion(at_s, speed, (message.y, message.x, -message.z)))
        elif direction == 'up' and number == mav.PARAM_VALUE:
            self.parameters.add(message.param_id)

    def commands_since(self, at_s: float) -> list[Command]:
        return [command for command in list(self.commands) if command.at_s >= at_s]

    def motions_since(self, at_s: float) -> list[Motion]:
        return [motion for motion in list(self.motions) if motion.at_s >= at_s]

"""What an autopilot has said of itself so far: facts only, no decisions."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from advise_ros.core.units import Vector
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.frames import enu_from_ned, yaw_enu_from_ned
from advise_ros.mavlink.messages import Message
from advise_ros.mavlink.stamps import BootOrder

# Sender of a datagram; None on a line with two ends.
Address = tuple[str, int]

# A text is put together from chunks of this many characters up to the other; a shorter chunk ends it.
CHUNK, LONGEST_TEXT = 50, 400
# The mode is in the heartbeat: without one for this many time-outs the link counts as lost whatever else arrives.
HEARTBEATS_LOST = 3.0

# A position that is older is no place to go by.
FRESH_S = 0.5
# A fact that was not repeated for this long is no fact any more; each is asked for twice a second or more.
FACT_S = 6.0


class Attitude(NamedTuple):
    """Body axes against the map: roll and pitch in the FLU sense, yaw counter-clockwise from east; radians."""

    roll_rad: float
    pitch_rad: float
    yaw_rad: float


class Motion(NamedTuple):
    """Position and velocity in the map frame (ENU) at an autopilot time, and when it arrived (monotonic)."""

    time_boot_ms: int
    position_enu_m: Vector
    velocity_enu_m_s: Vector
    at_s: float


class Battery(NamedTuple):
    """NaN where the autopilot does not know; `remaining` from 0 to 1."""

    voltage_v: float
    current_a: float
    remaining: float


class Ack(NamedTuple):
    """Result of one command, and when it arrived (monotonic)."""

    command: int
    result: int
    at_s: float


@dataclass
class Vehicle:
    """One autopilot of a multicopter, chosen by its first heartbeat.

    Only messages of its (system, component) count: other links' heartbeats are forwarded by many autopilots.
    While its messages come from one address, those with its ids from another are not taken.

    Attributes:
        wanted_system: the only system that is chosen; 0: any.
        refused_numbers, refused_strangers: messages that were not taken in, and why.
        unfit: another sender that calls itself an autopilot, in words.
        text_goes_on: `text` is the begin of a longer one.
        doubt: why its position is not to be trusted, in words, '' if it is.
        round_trip_s: how long a message takes there and back, infinite while that is unknown.
        custom_mode, mode_at_s: the mode that is flown, and when it was first reported.
        diverted: it says that it flies another mode than the one that was commanded.
        failsafe_text: its last text that names a failsafe.
        received_at_s, n_received: when each message came last, and how often so far.
    """

    heartbeat_timeout_s: float
    own_system: int = 1
    own_component: int = 191
    wanted_system: int = 0
    target: tuple[int, int] | None = None
    address: Address | None = None
    autopilot: int = 0
    heartbeat_at_s: float = -math.inf
    received_s: float = -math.inf
    armed: bool = False
    custom_mode: int | None = None
    mode_at_s: float = -math.inf
    diverted: bool = False
    system_status: int = 0
    health: int | None = None
    ekf_flags: int | None = None
    landed_state: int = 0
    attitude: Attitude | None = None
    motion: Motion | None = None
    battery: Battery | None = None
    text: str = ''
    text_goes_on: bool = False
    text_at_s: float = -math.inf
    failsafe_text: str = ''
    failsafe_text_at_s: float = -math.inf
    acks: list[Ack] = field(default_factory=list)
    doubt: str = ''
    round_trip_s: float = math.inf
    refused_numbers: int = 0
    refused_strangers: int = 0
    unfit: str = ''
    position_fresh: bool = False
    received_at_s: dict[int, float] = field(default_factory=dict)
    n_received: Counter[int] = field(default_factory=Counter)
    _chunks: tuple[int, int, str] = (0, 0, '')
    _order: BootOrder = field(default_factory=BootOrder)

    def connected(self, now_s: float) -> bool:
        """Whether its messages arrive. A bad link loses some heartbeats in a row; what comes between them shows that it lives.

        Args:
            now_s: steady time.
        """
        received = now_s - self.received_s <= self.heartbeat_timeout_s
        return received and now_s - self.heartbeat_at_s <= HEARTBEATS_LOST * self.heartbeat_timeout_s

    @property
    def name(self) -> str:
        """'ardupilot', 'px4' or '' before the first heartbeat."""
        return mav.AUTOPILOT_NAMES.get(self.autopilot, '')

    @property
    def reboots(self) -> int:
        """How often the autopilot has started anew."""
        return self._order.reboots

    def trusted(self, now_s: float) -> Motion | None:
        """Position and velocity that a place may be made from; None while they are old or the estimator is in doubt.

        Args:
            now_s: steady time.
        """
        fresh = self.motion is not None and now_s - self.motion.at_s <= FRESH_S
        return self.motion if fresh and not self.doubt else None

    @property
    def in_failsafe(self) -> bool:
        """By the state of its heartbeat, or because it flies another mode than the one that was commanded."""
        return self.system_status in mav.FAILSAFE_STATES or self.diverted

    @property
    def in_air(self) -> bool:
        """Off the ground, by the autopilot's own word."""
        return self.landed_state in (mav.IN_AIR, mav.TAKING_OFF, mav.LANDING)

    def observe(self, message: Message, now_s: float, address: Address | None = None) -> bool:
        """Take a message in; False if it is from another sender, or its numbers can't be true.

        Args:
            message: of any sender.
            now_s: steady time of arrival.
            address: its sender's, None on a link that has none.
        """
        message_id = message.get_msgId()
        source = (message.get_srcSystem(), message.get_srcComponent())
        if self.target is None and message_id == mav.HEARTBEAT and self._is_fit(message):
            self.target = source
        if source != self.target or not self._is_known(address, now_s):
            return False
        if not mav.is_plausible(message):
            self.refused_numbers += 1
            return False
        self.received_s = self.received_at_s[message_id] = now_s
        self.n_received[message_id] += 1
        handler = _HANDLERS.get(message_id)
        if handler is not None:
            handler(self, message, now_s)
        return True

    def _is_fit(self, message: Message) -> bool:
        if message.autopilot not in mav.AUTOPILOT_NAMES or self.wanted_system not in (0, message.get_srcSystem()):
            return False
        if message.type not in mav.MULTICOPTER_TYPES:
            self.unfit = f'system {message.get_srcSystem()} is no multicopter (MAV_TYPE {int(message.type)})'
            return False
        return True

    def _is_known(self, address: Address | None, now_s: float) -> bool:
        """One address as long as it is alive; a restarted autopilot may come from another one."""
        if address != self.address and self.address is not None and self.connected(now_s):
            self.refused_strangers += 1
            return False
        self.address = address
        return True

    def _on_heartbeat(self, message: Message, now_s: float) -> None:
        if message.autopilot not in mav.AUTOPILOT_NAMES or self.autopilot not in (0, message.autopilot):
            return
        self.autopilot = int(message.autopilot)
        self.armed = bool(message.base_mode & mav.MODE_FLAG_ARMED)
        self.system_status = int(message.system_status)
        self.heartbeat_at_s = now_s
        self._set_mode(int(message.custom_mode), now_s)

    def _on_current_mode(self, message: Message, now_s: float) -> None:
        self._set_mode(int(message.custom_mode), now_s)
        self.diverted = message.intended_custom_mode not in (0, message.custom_mode)

    def _set_mode(self, mode: int, now_s: float) -> None:
        if mode != self.custom_mode:
            self.custom_mode, self.mode_at_s, self.diverted = mode, now_s, False

    def _on_sys_status(self, message: Message, now_s: float) -> None:
        self.health = int(message.onboard_control_sensors_health)
        unknown = math.nan
        self.battery = Battery(
            voltage_v=unknown if message.voltage_battery == 0xFFFF else message.voltage_battery / 1000,
            current_a=unknown if message.current_battery < 0 else message.current_battery / 100,
            remaining=unknown if message.battery_remaining < 0 else message.battery_remaining / 100,
        )

    def _on_ekf(self, message: Message, now_s: float) -> None:
        self.ekf_flags = int(message.flags)

    def _on_landed(self, message: Message, now_s: float) -> None:
        self.landed_state = int(message.landed_state)

    def _on_attitude(self, message: Message, now_s: float) -> None:
        # FRD against NED to FLU against ENU: roll keeps its sign, pitch flips (y points the other way).
        self.attitude = Attitude(float(message.roll), -float(message.pitch), yaw_enu_from_ned(float(message.yaw)))

    def _on_position(self, message: Message, now_s: float) -> None:
        """A repeated or overtaken position is no news."""
        boot_ms = int(message.time_boot_ms)
        reboots = self._order.reboots
        if not self._order.is_news(boot_ms):
            return
        if self._order.reboots != reboots:
            self._reboot()
        self.position_fresh = True
        self.motion = Motion(
            boot_ms, enu_from_ned((message.x, message.y, message.z)),
            enu_from_ned((message.vx, message.vy, message.vz)), now_s,
        )

    def _reboot(self) -> None:
        """The autopilot's clock went back: what it said before is void."""
        self.health = self.ekf_flags = self.attitude = None
        self.position_fresh = False
        self.landed_state = 0
        self.received_at_s.clear()

    def _on_ack(self, message: Message, now_s: float) -> None:
        ours = message.target_system in (0, self.own_system) and message.target_component in (0, self.own_component)
        if not ours:
            return  # The answer to a command of another sender.
        self.acks.append(Ack(int(message.command), int(message.result), now_s))
        del self.acks[:-50]

    def _on_text(self, message: Message, now_s: float) -> None:
        part = message.text if isinstance(message.text, str) else bytes(message.text).decode('utf-8', 'replace')
        part = ''.join(letter if letter.isprintable() else ' ' for letter in part)
        number, chunk = int(message.id), int(message.chunk_seq)
        self.text_goes_on = bool(number) and len(message.text) >= CHUNK
        begun, last, text = self._chunks
        if number and chunk and (number, chunk) == (begun, last + 1):
            part = (text + part)[:LONGEST_TEXT]
        self._chunks = (number, chunk, part)
        self.text, self.text_at_s = part.strip(), now_s
        words = self.text.lower()
        if 'failsafe' in words and 'clear' not in words:
            self.failsafe_text, self.failsafe_text_at_s = self.text, now_s

    def forget_silent(self, now_s: float) -> None:
        """Readiness and landed state that were not reported lately are unknown.

        Args:
            now_s: steady time.
        """
        for message_id, name, unknown in (
            (mav.EKF_STATUS_REPORT, 'ekf_flags', None), (mav.SYS_STATUS, 'health', None),
            (mav.EXTENDED_SYS_STATE, 'landed_state', 0), (mav.CURRENT_MODE, 'diverted', False),
            (mav.LOCAL_POSITION_NED, 'position_fresh', False),
        ):
            if now_s - self.received_at_s.get(message_id, -math.inf) > FACT_S:
                setattr(self, name, unknown)

    def ack_since(self, command: int, since_s: float) -> int | None:
        """Result of a command that was sent at `since_s`, or None so far.

        Args:
            command: its MAV_CMD number.
            since_s: steady time of sending.
        """
        for ack in reversed(self.acks):
            if ack.command == command and ack.at_s >= since_s:
                return ack.result
        return None


_HANDLERS: dict[int, Callable[[Vehicle, Message, float], None]] = {
    mav.HEARTBEAT: Vehicle._on_heartbeat,
    mav.CURRENT_MODE: Vehicle._on_current_mode,
    mav.SYS_STATUS: Vehicle._on_sys_status,
    mav.EKF_STATUS_REPORT: Vehicle._on_ekf,
    mav.EXTENDED_SYS_STATE: Vehicle._on_landed,
    mav.ATTITUDE: Vehicle._on_attitude,
    mav.LOCAL_POSITION_NED: Vehicle._on_position,
    mav.COMMAND_ACK: Vehicle._on_ack,
    mav.STATUSTEXT: Vehicle._on_text,
}

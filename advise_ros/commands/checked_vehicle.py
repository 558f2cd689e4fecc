"""The autopilot that fly_check looks at: its state, its parameters, and how they are changed. Arms and moves nothing."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from advise_ros.core.errors import AdviseError
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink import preflight
from advise_ros.mavlink.companion import Companion, Settings, Status
from advise_ros.mavlink.estimator_check import EstimatorWatch
from advise_ros.mavlink.exchange import exchange, serve_until
from advise_ros.mavlink.findings import Change
from advise_ros.mavlink.link import Link
from advise_ros.mavlink.readings import Readings
from advise_ros.mavlink.writings import Writings

# Beside the bridge (191) and the recorder (192).
COMPONENT_ID = 193
TURN_S = 0.05
# Texts of the pre-arm checks come within this.
LISTEN_S = 2.0
ASK_S, ESTIMATOR_HZ = 1.0, 4.0
# A heartbeat comes once a second; on a bad link some are lost.
HEARTBEAT_S = 5.0


class CheckedVehicle:
    """One autopilot on a link that has been opened.

    Args:
        link: opened, not started.
        wait_s: longest wait for the autopilot, its readiness and its parameters, each.
    """

    def __init__(self, link: Link, wait_s: float) -> None:
        self.link, self._wait_s = link, wait_s
        self._companion = Companion(Settings(component_id=COMPONENT_ID))
        self._readings: Readings | None = None
        self._writings: Writings | None = None
        self._estimator: EstimatorWatch | None = None
        self._asked_s = 0.0
        self.texts: list[str] = []

    # -- what it is ---------------------------------------------------------------------------
    @property
    def autopilot(self) -> str:
        """'ardupilot' or 'px4'."""
        return self._companion.vehicle.name

    @property
    def system(self) -> int:
        """Its MAVLink system id; 0: none yet."""
        target = self._companion.vehicle.target
        return 0 if target is None else target[0]

    @property
    def status(self) -> Status:
        """What it says of itself now."""
        return self._companion.status(time.monotonic())

    @property
    def estimator(self) -> EstimatorWatch:
        """What its estimator said lately."""
        assert self._estimator is not None
        return self._estimator

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name, as they were read last."""
        return {} if self._readings is None else self._readings.values

    @property
    def kinds(self) -> dict[str, int]:
        """Their types (MAV_PARAM_TYPE)."""
        return {} if self._readings is None else self._readings.kinds

    # -- looking ------------------------------------------------------------------------------
    def look(self) -> None:
        """Find it, wait for its readiness, read its parameters.

        Raises:
            AdviseError: no autopilot answers.
        """
        started_s = time.monotonic()
        self._until(lambda: bool(self.status.autopilot), self._wait_s)
        if not self.status.autopilot:
            raise AdviseError(self._silence())
        self._estimator = EstimatorWatch(self.autopilot)
        self._begin_reading()
        left_s = self._wait_s - (time.monotonic() - started_s)
        self._until(lambda: self.status.ready, max(LISTEN_S, left_s))
        if self.autopilot == 'ardupilot' and self._companion.vehicle.target is not None:
            self.link.send(mav.command(self._companion.vehicle.target, mav.CMD_RUN_PREARM_CHECKS))
        self._until(lambda: False, LISTEN_S)
        self._finish_reading()

    def read(self, extra: Sequence[str] = ()) -> None:
        """Read its parameters anew, and these beside those that are judged."""
        self._begin_reading(extra)
        self._finish_reading()

    def _begin_reading(self, extra: Sequence[str] = ()) -> None:
        names = dict.fromkeys((*preflight.names(self.autopilot), *extra))
        optional = preflight.optional_names(self.autopilot) - set(extra)
        self._readings = Readings(tuple(names), bytewise=self._bytewise, optional=optional)

    def _finish_reading(self) -> None:
        self._until(lambda: self._readings is None or self._readings.done, self._wait_s)

    @property
    def _bytewise(self) -> bool:
        return self.autopilot == 'px4'

    def _silence(self) -> str:
        """Why no autopilot answers, as far as can be seen, and what to do."""
        link, hindrance = self.link, self._companion.hindrance
        silence = f'no autopilot answers within {self._wait_s:g} s on {link.url}'
        if link.refused_signatures:
            return f"{silence}: {hindrance}; give --signing-key the autopilot's own key, or none where it has none"
        if self._companion.vehicle.unfit:
            return f'{silence}: {hindrance}; only ArduPilot and PX4 multicopters are flown'
        if hindrance:
            return f'{silence}: {hindrance}; start the autopilot, or name its own address'
        if link.bad_bytes:
            return f'{silence}: {link.bad_bytes} bytes came that are no MAVLink; see that port and --baud are right'
        return f'{silence}: nothing comes; start the autopilot, or have it send there (ArduPilot in SITL: --out=udp:HOST:PORT)'

    # -- writing ------------------------------------------------------------------------------
    def why_not_write(self) -> str:
        """Why nothing may be written now, '' if it may; call `refresh` before."""
        status = self.status
        if not status.connected:
            return 'the link to the autopilot is lost: see that it runs, and try again'
        if status.in_air:
            return 'it is in the air: land it, disarm it and try again'
        return 'it is armed: disarm it and try again' if status.armed else ''

    def refresh(self) -> None:
        """Wait for new messages of it; a person may have thought for long."""
        asked_s = time.monotonic()
        self._until(lambda: self._companion.vehicle.heartbeat_at_s > asked_s, HEARTBEAT_S)

    def begin_writing(self, changes: Sequence[Change]) -> Writings:
        """Prepare the changes of parameters that were read; `write` sends them."""
        self._writings = Writings(changes, self.kinds, bytewise=self._bytewise)
        return self._writings

    def write(self) -> str:
        """Write what was begun; returns why it stopped before the end, '' if it did not."""
        writings = self._writings
        assert writings is not None
        self._until(lambda: writings.done or bool(self.why_not_write()), self._wait_s * max(1, len(writings.left)))
        self._writings = None
        return writings.failure or (self.why_not_write() if writings.left else '')

    # -- the link -----------------------------------------------------------------------------
    def _until(self, condition: Callable[[], bool], seconds: float) -> None:
        """Serve the link until a condition holds or the time is over."""
        serve_until(condition, self._turn, seconds, TURN_S)

    def _turn(self) -> None:
        exchange(self.link, self._companion, self._take, self._own_requests)

    def _own_requests(self, now_s: float) -> list[mav.Message]:
        target = self._companion.vehicle.target
        if target is None:
            return []
        out: list[mav.Message] = []
        if self._estimator is not None and now_s - self._asked_s >= ASK_S:
            self._asked_s = now_s
            out += [mav.message_interval(target, number, ESTIMATOR_HZ) for number in self._estimator.wanted]
        for party in (self._readings, self._writings):
            out += [] if party is None else party.step(target, now_s)
        return out

    def _take(self, message: mav.Message, at_s: float) -> None:
        for party in (self._readings, self._writings):
            if party is not None:
                party.observe(message)
        if self._estimator is not None:
            self._estimator.observe(message, at_s)
        vehicle = self._companion.vehicle
        if message.get_msgId() == mav.STATUSTEXT and not vehicle.text_goes_on and vehicle.text not in self.texts:
            self.texts.append(vehicle.text)

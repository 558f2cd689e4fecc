"""What a pilot asks of the vehicle around its flights: take-off, the flight, landing, again."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from advise_ros.core.flight.vehicle_state import VehicleState, why_no_commands

ATTEMPTS = 3
RETRY_S = 1.0
ABSENT_RETRY_S = 0.2
# A vehicle that takes no commands in flight may do so again (a short loss of the link).
GRACE_S = 5.0


class MissionStage(Enum):
    WAITING = 'waiting for the vehicle'
    TAKING_OFF = 'taking off'
    FLYING = 'flying'
    LANDING = 'landing'
    DONE = 'all flights are done'
    FAILED = 'given up'


class Ask(Enum):
    """A service of the bridge."""

    TAKEOFF = 'takeoff'
    LAND = 'land'


@dataclass
class Mission:
    """Counts flights and says what to ask of the vehicle next; knows time only as `now_s` (steady).

    Args:
        flights: how many to fly.
        handle_vehicle: ask for take-off and landing; otherwise wait until somebody does both.
        timeout_s: longest wait for each of them.

    Attributes:
        flight: the present one, from 1.
        failure: one sentence, empty unless FAILED.
        obstacle: why no flight can begin whatever the vehicle says, in one sentence; set from outside.
    """

    flights: int
    handle_vehicle: bool = True
    timeout_s: float = 180.0
    stage: MissionStage = MissionStage.WAITING
    flight: int = 1
    failure: str = ''
    obstacle: str = ''
    _since_s: float | None = None
    _attempts: int = 0
    _asked: bool = False
    _retry_s: float = 0.0
    _lost_s: float | None = None

    def __post_init__(self) -> None:
        if self.flights == 0:
            self.stage = MissionStage.DONE

    @property
    def over(self) -> bool:
        return self.stage in (MissionStage.DONE, MissionStage.FAILED)

    def advance(self, vehicle: VehicleState | None, now_s: float) -> Ask | None:
        """Look at the vehicle and at the time; returns a service to call now.

        Args:
            vehicle: its newest state, None before the first.
            now_s: steady time.
        """
        if self._since_s is None:
            self._since_s = now_s
        if vehicle is not None and not (self.obstacle and self.stage == MissionStage.WAITING):
            self._move_on(vehicle, now_s)
        if not self.over and self.stage != MissionStage.FLYING and now_s - self._since_s > self.timeout_s:
            self._fail(self._timeout_text(vehicle))
        return self._due(vehicle, now_s)

    def replied(self, accepted: bool, message: str, now_s: float) -> None:
        """The reply to what `advance` asked for.

        Args:
            accepted, message: of the service.
            now_s: steady time.
        """
        self._asked = accepted
        if accepted or self.over:
            return
        self._attempts += 1
        self._retry_s = now_s + RETRY_S
        if self._attempts >= ATTEMPTS:
            what = 'take off' if self.stage == MissionStage.TAKING_OFF else 'land'
            self._fail(f'the vehicle refused {ATTEMPTS} times to {what}: {message}')

    def unanswered(self, now_s: float) -> None:
        """The service is not there (yet).

        Args:
            now_s: steady time.
        """
        self._asked = False
        self._retry_s = now_s + ABSENT_RETRY_S

    def flown(self, now_s: float) -> None:
        """The flight is over and the vehicle is at home.

        Args:
            now_s: steady time.
        """
        self._enter(MissionStage.LANDING, now_s)

    def fail(self, why: str) -> None:
        """Give up for a reason found elsewhere."""
        self._fail(why)

    def _move_on(self, vehicle: VehicleState, now_s: float) -> None:
        if self.stage in (MissionStage.WAITING, MissionStage.TAKING_OFF) and vehicle.commandable:
            self._enter(MissionStage.FLYING, now_s)
        elif self.stage == MissionStage.WAITING and self.handle_vehicle and vehicle.ready:
            self._enter(MissionStage.TAKING_OFF, now_s)
        elif self.stage == MissionStage.FLYING:
            self._watch(vehicle, now_s)
        elif self.stage == MissionStage.LANDING and not vehicle.armed and not vehicle.in_air:
            self._landed(now_s)

    def _watch(self, vehicle: VehicleState, now_s: float) -> None:
        if vehicle.commandable:
            self._lost_s = None
            return
        if self._lost_s is None:
            self._lost_s = now_s
        if not vehicle.armed or now_s - self._lost_s > GRACE_S:
            self._fail(f'the vehicle takes no commands any more ({why_no_commands(vehicle)}){_words(vehicle)}')

    def _landed(self, now_s: float) -> None:
        if self.flight == self.flights:
            self._enter(MissionStage.DONE, now_s)
        else:
            self.flight += 1
            self._enter(MissionStage.WAITING, now_s)

    def _enter(self, stage: MissionStage, now_s: float) -> None:
        self.stage = stage
        self._since_s, self._attempts, self._asked, self._retry_s, self._lost_s = now_s, 0, False, now_s, None

    def _due(self, vehicle: VehicleState | None, now_s: float) -> Ask | None:
        ask = {MissionStage.TAKING_OFF: Ask.TAKEOFF, MissionStage.LANDING: Ask.LAND}.get(self.stage)
        if ask is None or vehicle is None or not self.handle_vehicle or self._asked or now_s < self._retry_s:
            return None
        self._asked = True
        return ask

    def _timeout_text(self, vehicle: VehicleState | None) -> str:
        if self.obstacle:
            return self.obstacle
        if vehicle is None:
            return f'no vehicle_status came within {self.timeout_s:g} s; start mavlink_bridge'
        return f'{self.stage.value} took longer than {self.timeout_s:g} s{_words(vehicle)}'

    def _fail(self, why: str) -> None:
        if not self.over:
            self.stage = MissionStage.FAILED
            self.failure = f'flight {self.flight} of {self.flights} could not be flown: {why}'


def _words(vehicle: VehicleState) -> str:
    """What the bridge and the autopilot say, to end a sentence with."""
    said = [f'waiting for {vehicle.waiting_for}' if vehicle.waiting_for else '', f'"{vehicle.text}"' if vehicle.text else '']
    return ''.join(f'; {words}' for words in said if words)

"""What is right with an autopilot before a flight, what is not, and how to set it. Arms nothing, sets nothing."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Sequence

from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.fence import fence_around
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.mavlink import messages as mav
from advise_ros.mavlink.companion import Companion, Settings, Status
from advise_ros.mavlink.link import Link
from advise_ros.mavlink.preflight import OPTIONAL, PARAMETERS, Finding, Level, Room, parameter_findings, state_findings
from advise_ros.mavlink.readings import Readings
from advise_ros.mavlink.signing import optional_key
from advise_ros.recording.gridfile import load_grid

RIGHT, WRONG = OK, VERDICT_NO
# Beside the bridge (191) and the recorder (192).
COMPONENT_ID = 193
TURN_S = 0.05
# Texts of the pre-arm checks come within this.
LISTEN_S = 2.0
EPILOG = """examples:
  ./advise fly_check udpin:127.0.0.1:14550
  ./advise fly_check tcp:127.0.0.1:5760 --grid config/grid_6x6.yaml     does the vehicle's own fence leave room for it?
  ./advise fly_check /dev/ttyACM0 --baud 57600 --wait 60 --signing-key key

Next: when nothing is wrong, ./advise mavlink_bridge --ros-args -p url:=udpin:127.0.0.1:14550 -p grid_file:=config/grid_6x6.yaml

exit code: 0 nothing is wrong, 1 something is, 2 wrong usage or no autopilot heard; 130 interrupted"""


def main() -> None:
    sys.exit(run(sys.argv[1:]))


def run(argv: Sequence[str]) -> int:
    """The command with its arguments; returns the exit code."""
    options = _parser().parse_args(argv)
    try:
        if not 0 < options.wait < math.inf:
            raise InputError(f'--wait is {options.wait:g}; it must be a number of seconds above 0')
        return _report(Check(options).findings())
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='fly_check', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('url', help='udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT or a serial device')
    parser.add_argument('--baud', type=int, default=115200, metavar='N', help='of a serial device (default %(default)s)')
    parser.add_argument('--grid', default='', metavar='FILE', help='YAML file with the grid that is to be flown')
    parser.add_argument('--signing-key', default='', metavar='FILE', help='key file of MAVLink 2 signing')
    parser.add_argument('--wait', type=float, default=15.0, metavar='S', help='longest wait for readiness (default %(default)s)')
    return parser


def _report(findings: list[Finding]) -> int:
    for finding in findings:
        print(f'{finding.level.value:8}{finding.what}' + (f'\n        -> {finding.remedy}' if finding.remedy else ''))
    wrong = sum(finding.level is Level.WRONG for finding in findings)
    print(f'\n{wrong} of {len(findings)} findings are wrong' if wrong else '\nnothing is wrong')
    return WRONG if wrong else RIGHT


def _room(grid_file: str) -> Room | None:
    if not grid_file:
        return None
    fence = fence_around(load_grid(grid_file), 0.0, 0.0)
    return Room(max(math.hypot(*corner) for corner in fence.corners_enu_m), fence.high_m)


class Check:
    """One look at one autopilot.

    Raises:
        InputError: the grid, the key or the link is wrong.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._room = _room(options.grid)
        self._signed = bool(options.signing_key)
        self._link = Link(options.url, baud=options.baud, component_id=COMPONENT_ID, key=optional_key(options.signing_key))
        self._companion = Companion(Settings(component_id=COMPONENT_ID))
        self._readings: Readings | None = None
        self._texts: list[str] = []

    def findings(self) -> list[Finding]:
        """The whole check.

        Raises:
            AdviseError: no autopilot is heard.
        """
        self._link.start()
        try:
            return self._look()
        finally:
            self._link.close()

    def _look(self) -> list[Finding]:
        started_s = time.monotonic()
        self._until(lambda: bool(self._status().autopilot), self._options.wait)
        if not self._status().autopilot:
            raise AdviseError(self._silence())
        autopilot = self._status().autopilot
        self._readings = Readings(tuple(PARAMETERS[autopilot]), bytewise=autopilot == 'px4', optional=OPTIONAL)
        left_s = self._options.wait - (time.monotonic() - started_s)
        self._until(lambda: self._status().ready, max(LISTEN_S, left_s))
        if autopilot == 'ardupilot' and self._companion.vehicle.target is not None:
            self._link.send(mav.command(self._companion.vehicle.target, mav.CMD_RUN_PREARM_CHECKS))
        self._until(lambda: False, LISTEN_S)
        self._until(lambda: self._readings is None or self._readings.done, self._options.wait)
        return [*state_findings(self._status(), self._texts), self._signing(), *self._parameters(autopilot)]

    def _silence(self) -> str:
        """Why no autopilot is heard, as far as it can be told, and what to do."""
        link, hindrance = self._link, self._companion.hindrance
        heard = f'no autopilot is heard within {self._options.wait:g} s on {self._options.url}'
        if link.refused_signatures:
            return f"{heard}: {hindrance}; give --signing-key the autopilot's own key, or none where it has none"
        if self._companion.vehicle.unfit:
            return f'{heard}: {hindrance}; only ArduPilot and PX4 multicopters are flown'
        if hindrance:
            return f'{heard}: {hindrance}; start the autopilot, or name its own address'
        if link.bad_bytes:
            return f'{heard}: {link.bad_bytes} bytes came that are no MAVLink; see that port and --baud are right'
        return f'{heard}: nothing comes; start the autopilot, or have it send there (ArduPilot in SITL: --out=udp:HOST:PORT)'

    def _parameters(self, autopilot: str) -> list[Finding]:
        return parameter_findings(autopilot, self._readings.values if self._readings else {}, self._room)

    def _signing(self) -> Finding:
        if self._signed:
            return Finding(Level.RIGHT, 'what it sends is signed with the key')
        if self._link.doubt:
            return Finding(Level.WRONG, self._link.doubt, '--signing-key FILE with the key that it has')
        remedy = 'give both ends one key where others can reach the link: docs/safety.md'
        return Finding(Level.ADVICE, 'the link is not signed: whoever reaches it may command the vehicle', remedy)

    def _status(self) -> Status:
        return self._companion.status(time.monotonic())

    def _until(self, condition: Callable[[], bool], seconds: float) -> None:
        """Serve the link until a condition holds or the time is over."""
        end_s = time.monotonic() + seconds
        while not condition() and time.monotonic() < end_s:
            self._turn()
            time.sleep(TURN_S)

    def _turn(self) -> None:
        for received in self._link.poll():
            if self._companion.observe(received.message, received.at_s, received.source):
                self._link.answer_to(received.source)
                self._take(received.message)
        now_s, target = time.monotonic(), self._companion.vehicle.target
        out = self._companion.step(now_s, self._link.problem or self._link.doubt)
        if self._readings is not None and target is not None:
            out += self._readings.step(target, now_s)
        for message in out:
            self._link.send(message)

    def _take(self, message: mav.Message) -> None:
        if self._readings is not None:
            self._readings.observe(message)
        vehicle = self._companion.vehicle
        if message.get_msgId() == mav.STATUSTEXT and not vehicle.text_goes_on and vehicle.text not in self._texts:
            self._texts.append(vehicle.text)


if __name__ == '__main__':
    main()

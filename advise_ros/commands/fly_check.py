"""What is right with an autopilot before a flight, what is not, and how to set it. Arms and moves nothing.

Without --apply or --undo nothing is changed.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from advise_ros.command_line import CommandParser
from advise_ros.commands import old_parameters
from advise_ros.commands.checked_vehicle import COMPONENT_ID, CheckedVehicle
from advise_ros.commands.old_parameters import OldParameters, ParameterChange
from advise_ros.config import ChecksConfig
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.guard.fence import fence_around
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.mavlink import preflight
from advise_ros.mavlink.findings import Change, Finding, Level, Room, advice, right, wrong
from advise_ros.mavlink.link import Link
from advise_ros.mavlink.parameter_values import as_carried
from advise_ros.mavlink.signing import optional_key
from advise_ros.mavlink.writings import Writings
from advise_ros.recording.gridfile import load_grid

EPILOG = """examples:
  ./advise fly_check udpin:127.0.0.1:14550
  ./advise fly_check tcp:127.0.0.1:5760 --grid config/grid_6x6.yaml     does the vehicle's own fence leave room for ours?
  ./advise fly_check /dev/ttyACM0 --baud 57600 --wait 60 --signing-key key
  ./advise fly_check udpin:127.0.0.1:14540 --grid my_grid.yaml --apply  write what it recommends, once you say yes
  ./advise fly_check udpin:127.0.0.1:14540 --undo fly_check-px4-1-20261127-154500.json

--apply lists each parameter with its old value, its new one and the reason, asks, saves the old values to a file, writes,
reads back and checks again. It refuses while the vehicle is armed or in the air. None of what it writes needs a reboot.

Next: when nothing is wrong, ./advise mavlink_bridge --ros-args -p url:=udpin:127.0.0.1:14550 -p grid_file:=config/grid_6x6.yaml

exit code: 0 nothing is wrong (any more), 1 something is, or was not written, 2 wrong usage, no autopilot answers, or
writing refused; 130 interrupted"""


def main() -> None:
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # An interrupted --apply says how far it came.
    sys.exit(run(sys.argv[1:]))


def run(argv: Sequence[str]) -> int:
    """The command with its arguments; returns the exit code."""
    options = _parser().parse_args(argv)
    try:
        _check_usage(options)
        undone = old_parameters.load(Path(options.undo)) if options.undo else None
        check = Check(options)
        try:
            return check.undo(undone) if undone is not None else check.run()
        finally:
            check.close()
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='fly_check', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add('url', help='udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT or a serial device')
    add('--baud', type=int, default=115200, metavar='N', help='of a serial device (default %(default)s)')
    add('--grid', default='', metavar='FILE', help='YAML file with the grid that is to be flown')
    add('--fence-margin', type=float, default=ChecksConfig.fence_margin_m, metavar='M',
        help="the bridge's fence_margin_m, for our own fence around the grid (default %(default)s)")
    add('--max-speed', type=float, default=ChecksConfig.max_speed_m_s, metavar='V',
        help="the bridge's max_speed_m_s (default %(default)s)")
    add('--signing-key', default='', metavar='FILE', help='key file of MAVLink 2 signing')
    add('--wait', type=float, default=15.0, metavar='S', help='longest wait for readiness (default %(default)s)')
    change = parser.add_mutually_exclusive_group()
    change.add_argument('--apply', action='store_true', help='write what is recommended, after asking')
    change.add_argument('--undo', default='', metavar='FILE', help='put the values of such a file back, after asking')
    add('--yes', action='store_true', help='do not ask (for scripts)')
    add('--save', default='', metavar='FILE', help='where --apply and --undo save what they replace (default: a new file here)')
    return parser


def _check_usage(options: argparse.Namespace) -> None:
    for name, value in (('wait', options.wait), ('max-speed', options.max_speed)):
        if not 0 < value < math.inf:
            raise InputError(f'--{name} is {value:g}; it must be a number above 0')
    if not 0 <= options.fence_margin < math.inf:
        raise InputError(f'--fence-margin is {options.fence_margin:g}; it must be a number of metres from 0')
    if (options.apply or options.undo) and not options.yes and not sys.stdin.isatty():
        what = '--apply' if options.apply else '--undo'
        raise InputError(f'{what} asks before it writes, and there is no terminal to answer at; give --yes to let it write')


def _room(options: argparse.Namespace) -> Room | None:
    if not options.grid:
        return None
    fence = fence_around(load_grid(options.grid), options.fence_margin, ChecksConfig.altitude_band_m)
    reach_m = max(math.hypot(*corner) for corner in fence.corners_enu_m)
    return Room(reach_m, fence.high_m, options.max_speed, ChecksConfig.braking_m_s2)


class Check:
    """One look at one autopilot, and what is changed on it.

    Raises:
        InputError: the grid, the key or the link is wrong.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._options = options
        self._room = _room(options)
        self._link = Link(options.url, baud=options.baud, component_id=COMPONENT_ID, key=optional_key(options.signing_key))
        self._vehicle = CheckedVehicle(self._link, options.wait)
        self._link.start()

    def close(self) -> None:
        """Give the port back."""
        self._link.close()

    def run(self) -> int:
        """Look, report, and with `--apply` write what is recommended.

        Raises:
            AdviseError: no autopilot answers, or nothing may be written now.
        """
        self._vehicle.look()
        findings = self._findings()
        recommended = preflight.changes(findings)
        _print(findings)
        if self._options.apply and recommended:
            return self._write(recommended)
        if recommended:
            print(f'--apply writes {", ".join(change.name for change in recommended)}')
        return _verdict(findings)

    def undo(self, old: OldParameters) -> int:
        """Put back what a file says.

        Raises:
            AdviseError: no autopilot answers, it is another one, or nothing may be written now.
        """
        self._vehicle.look()
        vehicle = self._vehicle
        if (vehicle.autopilot, vehicle.system) != (old.autopilot, old.system):
            raise InputError(f'{self._options.undo} is of {old.autopilot} system {old.system}, and {vehicle.autopilot} system '
                             f'{vehicle.system} is here; name the file that was saved for it')
        vehicle.read([kept.name for kept in old.kept])
        missing = [kept.name for kept in old.kept if kept.name not in vehicle.values]
        if missing:
            raise AdviseError(f'{", ".join(missing)}: no value came; nothing is written; try again')
        for kept in old.kept:
            now = vehicle.values[kept.name]
            if now not in (kept.new, kept.old):
                print(f'{kept.name} was set to {kept.new:g} and is {now:g}: somebody changed it since')
        changes = [change for change in old.changes_back() if change.value != vehicle.values[change.name]]
        if not changes:
            print('nothing to put back: all values are as they were')
            return OK
        return self._write(changes)

    # -- findings -----------------------------------------------------------------------------
    def _findings(self) -> list[Finding]:
        vehicle = self._vehicle
        return [
            *preflight.state_findings(vehicle.status, vehicle.texts), *vehicle.estimator.findings(), self._signing(),
            *preflight.parameter_findings(vehicle.autopilot, vehicle.values, self._room),
        ]

    def _signing(self) -> Finding:
        if self._options.signing_key:
            return right('what it sends is signed with the key')
        if self._link.doubt:
            return wrong(self._link.doubt, '--signing-key FILE with the key that it has')
        remedy = 'give both ends one key where others can reach the link: docs/safety.md'
        return advice('the link is not signed: anyone who reaches it may command the vehicle', remedy)

    # -- writing ------------------------------------------------------------------------------
    def _write(self, changes: Sequence[Change]) -> int:
        vehicle = self._vehicle
        _list(changes, vehicle.values)
        self._refuse_if_it_must_not()
        if not self._options.yes and not _agreed(len(changes)):
            print('nothing is written')
            return VERDICT_NO
        vehicle.refresh()
        self._refuse_if_it_must_not()
        path = self._save(changes)
        writings = vehicle.begin_writing(changes)
        try:
            stopped = vehicle.write()
        except KeyboardInterrupt:
            self._say_how_far(writings, 'interrupted', path)
            return INTERRUPTED
        if stopped:
            self._say_how_far(writings, stopped, path)
            return VERDICT_NO
        return self._read_back(changes, path)

    def _refuse_if_it_must_not(self) -> None:
        why_not = self._vehicle.why_not_write()
        if why_not:
            raise AdviseError(f'nothing is written: {why_not}')

    def _save(self, changes: Sequence[Change]) -> Path:
        vehicle = self._vehicle
        default = f'fly_check-{vehicle.autopilot}-{vehicle.system}-{time.strftime("%Y%m%d-%H%M%S")}.json'
        path = Path(self._options.save or default)
        kept = tuple(ParameterChange(change.name, vehicle.values[change.name], change.value) for change in changes)
        old_parameters.save(path, OldParameters(vehicle.autopilot, vehicle.system, kept), changes)
        print(f'the old values are saved in {path}')
        return path

    def _say_how_far(self, writings: Writings, why: str, path: Path) -> None:
        """After a write that did not come to its end."""
        unsure = writings.unconfirmed
        print(f'{why}: {len(writings.written)} of {len(writings.written) + len(writings.left)} parameters are written')
        for change in writings.written:
            print(f'  written      {change.name} = {change.value:g}')
        for change in writings.left:
            print(f'  {"sent, unsure" if change is unsure else "not written "} {change.name} = {change.value:g}')
        self._say_way_back(path)

    def _say_way_back(self, path: Path) -> None:
        print(f'to put the old values back: ./advise fly_check {self._options.url} --undo {path}')

    def _read_back(self, changes: Sequence[Change], path: Path) -> int:
        """All are written: read everything anew, and say what is there."""
        vehicle = self._vehicle
        vehicle.read([change.name for change in changes])
        differing = [change for change in changes if not self._holds(change)]
        for change in differing:
            there = vehicle.values.get(change.name, math.nan)
            print(f'{change.name} was written as {change.value:g} and reads back as {there:g}')
        print(f'{len(changes) - len(differing)} of {len(changes)} parameters are written and read back')
        self._say_way_back(path)
        if self._options.undo:
            return VERDICT_NO if differing else OK
        findings = self._findings()
        print('\nstill to do by hand:')
        _print([finding for finding in findings if finding.level is not Level.RIGHT])
        return VERDICT_NO if differing else _verdict(findings)

    def _holds(self, change: Change) -> bool:
        vehicle = self._vehicle
        return vehicle.values.get(change.name) == as_carried(change.value, vehicle.kinds.get(change.name, 0))


def _print(findings: Sequence[Finding]) -> None:
    for finding in findings:
        print(f'{finding.level.value:8}{finding.what}' + (f'\n        -> {finding.remedy}' if finding.remedy else ''))
    wrongs = sum(finding.level is Level.WRONG for finding in findings)
    print(f'\n{wrongs} of {len(findings)} findings are wrong' if wrongs else '\nnothing is wrong')


def _verdict(findings: Sequence[Finding]) -> int:
    return VERDICT_NO if any(finding.level is Level.WRONG for finding in findings) else OK


def _list(changes: Sequence[Change], values: dict[str, float]) -> None:
    """Name, old value, new value, reason."""
    print('\nto be written:')
    for change in changes:
        print(f'  {change.name:16} {values[change.name]:g} -> {change.value:g}   {change.why}')


def _agreed(number: int) -> bool:
    try:
        answer = input(f'write {number} parameter{"s" if number > 1 else ""}? [y/N] ')
    except EOFError:
        return False
    return answer.strip().lower() in ('y', 'yes')


if __name__ == '__main__':
    main()

"""route: the learnt route for other tools, and onto a vehicle as a mission."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

import rclpy
from rclpy.signals import SignalHandlerOptions

from advise_ros.command_line import CommandParser
from advise_ros.core.errors import AdviseError, InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.exits import INTERRUPTED, OK, VERDICT_NO, fail
from advise_ros.missions.files import WRITERS, write_mission
from advise_ros.missions.from_grid import cells_flown, mission_of
from advise_ros.missions.mission import FlightMission
from advise_ros.missions.upload import UploadError, upload
from advise_ros.recording.gridfile import load_grid, load_place
from advise_ros.recording.messages import Bag
from advise_ros.ros import arguments, convert
from advise_ros.ros.graph_client import GraphClient, GraphTimeoutError

POLICY_TYPE = 'advise_msgs/msg/Policy'
PATIENCE_S = 10.0
EPILOG = f"""examples:
  ./advise route export my_session --grid my_grid.yaml --out route.plan       of the last policy in a bag
  ./advise route export --grid my_grid.yaml --out route.kml                   of the running learner
  ./advise route upload my_session --grid my_grid.yaml --to udpin:127.0.0.1:14550

The grid file must say where it lies on the earth (origin_wgs84). Forms of --out: {', '.join(WRITERS)}.

upload sends the route by MAVLink's mission protocol: it clears the vehicle's mission, sends take-off and the waypoints, reads
them back and compares. It starts nothing and changes no mode; it refuses while the vehicle flies a mission. Nothing else of
ours may use the same link meanwhile.

Next: fly it from the tool that reads the file, or set the vehicle's mode to its mission, with a pilot beside it.

exit code: 0 done; 1 the vehicle did not take it, or not as it was sent; 2 wrong usage or input; 130 interrupted"""


def main() -> None:
    sys.exit(run(sys.argv[1:]))


def run(argv: Sequence[str]) -> int:
    """The command with its arguments; returns the exit code."""
    options = _parser().parse_args(arguments.without_ros(argv))
    try:
        mission = _mission(options, argv)
        if options.what == 'export':
            write_mission(mission, options.out)
            print(f'{options.out}: {len(mission.waypoints)} waypoints at {mission.waypoints[0].height_m:g} m')
        else:
            print(upload(mission, options.to, options.baud, print))
    except UploadError as problem:
        return fail(str(problem), VERDICT_NO)
    except AdviseError as problem:
        return fail(str(problem))
    except KeyboardInterrupt:
        return INTERRUPTED
    return OK


def _mission(options: argparse.Namespace, argv: Sequence[str]) -> FlightMission:
    grid, place = load_grid(options.grid), load_place(options.grid)
    if place is None:
        raise InputError(
            f'grid file {options.grid}: it does not say where it lies on the earth; add origin_wgs84: [latitude, longitude]'
        )
    policy = _of_bag(options.bag) if options.bag else _of_graph(argv)
    flown_on = convert.grid_from_msg(policy.grid)
    if flown_on != grid:
        raise InputError(f'grid file {options.grid}: the policy is of another grid ({_differs(grid, flown_on)}); name its own')
    return mission_of(grid, place, cells_flown(grid, list(policy.greedy)), every_cell=options.every_cell)


def _differs(grid: Grid, other: Grid) -> str:
    names = ('resolution_m', 'width', 'height', 'origin_enu_m', 'altitude_m', 'waypoints', 'blocked')
    return ', '.join(f'{name}: {getattr(other, name)}' for name in names if getattr(grid, name) != getattr(other, name))


def _of_bag(path: str) -> Any:
    bag = Bag(path, [POLICY_TYPE])
    if not bag.messages:
        raise InputError(f'{path} holds no policy; record a session with the logger, or name none to ask the running learner')
    return bag.decode(bag.messages[-1])


def _of_graph(argv: Sequence[str]) -> Any:
    rclpy.init(args=list(argv), signal_handler_options=SignalHandlerOptions.NO)
    client = GraphClient('route')
    try:
        client.wait('a policy on advise/policy', lambda: bool(client.policies), PATIENCE_S)
        return client.policies[max(client.policies)]
    except GraphTimeoutError as problem:
        raise InputError(f'{problem}; is the learner (./advise advise) running and has it learnt? Or name a bag') from None
    finally:
        client.close()


def _parser() -> argparse.ArgumentParser:
    parser = CommandParser(
        prog='route', description=__doc__, epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    what = parser.add_subparsers(dest='what', required=True, metavar='export | upload')
    for name, said in (('export', "write it into another tool's file"), ('upload', 'send it to a vehicle as its mission')):
        one = what.add_parser(name, help=said)
        one.add_argument('bag', nargs='?', metavar='BAG', help='by logger (default: the running learner)')
        one.add_argument('--grid', required=True, metavar='FILE', help='grid file with origin_wgs84')
        one.add_argument('--every-cell', action='store_true', help='a waypoint in each cell, not only where the route turns')
        if name == 'export':
            one.add_argument('--out', '-o', required=True, metavar='FILE', help=f'file to write: {", ".join(WRITERS)}')
        else:
            one.add_argument('--to', required=True, metavar='URL', help='udpin:HOST:PORT, tcp:HOST:PORT or a serial device')
            one.add_argument('--baud', type=int, default=115200, metavar='N', help='of a serial device (default %(default)s)')
    return parser


if __name__ == '__main__':
    main()

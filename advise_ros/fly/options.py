"""What `fly` is asked to do, and everything about it that can be found wrong before a process starts."""

from __future__ import annotations

import argparse
import re
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from advise_ros.command_line import CommandParser
from advise_ros.config import ConsoleConfig, LoggerConfig
from advise_ros.console.port import bind
from advise_ros.core.errors import InputError
from advise_ros.core.grid.grid import Grid
from advise_ros.demo.options import check_parameters, free_udp_port, node_config, share
from advise_ros.demo.out import refuse_a_full_disk
from advise_ros.mavlink.px4_topics import SCHEME, prefix_of
from advise_ros.mavlink.transport import make_transport
from advise_ros.missing_packages import PX4
from advise_ros.recording.gridfile import load_grid
from advise_ros.recording.sitefile import begin_site
from advise_ros.recording.wishfile import load_wish

# Where the autopilots' own SITL sends to, and what starts it.
URLS = {'ardupilot': 'udpin:127.0.0.1:14550', 'px4': 'udpin:127.0.0.1:14540'}
BAUD = 115200
NAMESPACE = re.compile(r'(/[A-Za-z_][A-Za-z0-9_]*)+')
EXAMPLES = """examples:
  ./advise fly                                     the simulator, and you fly and answer on the page
  ./advise fly --grid my_grid.yaml --bag session1  your own route, recorded into session1
  ./advise fly --actors --speedup 10               watch a simulated pilot and a simulated expert do your part
  ./advise fly --vehicle px4                       a simulated PX4 in place of ArduCopter
  ./advise fly --connect udpin:127.0.0.1:14550     a vehicle or a SITL, whichever sends there
  ./advise fly --connect --vehicle px4             the same where PX4's SITL sends to
  ./advise fly --connect px4_dds:                  a PX4 by its uXRCE-DDS topics (takes px4_msgs)
  ./advise fly --site-map garden_site.yaml         keep what is learnt of the site, and go on from it next time

Next: open the page, take off, fly by hand, answer. Ctrl-C ends all of it in order; the vehicle stands or holds, and the bag
is whole: ./advise replay BAG. Before a real flight read docs/safety.md and run ./advise fly_check.

exit code: 0 ended by Ctrl-C; 1 something of it died or the bag is not whole; 2 wrong usage or input"""


@dataclass(frozen=True)
class FlyOptions:
    """One session.

    Attributes:
        url: MAVLink connection of the bridge.
        simulated: whether we start the vehicle, too.
        vehicle: 'ardupilot', 'px4', or '' for whichever sends heartbeats.
        speedup: simulated seconds a second.
        actors: a simulated pilot flies and a simulated expert answers.
        wish_file: cells that these two keep out of; None: none.
        grid_file, grid: the route.
        params_file: None: the nodes' defaults.
        bag: directory to be made; its logs lie beside it.
        site_map_file, site_map_out: what is known of the site, and where that is kept; '' none.
        port: of the page; 0 any.
        namespace: of all nodes, '' none.
    """

    url: str
    simulated: bool
    vehicle: str
    speedup: float
    actors: bool
    wish_file: Path | None
    grid_file: Path
    grid: Grid
    params_file: Path | None
    bag: Path
    site_map_file: str
    site_map_out: str
    port: int
    namespace: str
    browser: bool

    @property
    def logs(self) -> Path:
        return self.bag.with_name(f'{self.bag.name}_logs')

    @property
    def simulated_time(self) -> bool:
        return self.simulated and self.speedup != 1.0


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = CommandParser(
        prog='fly', formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES,
        description='Starts everything around one vehicle: simulator (or a connection), bridge, recorder, learner, policy, '
        'logger and the page, and opens the page. You fly the route there, answer what the drone asks, and let it fly.',
    )
    add = made.add_argument
    add('--connect', nargs='?', const='', metavar='URL', help='fly this vehicle in place of the simulator: udpin:HOST:PORT, '
        'udpout:HOST:PORT, tcp:HOST:PORT, a serial device or px4_dds:; no URL: where the SITL of --vehicle sends to')
    add('--vehicle', choices=sorted(URLS), default='', help='autopilot; default: the one that sends heartbeats, or ardupilot')
    add('--grid', type=Path, default=share('grid_demo.yaml'), metavar='FILE', help='grid and waypoints (default %(default)s)')
    add('--bag', type=Path, metavar='DIR', help='new directory to record into (default out/fly-DATE-TIME)')
    add('--site-map', default='', metavar='FILE', help='YAML file that keeps what is learnt of the site, and is gone on from')
    add('--site-map-in', default='', metavar='FILE', help='what is known of the site, or any map_server map; only read')
    add('--site-map-out', default='', metavar='FILE', help='keeps what is learnt of the site')
    add('--actors', action='store_true', help='a simulated pilot flies, and a simulated expert answers')
    add('--wish', type=Path, metavar='FILE', help="cells that these two keep out of (default: those of the demo's grid)")
    add('--speedup', type=float, default=1.0, metavar='N', help='simulated seconds a second (default 1)')
    add('--params-file', type=Path, metavar='FILE', help='parameters of the nodes, as config/advise.yaml')
    add('--namespace', default='', metavar='NAME', help='namespace of all nodes')
    add('--port', type=int, default=ConsoleConfig().port, metavar='N', help='TCP port of the page; 0: any (default %(default)s)')
    add('--no-browser', action='store_true', help='print the address only')
    return made


def parse(argv: list[str] | None = None) -> FlyOptions:
    """Options of the command line; every file is read once, so that what is wrong with one is known before anything starts.

    Raises:
        InputError: one sentence with the option, its value and the remedy.
    """
    given = parser().parse_args(argv)
    simulated = given.connect is None
    _check_combination(given, simulated=simulated)
    grid = load_grid(given.grid)
    demo_grid = given.grid.resolve() == share('grid_demo.yaml').resolve()
    wish = given.wish or (share('garden.yaml') if given.actors and demo_grid else None)
    load_wish(wish or '', grid)
    url = f'udpin:127.0.0.1:{free_udp_port()}' if simulated else given.connect or URLS[given.vehicle or 'ardupilot']
    _check_url(url)
    site_in, site_out = given.site_map_in or given.site_map, given.site_map_out or given.site_map
    begin_site(site_in, site_out, grid)
    params_file = given.params_file
    if params_file is None and given.speedup != 1.0:
        params_file = share('demo.yaml')
    if params_file is not None:
        check_parameters(params_file)
    bag = given.bag or Path('out') / time.strftime('fly-%Y%m%d-%H%M%S')
    _check_bag(bag, params_file)
    bind(given.port, '--port N').close()
    return FlyOptions(
        url, simulated, given.vehicle, given.speedup, given.actors, wish, given.grid, grid, params_file, bag, site_in, site_out,
        given.port, _namespace(given.namespace), not given.no_browser,
    )


def _check_combination(given: argparse.Namespace, *, simulated: bool) -> None:
    if not 0.0 < given.speedup <= 100.0:
        raise InputError(f'--speedup is {given.speedup:g}; name a number above 0 and up to 100')
    if not simulated:
        for option, set_ in (('--actors', given.actors), ('--speedup', given.speedup != 1.0), ('--wish', given.wish)):
            if set_:
                raise InputError(f'{option} is for the simulator; leave it out, or --connect')
    if given.site_map and (given.site_map_in or given.site_map_out):
        raise InputError('--site-map reads and writes one file; name it alone, or --site-map-in and --site-map-out')
    if not 0 <= given.port <= 65535:
        raise InputError(f'--port is {given.port}; name a port from 1 to 65535, or 0 for any that is free')


def _namespace(given: str) -> str:
    """With its slash, as ROS wants it.

    Raises:
        InputError: it is no name.
    """
    if not given:
        return ''
    name = '/' + given.strip('/')
    if not NAMESPACE.fullmatch(name):
        raise InputError(f"--namespace is '{given}'; it takes letters, digits and _, and begins with a letter, as drone1")
    return name


def _check_url(url: str) -> None:
    try:
        if url.startswith(SCHEME):
            prefix_of(url)
            if find_spec('px4_msgs') is None:
                raise InputError(PX4)
            return
        transport = make_transport(url, BAUD)
        transport.open()
        transport.close()
    except InputError as problem:
        raise InputError(f'--connect: {problem}') from None


def _check_bag(bag: Path, params_file: Path | None) -> None:
    if bag.exists():
        raise InputError(f'--bag is {bag}, which is there already; name a new directory, recordings are not mixed')
    config = LoggerConfig() if params_file is None else node_config(params_file, 'logger', LoggerConfig)
    refuse_a_full_disk(bag, config.min_free_mib, '--bag')

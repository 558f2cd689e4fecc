"""grid draw: serves the page on which a grid file is drawn, until Ctrl-C."""

from __future__ import annotations

import argparse
import threading
from pathlib import Path

from advise_ros.console.port import HOST, bind
from advise_ros.console.protection import Gate
from advise_ros.core.errors import InputError
from advise_ros.demo import browser
from advise_ros.exits import OK, VERDICT_NO, fail
from advise_ros.recording.mapfile import read_map
from advise_ros.recording.picturefile import corners_from_text, picture_of_map, read_picture

PORT = 8081
EPILOG = """examples:
  ./advise grid draw my_grid.yaml                                    from nothing, or going on with a file
  ./advise grid draw --picture garden.png --corners "0,0 60,40"      over a picture, 60 m wide and 40 m high
  ./advise grid draw --picture ortho.jpg --corners-wgs84 "47.3975,8.5450 47.3979,8.5458"
  ./advise grid draw --map house.yaml                                over a map of map_server, whose walls can be read

The page is served on this machine alone; keys, mouse and fingers draw. Ctrl-C here ends it.

Next: save on the page, then ./advise fly --grid my_grid.yaml

exit code: 0 ended by Ctrl-C; 1 the page cannot be served; 2 wrong usage or input"""
LOOK_S = 0.2


def add_options(parser: argparse.ArgumentParser) -> None:
    """Those of `grid draw`, and its help."""
    parser.epilog, parser.formatter_class = EPILOG, argparse.RawDescriptionHelpFormatter
    add = parser.add_argument
    add('file', metavar='FILE', nargs='?', type=Path, help='grid file to go on with, or to make (default: the page asks)')
    add('--picture', metavar='IMAGE', help='orthophoto or floor plan to draw on: PNG, JPEG, TIFF, ...')
    add('--corners', metavar='"X,Y X,Y"', help='its lower left and upper right corner in metres of the grid, in quotes; '
        'or all four from the upper left one clockwise')
    add('--corners-wgs84', metavar='"LAT,LON LAT,LON"', help='the same as latitude and longitude')
    add('--map', metavar='FILE', help='map to draw on, and to read walls off: the YAML file of map_server, map_saver')
    add('--port', type=int, default=PORT, metavar='N', help='TCP port of the page; 0: any (default %(default)s)')
    add('--no-browser', action='store_true', help='print the address only')


def run(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C; returns the exit code.

    Raises:
        InputError: one sentence with the option, its value and the remedy.
    """
    _check(options)
    picture = walls = None
    if options.map:
        walls = read_map(options.map)
        picture = picture_of_map(walls)
    elif options.picture:
        wgs84 = options.corners_wgs84 is not None
        corners = corners_from_text(options.corners_wgs84 if wgs84 else options.corners, on_earth=wgs84)
        picture = read_picture(options.picture, corners)
    from advise_ros.console.draw_page import DrawServer  # noqa: PLC0415  wrong input is said before this is loaded
    from advise_ros.console.grid_editor import GridEditor  # noqa: PLC0415

    editor = GridEditor(options.file, picture, walls)
    bound = bind(options.port, '--port N')
    port = bound.getsockname()[1]
    gate = Gate(port)
    server = DrawServer(editor, gate, bound)
    server.start()
    address = f'http://{HOST}:{port}/?token={gate.token}'
    shown = not options.no_browser and browser.show(address)
    print(f'the page {"opens in your browser" if shown else "is served, open it in a browser"}: {address}')
    print('draw the grid and save it there; Ctrl-C here ends it', flush=True)
    try:
        while not server.failure:
            threading.Event().wait(LOOK_S)
    except KeyboardInterrupt:
        return OK
    finally:
        server.stop()
    return fail(server.failure, VERDICT_NO)


def _check(options: argparse.Namespace) -> None:
    if options.file and options.file.suffix not in ('.yaml', '.yml'):
        raise InputError(f'FILE is {options.file}; name a grid file that ends in .yaml, there or to be made')
    if options.file and not options.file.parent.is_dir():
        raise InputError(f'FILE is {options.file}, and there is no folder {options.file.parent}; make it first, or name another')
    if options.map and options.picture:
        raise InputError('--map and --picture are both given; draw on one of them')
    placed = [name for name in ('corners', 'corners_wgs84') if getattr(options, name) is not None]
    if placed and not options.picture:
        raise InputError(f'--{placed[0].replace("_", "-")} places a picture; name it by --picture IMAGE')
    if options.picture and len(placed) != 1:
        both = 'both given' if placed else 'not given'
        raise InputError(
            f'--corners and --corners-wgs84 are {both}; name the lower left and the upper right corner of {options.picture} '
            'by one of them, as --corners "0,0 60,40" in metres'
        )
    if not 0 <= options.port <= 65535:
        raise InputError(f'--port is {options.port}; name a port from 1 to 65535, or 0 for any that is free')

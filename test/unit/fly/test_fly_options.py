"""What `fly` finds wrong before anything starts, and what it takes in its place."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from advise_ros.core.errors import InputError
from advise_ros.fly.options import FlyOptions, parse
from support.demo_site import SMALL_SITE

GRID = SMALL_SITE[1]


@pytest.fixture(name='somewhere', autouse=True)
def current_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def options(*arguments: str) -> FlyOptions:
    return parse(['--port', '0', *arguments])


@pytest.mark.parametrize(('arguments', 'sentence'), [
    ('--grid nowhere.yaml', 'grid file nowhere.yaml'),
    ('--connect udpin:127.0.0.1', '--connect: .*it must be udpin:HOST:PORT'),
    ('--connect /dev/nothing', "--connect: cannot open the serial device '/dev/nothing'"),
    ('--connect udpin:127.0.0.1:0', 'with a port from 1 to 65535'),
    ('--connect px4_dds:udp:8888', '--connect: url is .*; behind px4_dds: it takes the namespace'),
    ('--connect px4_dds:', '--connect: px4_msgs is not there: install it'),
    ('--connect --actors', '--actors is for the simulator; leave it out, or --connect'),
    ('--connect --speedup 5', '--speedup is for the simulator'),
    ('--namespace 1drone', "--namespace is '1drone'; it takes letters, digits and _"),
    ('--port 70000', '--port is 70000; name a port'),
    ('--speedup 0', '--speedup is 0; name a number above 0'),
    ('--speedup nan', '--speedup is nan; name a number above 0'),
    ('--params-file nowhere.yaml', 'parameter file nowhere.yaml cannot be read'),
    ('--site-map site.txt', 'name a .yaml file'),
    ('--site-map-in nowhere.yaml', 'nowhere.yaml'),
    ('--site-map a.yaml --site-map-out b.yaml', '--site-map reads and writes one file'),
    ('--wish nowhere.yaml', 'nowhere.yaml'),
    ('--bag .', '--bag is ., which is there already'),
])
def test_a_sentence_before_anything_starts(arguments: str, sentence: str, somewhere: Path) -> None:
    with pytest.raises(InputError, match=sentence):
        options('--grid', GRID, *arguments.split())
    assert not list(somewhere.iterdir())


def test_a_port_in_use_names_the_option() -> None:
    with socket.create_server(('127.0.0.1', 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"'port' is {port}.*name another port by --port N"):
            parse(['--port', str(port)])


def test_an_address_in_use_names_the_option(free_udp_port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(('127.0.0.1', free_udp_port))
        with pytest.raises(InputError, match=f'--connect: .*udpin:127.0.0.1:{free_udp_port}.*: address already in use'):
            options('--connect', f'udpin:127.0.0.1:{free_udp_port}')


def test_without_options_the_demo_route_in_a_new_dated_directory() -> None:
    given = options()
    assert given.grid_file.name == 'grid_demo.yaml'
    assert given.bag.parent == Path('out')
    assert given.bag.name.startswith('fly-')
    assert (given.simulated, given.simulated_time, given.browser, given.wish_file) == (True, False, True, None)


def test_the_simulated_people_of_the_demo_route_know_its_garden() -> None:
    given = options('--actors')
    assert given.wish_file is not None
    assert given.wish_file.name == 'garden.yaml'
    assert options('--actors', '--grid', GRID).wish_file is None


def test_a_speed_of_its_own_takes_simulated_time() -> None:
    assert options('--speedup', '10').simulated_time


@pytest.mark.parametrize(('given', 'name'), [('', ''), ('drone1', '/drone1'), ('/fleet/drone1/', '/fleet/drone1')])
def test_a_namespace_has_its_slash(given: str, name: str) -> None:
    assert options('--namespace', given).namespace == name


def test_a_site_map_is_read_and_written() -> None:
    given = options('--site-map', 'site.yaml')
    assert (given.site_map_file, given.site_map_out) == ('site.yaml', 'site.yaml')

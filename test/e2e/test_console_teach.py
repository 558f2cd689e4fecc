"""A person teaches the route from the page, in a real browser: by keys, by a gamepad, and with what can go wrong between."""

from __future__ import annotations

from pathlib import Path

import pytest
from geometry_msgs.msg import TwistStamped
from playwright.sync_api import Browser, expect

from advise_ros.core.grid.grid import Grid
from advise_ros.recording.demofile import load_demonstrations
from advise_ros.ros import qos
from support.browser import Person, start_console
from support.graph import Graph
from support.learner import write_grid

GRID = Grid(2.0, 4, 2, (-1.0, -1.0), 2.0, waypoints=(3,))
GAMEPAD = """(axes) => {
  window.axes = axes;
  const buttons = Array(17).fill({ pressed: false });
  navigator.getGamepads = () => [{ connected: true, id: 'Test pad', axes: window.axes, buttons }];
}"""


@pytest.fixture
def address(graph: Graph, tmp_path: Path, free_udp_port: int) -> str:
    """The page of a graph with a simulated vehicle."""
    grid = {'grid_file': write_grid(tmp_path, GRID)}
    graph.start('simulator', {'endpoint': f'udpout:127.0.0.1:{free_udp_port}', 'ready_after_s': 1.0, 'publish_clock': False})
    graph.start('mavlink_bridge', {**grid, 'url': f'udpin:127.0.0.1:{free_udp_port}'})
    graph.start('recorder', grid)
    return start_console(graph, **grid, speed_m_s=2.0)[1]


def take_off(person: Person) -> None:
    person.at('hand-take').click()
    person.shows('hand', 'Take off first')
    expect(person.at('vehicle')).to_contain_text('on the ground')
    expect(person.at('vehicle')).not_to_contain_text('waiting for')
    person.click('^Take off')
    person.shows('hand', 'You fly.')


def moving(commands: list[TwistStamped]) -> list[tuple[float, float, float]]:
    found = [(one.twist.linear.x, one.twist.linear.y, one.twist.linear.z) for one in commands]
    return [velocity for velocity in found if any(velocity)]


@pytest.mark.timeout(300)
def test_a_flight_by_keys_is_taught_named_kept_and_discarded(browser: Browser, address: str, tmp_path: Path) -> None:
    anna, ben = Person(browser, address, 'Anna'), Person(browser, address, 'Ben')
    take_off(anna)
    ben.shows('hand', 'Another window flies.')
    ben.at('hand-take').click()
    ben.shows('note', 'another window flies; let go there first')
    anna.page.keyboard.down('ArrowRight')
    anna.shows('lesson-flight-001', '3 moves')
    anna.page.keyboard.up('ArrowRight')
    anna.shows('lesson-flight-001', 'route flown')
    lesson = anna.at('lesson-flight-001')
    lesson.get_by_role('button', name='Rename').click()
    lesson.get_by_label('Name').fill('straight east')
    lesson.get_by_role('button', name='Save').click()
    anna.shows('note', 'is called straight east')
    ben.shows('lesson-flight-001', 'straight east')
    with anna.page.expect_download() as download:
        anna.at('download').click()
    file = tmp_path / 'demonstrations.json'
    download.value.save_as(file)
    (taught,) = load_demonstrations(file, GRID)
    assert (taught.demonstration_id, taught.actions) == ('flight-001', (1, 1, 1))
    lesson.get_by_role('button', name='Discard').click()
    anna.hides('lesson-flight-001')
    ben.hides('lesson-flight-001')
    assert not anna.errors + ben.errors


@pytest.mark.timeout(300)
def test_a_gamepad_flies_along_the_grid_until_hold(graph: Graph, browser: Browser, address: str) -> None:
    commands = graph.listen('cmd_vel', TwistStamped, qos.COMMAND_DEEP)
    anna = Person(browser, address, 'Anna')
    take_off(anna)
    anna.page.evaluate(GAMEPAD, [0.9, -0.5, 0, 0])
    graph.wait_until(lambda: len(moving(commands)) > 10, what='commands of the gamepad')
    anna.shows('gamepad', 'Test pad')
    assert {velocity[1:] for velocity in moving(commands)} == {(0.0, 0.0)}, 'a diagonal is the direction wanted most'
    anna.at('hand-pause').click()
    anna.shows('hand', 'Paused')
    paused = len(moving(commands))
    anna.at('hand-pause').click()
    graph.wait_until(lambda: len(moving(commands)) > paused + 5, what='commands after the pause')
    anna.press(' ')
    expect(anna.at('hand-take')).to_be_visible()
    graph.wait_until(lambda: is_quiet(commands), what='no motion, though the stick is still pressed')


@pytest.mark.timeout(300)
def test_a_window_that_is_gone_moves_nothing_and_who_leaves_the_grid_sees_it(
    graph: Graph, browser: Browser, address: str,
) -> None:
    commands = graph.listen('cmd_vel', TwistStamped, qos.COMMAND_DEEP)
    anna, ben = Person(browser, address, 'Anna'), Person(browser, address, 'Ben')
    take_off(anna)
    anna.page.evaluate(GAMEPAD, [0, 0.9, 0, 0])
    anna.shows('outside', 'm south of it: such moves teach nothing. Fly back.')
    anna.page.close()
    ben.shows('outside', 'outside the grid')
    graph.wait_until(lambda: is_quiet(commands), what='no command any more')
    assert moving(commands) and not moving(commands[-5:])
    ben.at('hand-take').click()
    ben.shows('hand', 'You fly.')


def is_quiet(commands: list[TwistStamped]) -> bool:
    """The latest ones are zeros."""
    return len(commands) > 10 and not moving(commands[-10:])

"""The person's page on a large map: first paint, the way of an answer's result to the screen, and what a flying drone costs.

    ./advise python benchmarks/console.py [--size 50] [--layers 5] [--repeats 10] [--seconds 10] [--json FILE]

A stand-in for the learner publishes policies and questions of a size x size grid with that many waypoints, so that the
figures are those of the page alone. First paint runs from the navigation to the painted map in a new browser; an update
from the publication of a policy with its question to the painted map; processor time is that of the console's process
and of all the browser's together, while 20 poses a second come.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from flight import cpu_s
from geometry_msgs.msg import PoseStamped
from playwright.sync_api import Browser, Page, sync_playwright
from rclpy.node import Node
from rich.console import Console
from rich.table import Table

from advise_msgs import msg
from advise_ros.core.demonstrations.demonstration import Audit, Demonstration, EndReason
from advise_ros.core.grid.grid import Action, Grid, optimal_actions
from advise_ros.demo.options import free_udp_port
from advise_ros.ros import convert, qos
from advise_ros.supervisor import Supervisor

FLAGS = (
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync',
)
PATIENCE_MS = 60_000
POSE_HZ = 20.0
PAINTED = "() => { const at = performance.getEntriesByName('map-painted'); return at.length ? at.at(-1).startTime : 0 }"
SHOWN = '(number) => window.shownAt[number]'
WATCH = """() => {
  window.shownAt = {};
  const look = () => {
    const found = document.querySelector('#question-title').textContent.match(/Question (\\d+)/);
    const painted = performance.getEntriesByName('map-painted').at(-1);
    const at = performance.timeOrigin + Math.max(painted.startTime, performance.now());
    if (found && !window.shownAt[found[1]]) window.shownAt[found[1]] = at;
    requestAnimationFrame(look);
  };
  look();
}"""


@dataclass(frozen=True)
class Figures:
    """All seconds and shares that were measured."""

    first_paint_s: list[float]
    update_s: list[float]
    console_share: float
    browser_share: float


def route_grid(size: int, layers: int) -> Grid:
    """A square with waypoints in its corners and its middle."""
    corners = [(size - 1, 0), (size - 1, size - 1), (0, size - 1), (size // 2, size // 2), (0, 0)]
    chosen = [*corners[: layers - 1], corners[-1]]
    return Grid(2.0, size, size, (-1.0, -1.0), 5.0, tuple(y * size + x for x, y in chosen))


class StandIn(Node):
    """Publishes what a learner would; every answer is a new policy with a new question."""

    def __init__(self, grid: Grid) -> None:
        super().__init__('advise')
        self._grid, self._rng = grid, np.random.default_rng(0)
        self._policies = self.create_publisher(msg.Policy, 'advise/policy', qos.latched())
        self._queries = self.create_publisher(msg.AdviceQuery, 'advise/query', qos.latched())
        self._demonstrations = self.create_publisher(msg.Demonstration, 'demonstration', qos.DEMONSTRATIONS)
        self._poses = self.create_publisher(PoseStamped, 'pose', qos.SENSOR)
        self._optimal = np.array([(optimal_actions(grid, s) or (0,))[0] for s in self._some_states()])

    def _some_states(self) -> range:
        return range(0, self._grid.n_states, max(1, self._grid.n_states // 200))

    def flown(self) -> None:
        """One flight that saw every cell of every layer once."""
        states = tuple(range(self._grid.n_states))
        actions = tuple(self._rng.integers(len(Action), size=len(states)).tolist())
        stamps = tuple(10**9 * (1 + n) for n in range(len(states)))
        self._demonstrations.publish(convert.demonstration_to_msg(Demonstration(
            'flight-001', 'made up', self._grid, states, actions, stamps, (stamps[0], stamps[-1]), EndReason.STOPPED, Audit(),
        )))

    def ask(self, number: int) -> float:
        """A policy and its question; returns when it was published (wall clock, as browsers have it)."""
        grid = convert.grid_to_msg(self._grid)
        policy = msg.Policy(version=number, grid=grid, log_length=number - 1)
        shares = self._rng.dirichlet(np.ones(len(Action)), size=self._grid.n_states).astype(np.float32)
        policy.greedy, policy.probabilities = shares.argmax(axis=1).astype(np.uint8).tolist(), shares.ravel().tolist()
        layer, width = number % self._grid.n_layers, self._grid.width
        cells = [y * width + x for y in range(2, width // 3) for x in range(2, width // 3)]
        query = msg.AdviceQuery(query_id=number, policy_version=number, grid=grid, budget_left=-1, question='Which way?')
        query.states = [layer * self._grid.n_cells + cell for cell in cells]
        query.demonstrated = query.policy = [0.25] * len(Action)
        began = time.time()
        self._policies.publish(policy)
        self._queries.publish(query)
        return began

    def fly(self, step: int) -> None:
        pose = PoseStamped()
        pose.header.frame_id = 'map'
        pose.header.stamp = self.get_clock().now().to_msg()
        pose.pose.position.x, pose.pose.position.y = 0.1 * step % 90.0, 20.0 + 10.0 * np.sin(0.05 * step)
        pose.pose.orientation.w = 1.0
        self._poses.publish(pose)


@contextmanager
def chromium() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which('chromium'), args=list(FLAGS))
        try:
            yield browser
        finally:
            browser.close()


def first_paint(browser: Browser, address: str) -> float:
    """Seconds from the navigation to the painted map, in a browser context that knows nothing yet."""
    context = browser.new_context(viewport={'width': 1440, 'height': 900})
    page = context.new_page()
    page.goto(address)
    page.wait_for_function(PAINTED, timeout=PATIENCE_MS)
    painted: float = page.evaluate("() => performance.getEntriesByName('map-painted')[0].startTime")
    context.close()
    return painted / 1000.0


def updates(page: Page, stand_in: StandIn, first: int, repeats: int) -> list[float]:
    """Seconds from each publication to its question on the screen."""
    page.evaluate(WATCH)
    seconds = []
    for number in range(first, first + repeats):
        began = stand_in.ask(number)
        page.wait_for_function(SHOWN, arg=number, timeout=PATIENCE_MS)
        page.wait_for_timeout(100)
        seconds.append(page.evaluate('(number) => window.shownAt[number]', number) / 1000.0 - began)
        page.wait_for_timeout(400)
    return seconds


def browser_pids(parent: int) -> list[int]:
    """A browser's processes: all descendants of this one that are called chrom(e|ium)."""
    parents = {}
    for stat in Path('/proc').glob('[0-9]*/stat'):
        try:
            name, _, rest = stat.read_text().partition('(')[2].rpartition(')')
        except OSError:
            continue
        parents[int(stat.parent.name)] = (int(rest.split()[1]), name)
    found, grown = {parent}, True
    while grown:
        new = {pid for pid, (above, _) in parents.items() if above in found} - found
        found |= new
        grown = bool(new)
    return [pid for pid in found if re.search('chrom', parents.get(pid, (0, ''))[1])]


def flying(stand_in: StandIn, console_pid: int, page: Page, seconds: float) -> tuple[float, float]:
    """Shares of a core that the console and the browser take while the drone flies."""
    pids = browser_pids(os.getpid())
    before, began = (cpu_s(console_pid), sum(map(cpu_s, pids))), time.monotonic()
    step = 0
    while time.monotonic() - began < seconds:
        stand_in.fly(step)
        step += 1
        page.wait_for_timeout(max(0.0, 1000.0 * (began + step / POSE_HZ - time.monotonic())))
    took = time.monotonic() - began
    return (cpu_s(console_pid) - before[0]) / took, (sum(map(cpu_s, pids)) - before[1]) / took


def measure(options: argparse.Namespace, logs: Path) -> Figures:
    grid = route_grid(options.size, options.layers)
    stand_in, port = StandIn(grid), free_udp_port()
    with Supervisor(logs) as supervisor, chromium() as browser:
        console = supervisor.start_node('console', {'port': port, 'token': 'benchmark'})
        stand_in.flown()
        stand_in.ask(1)
        address = f'http://127.0.0.1:{port}/?token=benchmark'
        wait_for_page(console.log_path)
        first_paint(browser, address)  # The server's first page also compiles its templates.
        painted = [first_paint(browser, address) for _ in range(options.repeats)]
        page = browser.new_context(viewport={'width': 1440, 'height': 900}).new_page()
        page.goto(address)
        page.wait_for_function(PAINTED, timeout=PATIENCE_MS)
        updated = updates(page, stand_in, 2, options.repeats)
        shares = flying(stand_in, console.process.pid, page, options.seconds)
    return Figures(painted, updated, *shares)


def wait_for_page(log: Path, patience_s: float = 30.0) -> None:
    """Until the console has printed its address and heard what is latched."""
    end = time.monotonic() + patience_s
    while 'Open http' not in log.read_text():
        if time.monotonic() > end:
            raise TimeoutError(log.read_text())
        time.sleep(0.1)
    time.sleep(2.0)


def table(figures: Figures, options: argparse.Namespace) -> Table:
    out = Table(title=f'The page at {options.size} x {options.size} cells, {options.layers} layers', title_justify='left')
    for heading in ('', 'median', 'worst', 'wanted'):
        out.add_column(heading)
    for name, values, wanted in (
        ('first paint', figures.first_paint_s, '< 1 s'), ('update beyond the learner', figures.update_s, '< 0.2 s'),
    ):
        out.add_row(name, f'{statistics.median(values):.3f} s', f'{max(values):.3f} s', wanted)
    console, browser = (f'{100 * share:.1f} % of a core' for share in (figures.console_share, figures.browser_share))
    out.add_row('console while the drone flies, 20 poses a second', console, '', '< 20 %')
    out.add_row('browser meanwhile', browser, '', '')
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--size', type=int, default=50)
    parser.add_argument('--layers', type=int, default=5)
    parser.add_argument('--repeats', type=int, default=10)
    parser.add_argument('--seconds', type=float, default=10.0)
    parser.add_argument('--json', type=Path)
    options = parser.parse_args()
    rclpy.init()
    with tempfile.TemporaryDirectory() as logs:
        figures = measure(options, Path(logs))
    rclpy.try_shutdown()
    Console().print(table(figures, options))
    if options.json:
        values: dict[str, Any] = vars(figures)
        options.json.write_text(json.dumps(values, indent=1))


if __name__ == '__main__':
    main()

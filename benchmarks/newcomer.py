"""From an empty folder to a flown learnt route, as a newcomer does it on the page: how long, and how many gestures.

    ./advise python benchmarks/newcomer.py [--json FILE]

One process, `./advise fly`, at real-time speed with the simulated vehicle. A scripted person opens the page, takes off,
flies the route once by the arrow keys, lands, answers what is asked (nothing is hidden here: no keep-out), takes off and
flies the policy. Each click and each key held or pressed counts as a gesture; thinking costs nothing. Clock time, one run.

Targets: less than five minutes, less than 30 gestures.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import tempfile
import time
from pathlib import Path

from console import FLAGS, PATIENCE_MS
from playwright.sync_api import Page, sync_playwright
from rich.console import Console
from rich.table import Table

from advise_ros.core.grid.grid import Grid
from advise_ros.demo.options import share
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros.graph_client import GraphClient
from advise_ros.ros.private_domain import private_domain
from advise_ros.supervisor import Supervisor, executable

PATIENCE_S = 180.0
ADDRESS = re.compile(r'http://\S+token=\S+')
KEYS = {(1, 0): 'ArrowRight', (-1, 0): 'ArrowLeft', (0, 1): 'ArrowUp', (0, -1): 'ArrowDown'}
POLL_S = 0.02


class Newcomer:
    """Clicks and presses, and counts it."""

    def __init__(self, page: Page, client: GraphClient, grid: Grid) -> None:
        self.page, self.client, self.grid = page, client, grid
        self.gestures = 0
        self.times: list[tuple[str, float]] = []
        self._at = (0.0, 0.0)
        client.on_pose = self._on_pose
        self._since_s = time.monotonic()

    def _on_pose(self, message: object) -> None:
        position = message.pose.position  # type: ignore[attr-defined]
        self._at = (position.x, position.y)

    def note(self, what: str) -> None:
        now_s = time.monotonic()
        self.times.append((what, now_s - self._since_s))
        self._since_s = now_s

    def click(self, name: str) -> None:
        self.page.get_by_role('button', name=name).first.click()
        self.gestures += 1

    def take_off(self) -> None:
        self.client.wait('the vehicle to be ready', lambda: self.client.vehicle and self.client.vehicle.ready, PATIENCE_S)
        self.click('Take off')
        self.client.wait('the climb', lambda: self.client.vehicle.commandable, PATIENCE_S)

    def hold(self, key: str, axis: int, sign: int, end_m: float) -> None:
        """Hold a key until the drone is where the leg ends."""
        self.page.keyboard.down(key)
        self.gestures += 1
        end_s = time.monotonic() + PATIENCE_S
        while sign * (end_m - self._at[axis]) > 0.0 and time.monotonic() < end_s:
            time.sleep(POLL_S)
        self.page.keyboard.up(key)

    def fly_by_hand(self) -> None:
        """All waypoints in order, first along x, then along y."""
        x, y = self.grid.centre_enu_m(self.grid.waypoints[-1])
        for waypoint in self.grid.waypoints:
            to_x, to_y = self.grid.centre_enu_m(waypoint)
            for axis, here, there in ((0, x, to_x), (1, y, to_y)):
                if there != here:
                    sign = 1 if there > here else -1
                    self.hold(KEYS[(sign, 0) if axis == 0 else (0, sign)], axis, sign, there - sign * 0.4)
            x, y = to_x, to_y

    def answer_all(self) -> int:
        """Every question until the learner knows enough; returns how many."""
        answered = 0
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            if self.page.locator('[data-test=enough]').count():
                return answered
            if self.page.locator('[data-test=option-1]:not([disabled])').count():
                self.page.keyboard.press('n')
                self.gestures += 1
                answered += 1
                self.page.wait_for_function(
                    "() => !document.querySelector('[data-test=option-1]:not([disabled])')", timeout=PATIENCE_MS,
                )
            self.page.wait_for_timeout(100)
        raise SystemExit('the learner asked for longer than the patience')


def story(page: Page, client: GraphClient, grid: Grid) -> Newcomer:
    person = Newcomer(page, client, grid)
    person.take_off()
    page.locator('[data-test=hand-take]').click()
    person.gestures += 1
    page.locator('[data-test=hand]', has_text='You fly.').wait_for()
    person.note('opened the page, took off')
    person.fly_by_hand()
    client.wait('the demonstration', lambda: bool(client.demonstrations), PATIENCE_S)
    person.note('flew the route by hand')
    answered = person.answer_all()
    person.note(f'answered {answered} questions')
    if not client.vehicle.commandable:
        person.take_off()
    person.click('Fly the policy')
    client.wait('the flight', lambda: client.flight is not None and client.flight.phase == client.flight.SUCCEEDED, PATIENCE_S)
    person.note('flew the learnt route')
    return person


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--json', type=Path, default=None, help='write the figures here too')
    given = parser.parse_args()
    with private_domain() as domain, tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        os.environ['ROS_DOMAIN_ID'] = str(domain)
        began = time.monotonic()
        with Supervisor(Path(scratch) / 'logs') as supervisor:
            bag = str(Path(scratch) / 'bag')
            command = [str(executable('fly')), '--no-browser', '--bag', bag, '--port', '0']
            flight = supervisor.start('fly', command)
            client = GraphClient('newcomer', supervisor.check)
            address = client.wait('the page', lambda: ADDRESS.search(flight.log_path.read_text()), PATIENCE_S)[0]
            browser = playwright.chromium.launch(executable_path=shutil.which('chromium'), args=list(FLAGS))
            page = browser.new_page()
            page.set_default_timeout(PATIENCE_MS)
            page.goto(address)
            person = story(page, client, load_grid(share('grid_demo.yaml')))
            whole_s = time.monotonic() - began
            browser.close()
            client.close()
    table = Table('what', 'seconds', title=f'{whole_s:.0f} s from the command on (< 300), {person.gestures} gestures (< 30)')
    for what, spent_s in person.times:
        table.add_row(what, f'{spent_s:.1f}')
    Console().print(table)
    if given.json is not None:
        given.json.write_text(json.dumps({'seconds': whole_s, 'gestures': person.gestures, 'times': person.times}) + '\n')


if __name__ == '__main__':
    main()

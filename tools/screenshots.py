"""Makes the pictures of the page in docs/images/ from a running graph: simulator, learner, policy, recorder, console.

    ./advise python tools/screenshots.py
    ./advise python tools/screenshots.py --sizes DIR   # only the question: four sizes, light and dark, two languages

Needs chromium (make chromium). It splits, answers, previews and flies as one who knows the route, and takes about a minute.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from advise_ros.core.grid.grid import Grid
from advise_ros.core.people.simulated_expert import SimulatedExpert
from advise_ros.core.people.trial import fly
from advise_ros.demo.graph import DemoGraph
from advise_ros.demo.options import DemoOptions, share
from advise_ros.demo.trials import trial_settings
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros import convert_advice
from advise_ros.ros.graph_client import GraphClient
from advise_ros.supervisor import Supervisor

IMAGES = Path(__file__).parent.parent / 'docs' / 'images'
FLAGS = ('--headless', '--no-sandbox', '--disable-gpu', '--no-first-run', '--disable-background-networking', '--disable-sync')
DESKTOP, PHONE = {'width': 1440, 'height': 900}, {'width': 390, 'height': 844}
SIZES = {'notebook': (1280, 720), 'desktop': (1920, 1080), 'tablet': (820, 1180), 'phone': (390, 844)}
PATIENCE_MS = 60_000
PATIENCE_S = 120.0
ANSWERS = 12
STEPS_FLOWN = 9
ARROWS = ('ArrowUp', 'ArrowRight', 'ArrowDown', 'ArrowLeft')
PAGE = 'Object.values(mounted_app.$refs).flat().find((element) => element && element.link)'
ASKS = f'(last) => {{ const asked = {PAGE}.query; return asked && asked.id > last ? asked.id : 0 }}'
ADDRESS = re.compile(r'http://\S+token=\S+')


def options(out: Path) -> DemoOptions:
    return DemoOptions('human', 4, 4, ANSWERS, 1, 1.0, share('grid_6x6.yaml'), share('demo.yaml'), out)


def open_page(browser: Browser, address: str, *, phone: bool = False, dark: bool = False, asked: bool = True) -> Page:
    context = browser.new_context(
        viewport=PHONE if phone else DESKTOP, device_scale_factor=2 if phone else 1, color_scheme='dark' if dark else 'light',
    )
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    page.get_by_label('Your name').fill('Anna')
    page.get_by_label('Your name').blur()
    page.locator('[data-test=connection]', has_text='live').wait_for()
    if asked:
        asks(page, 0)
    return page


def save(page: Page, name: str) -> None:
    page.wait_for_timeout(900)
    if not name.endswith('answer'):
        page.evaluate('() => scrollTo(0, 0)')
    page.screenshot(path=IMAGES / f'{name}.png')


def previewed(page: Page, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)
    page.wait_for_function("() => document.querySelector('[data-test=preview]')?.textContent.trim()")


def asks(page: Page, last: int) -> int:
    """The id of the next question."""
    number: int = page.wait_for_function(ASKS, arg=last).json_value()
    return number


def known(client: GraphClient, grid: Grid, number: int) -> list[str]:
    """The keys by which one who knows the route answers: a question of yes or no with no, as nothing is hidden here."""
    query = client.wait('the question', lambda: client.queries.get(number), PATIENCE_S)
    if query.options:
        return ['n']
    said = SimulatedExpert(grid, np.random.default_rng(0)).answer(convert_advice.query_from_msg(query))
    return [*(ARROWS[action] for action in said.preferred), *(f'Shift+{ARROWS[action]}' for action in said.avoided)]


def splitting(page: Page) -> None:
    for key in ('m', 'x', 'ArrowRight', 'x'):
        page.keyboard.press(key)
    save(page, 'console-split')
    page.keyboard.press('m')


def answering(page: Page, phone: Page, client: GraphClient, grid: Grid) -> None:
    """The first question with the answer of one who knows the route tried out, then sent."""
    keys = known(client, grid, asks(page, 0))
    previewed(page, *keys)
    save(page, 'console-question')
    previewed(phone, *keys)
    save(phone, 'console-phone')
    phone.locator('.compass').evaluate('(compass) => compass.scrollIntoView({block: "start"})')
    save(phone, 'console-phone-answer')
    page.keyboard.press('Enter')
    page.locator('.history li .gain').first.wait_for()


def flying(page: Page, client: GraphClient) -> None:
    page.get_by_role('checkbox', name='unsure').check()
    client.take_off(PATIENCE_S)
    page.get_by_role('button', name='Fly the policy').first.click()
    client.wait('the flight', lambda: client.flight is not None and client.flight.steps >= STEPS_FLOWN, PATIENCE_S)
    save(page, 'console-flying-dark')


def at_every_size(browser: Browser, address: str, out: Path) -> None:
    """The question with an answer tried out, as it is seen on four screens."""
    out.mkdir(parents=True, exist_ok=True)
    for name, (width, height) in SIZES.items():
        for scheme in ('light', 'dark'):
            for language in ('en', 'de'):
                size = {'width': width, 'height': height}
                context = browser.new_context(viewport=size, color_scheme=scheme, locale=language)
                page = context.new_page()
                page.set_default_timeout(PATIENCE_MS)
                page.goto(address)
                asks(page, 0)
                page.wait_for_function(f'() => {PAGE}.canTry')
                page.keyboard.press('ArrowRight')
                page.wait_for_function(f'() => {PAGE}.preview')
                page.wait_for_timeout(500)
                page.screenshot(path=out / f'{name}-{scheme}-{language}.png')
                context.close()


def pictures(browser: Browser, address: str, client: GraphClient, grid: Grid) -> None:
    page, phone = open_page(browser, address), open_page(browser, address, phone=True)
    splitting(page)
    answering(page, phone, client, grid)
    flying(open_page(browser, address, dark=True, asked=False), client)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--sizes', type=Path, metavar='DIR', help='only the question at four sizes, into DIR')
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        chosen = options(Path(scratch))
        grid = load_grid(chosen.grid_file)
        demonstrations = Path(scratch) / 'demonstrations.json'
        save_demonstrations(demonstrations, fly(grid, trial_settings(chosen), np.random.default_rng(chosen.seed)))
        with Supervisor(Path(scratch) / 'logs') as supervisor, sync_playwright() as playwright:
            graph = DemoGraph(chosen, grid, supervisor)
            client = GraphClient('screenshots', supervisor.check)
            graph.start_vehicle()
            graph.start_learning(chosen.seed, demonstrations)
            console = graph.start_console()
            address = client.wait('the page', lambda: ADDRESS.search(console.log_path.read_text()), PATIENCE_S)[0]
            browser = playwright.chromium.launch(executable_path=shutil.which('chromium'), args=list(FLAGS))
            if given.sizes:
                at_every_size(browser, address, given.sizes)
            else:
                pictures(browser, address, client, grid)
            browser.close()
            client.close()


if __name__ == '__main__':
    main()

"""Makes the pictures of the page in docs/images/ from a running graph: simulator, learner, policy, recorder, console.

    ./advise python tools/screenshots.py

Needs chromium (make chromium). It asks, previews, splits and flies like a person would, and takes about a minute.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from advise_ros.core.trial import fly
from advise_ros.demo.graph import DemoGraph
from advise_ros.demo.options import DemoOptions, share
from advise_ros.demo.supervisor import Supervisor
from advise_ros.demo.trials import trial_settings
from advise_ros.recording.demofile import save_demonstrations
from advise_ros.recording.gridfile import load_grid
from advise_ros.ros.graph_client import GraphClient

IMAGES = Path(__file__).parent.parent / 'docs' / 'images'
FLAGS = ('--headless', '--no-sandbox', '--disable-gpu', '--no-first-run', '--disable-background-networking', '--disable-sync')
DESKTOP, PHONE = {'width': 1440, 'height': 900}, {'width': 390, 'height': 844}
PATIENCE_MS = 60_000
PATIENCE_S = 120.0
ADDRESS = re.compile(r'http://\S+token=\S+')


def options(out: Path) -> DemoOptions:
    return DemoOptions('human', 4, 4, 6, 1, 1, 1.0, share('grid_6x6.yaml'), share('demo.yaml'), out)


def open_page(browser: Browser, address: str, *, phone: bool = False, dark: bool = False) -> Page:
    context = browser.new_context(
        viewport=PHONE if phone else DESKTOP, device_scale_factor=2 if phone else 1, color_scheme='dark' if dark else 'light',
    )
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    page.get_by_label('Your name').fill('Anna')
    page.get_by_label('Your name').blur()
    page.wait_for_function("() => document.querySelector('[data-test=status]').textContent.includes('asks')")
    return page


def save(page: Page, name: str) -> None:
    page.wait_for_timeout(900)
    if not name.endswith('answer'):
        page.evaluate('() => scrollTo(0, 0)')
    page.screenshot(path=IMAGES / f'{name}.png')


def previewed(page: Page, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)
    page.wait_for_function("() => document.querySelector('[data-test=preview]')?.textContent.includes('expected')")


def answer(page: Page, number: int, *keys: str) -> None:
    """Answer the open question by keys and wait for the next one."""
    for key in keys:
        page.keyboard.press(key)
    page.wait_for_function(
        '(last) => { const found = document.querySelector("#question-title").textContent.match(/Question (\\d+)/);'
        ' return !found || Number(found[1]) > last }', arg=number,
    )


def pictures(browser: Browser, address: str, client: GraphClient) -> None:
    page = open_page(browser, address)
    previewed(page, 'ArrowUp', 'ArrowRight')
    save(page, 'console-question')
    phone = open_page(browser, address, phone=True)
    previewed(phone, 'ArrowUp', 'ArrowRight')
    save(phone, 'console-phone')
    phone.locator('.answer').scroll_into_view_if_needed()
    phone.locator('.compass').evaluate('(compass) => compass.scrollIntoView({block: "start"})')
    save(phone, 'console-phone-answer')
    answer(page, 1, 'Enter')
    page.keyboard.press('m')
    page.keyboard.press('x')
    page.keyboard.press('ArrowRight')
    page.keyboard.press('x')
    save(page, 'console-split')
    page.keyboard.press('m')
    dark = open_page(browser, address, dark=True)
    dark.get_by_role('checkbox', name='unsure').check()
    client.take_off(PATIENCE_S)
    dark.keyboard.press('ArrowUp')
    dark.get_by_role('button', name='Fly the policy').click()
    client.wait('the flight', lambda: client.flight is not None and client.flight.steps >= 4, PATIENCE_S)
    save(dark, 'console-flying-dark')


def main() -> None:
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
            pictures(browser, address, client)
            browser.close()
            client.close()


if __name__ == '__main__':
    main()

"""How long a person who knows the route needs on the page for five questions: what the page and the learner cost of it.

    ./advise python benchmarks/newcomer.py [--questions 5]

A scripted person with the simulated expert's knowledge opens the page for the first time, presses the arrow keys,
waits for the preview, sends, and goes on with the next question; thinking costs nothing. Clock time, one run.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np
from console import FLAGS, PATIENCE_MS
from playwright.sync_api import Page, sync_playwright
from rich.console import Console
from rich.table import Table

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

ARROWS = ('ArrowUp', 'ArrowRight', 'ArrowDown', 'ArrowLeft')
PATIENCE_S = 60.0
ADDRESS = re.compile(r'http://\S+token=\S+')
PREVIEWED = "() => document.querySelector('[data-test=preview]')?.textContent.includes('waypoints')"
ASKED = """(last) => {
  const found = document.querySelector('[data-test=status]')?.textContent.match(/question (\\d+)/);
  return found && Number(found[1]) > last ? Number(found[1]) : 0;
}"""


def answer(page: Page, client: GraphClient, grid: Grid, number: int) -> None:
    """Answer one question by keys, after a look at its preview."""
    query = client.wait('the question', lambda: client.queries.get(number), PATIENCE_S)
    said = SimulatedExpert(grid, np.random.default_rng(0)).answer(convert_advice.query_from_msg(query))
    for action in said.preferred:
        page.keyboard.press(ARROWS[action])
    for action in said.avoided:
        page.keyboard.press(f'Shift+{ARROWS[action]}')
    page.wait_for_function(PREVIEWED, timeout=PATIENCE_MS)
    page.keyboard.press('Enter')


def sit(page: Page, client: GraphClient, grid: Grid, questions: int) -> list[float]:
    """Seconds from each question on the screen to the next one."""
    number, seconds = 0, []
    number = page.wait_for_function(ASKED, arg=number, timeout=PATIENCE_MS).json_value()
    for _ in range(questions):
        began = time.monotonic()
        answer(page, client, grid, number)
        number = page.wait_for_function(ASKED, arg=number, timeout=PATIENCE_MS).json_value()
        seconds.append(time.monotonic() - began)
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--questions', type=int, default=5)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        chosen = DemoOptions(
            'human', 0, 4, given.questions + 1, 1, 1.0, share('grid_demo.yaml'), share('demo.yaml'), Path(scratch),
        )
        grid = load_grid(chosen.grid_file)
        demonstrations = Path(scratch) / 'demonstrations.json'
        save_demonstrations(demonstrations, fly(grid, trial_settings(chosen), np.random.default_rng(0)))
        with Supervisor(Path(scratch) / 'logs') as supervisor:
            client, graph = GraphClient('newcomer', supervisor.check), DemoGraph(chosen, grid, supervisor)
            graph.start_vehicle()
            graph.start_learning(0, demonstrations)
            console = graph.start_console()
            address = client.wait('the page', lambda: ADDRESS.search(console.log_path.read_text()), PATIENCE_S)[0]
            browser = playwright.chromium.launch(executable_path=shutil.which('chromium'), args=list(FLAGS))
            page = browser.new_page()
            began = time.monotonic()
            page.goto(address)
            seconds = sit(page, client, grid, given.questions)
            whole = time.monotonic() - began
            browser.close()
            client.close()
    title = f'{given.questions} questions in {whole:.1f} s, opening the page included'
    table = Table('question', 'seconds to the next one', title=title)
    for number, spent in enumerate(seconds, start=1):
        table.add_row(str(number), f'{spent:.2f}')
    Console().print(table)


if __name__ == '__main__':
    main()

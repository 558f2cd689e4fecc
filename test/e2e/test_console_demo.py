"""The demo with a person: the page opens, an answer given there lets the story go on."""

from __future__ import annotations

import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from support.browser import Person
from support.demo_site import SMALL_SITE
from support.processes import executable

PATIENCE_S = 280.0
SHORT = (*SMALL_SITE, '--flights', '2', '--answers', '1')


def said(path: Path, pattern: str) -> str:
    """What the demo says in the end, found in its output."""
    end = time.monotonic() + PATIENCE_S
    while (found := re.search(pattern, path.read_text())) is None:
        assert time.monotonic() < end, f'waited in vain for {pattern}:\n{path.read_text()}'
        time.sleep(0.1)
    return found[0]


@pytest.mark.timeout(600)
def test_a_person_answers_on_the_page_and_the_story_goes_on(
    ros_env: dict[str, str], tmp_path: Path, browser: Browser,
) -> None:
    output = tmp_path / 'output'
    with output.open('wb') as sink:
        demo = subprocess.Popen(
            [executable('demo'), '--expert', 'human', '--out', str(tmp_path / 'out'), *SHORT], env=ros_env,
            stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.STDOUT, start_new_session=True,
        )
        try:
            person = Person(browser, said(output, r'http://127\.0\.0\.1:\d+/\?token=\S+'), 'Anna')
            said(output, 'Your turn')
            person.asked(int(said(output, r'Question \d+:').split()[1].rstrip(':')))
            person.shows('battery', '%')
            person.press('y')
            person.history('Anna')
            said(output, 'one question asked and answered')
        finally:
            demo.send_signal(signal.SIGINT)
            code = demo.wait(60)
    assert code == 130
    assert not person.errors

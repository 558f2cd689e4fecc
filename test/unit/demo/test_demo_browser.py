"""The demo opens the page where there is a screen, and nothing hangs on it where there is none."""

from __future__ import annotations

import threading
import webbrowser
from types import SimpleNamespace

import pytest

from advise_ros.demo import browser

ADDRESS = 'http://127.0.0.1:8080/?token=x'


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('DISPLAY', ':0')


def test_where_there_is_no_screen_none_is_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not browser.has_screen({}, 'linux') and browser.has_screen({}, 'darwin')
    for name in browser.SCREENS:
        assert browser.has_screen({name: ':0'}, 'linux')
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(webbrowser, 'get', lambda: pytest.fail('a browser in the terminal would take its keys'))
    assert not browser.show(ADDRESS)


@pytest.mark.usefixtures('screen')
def test_a_machine_without_a_browser_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> None:
        raise webbrowser.Error('could not locate runnable browser')

    monkeypatch.setattr(webbrowser, 'get', none)
    assert not browser.show(ADDRESS)


@pytest.mark.usefixtures('screen')
def test_the_page_is_opened_beside(monkeypatch: pytest.MonkeyPatch) -> None:
    opened, seen = [], threading.Event()
    monkeypatch.setattr(webbrowser, 'get', lambda: SimpleNamespace(open=lambda address: (opened.append(address), seen.set())))
    assert browser.show(ADDRESS)
    assert seen.wait(20)
    assert opened == [ADDRESS]

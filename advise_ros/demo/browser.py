"""Opens the person's page in a browser, where there is a screen for one."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser
from collections.abc import Mapping

SCREENS = ('DISPLAY', 'WAYLAND_DISPLAY')


def has_screen(environment: Mapping[str, str], platform: str) -> bool:
    """Whether a browser would come up in a window: one in the terminal would take the keys of who reads there."""
    return platform in ('darwin', 'win32') or any(environment.get(name) for name in SCREENS)


def show(address: str) -> bool:
    """Open the page beside whoever calls; False where there is no screen or no browser.

    The address is printed anyway, so nothing depends on it.
    """
    if not has_screen(os.environ, sys.platform):
        return False
    try:
        found = webbrowser.get()
    except webbrowser.Error:
        return False
    threading.Thread(target=found.open, args=(address,), name='browser', daemon=True).start()
    return True

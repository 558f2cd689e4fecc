"""What every test starts from, and in which order they run."""

import signal
from typing import Any

import pytest

STORIES = 'test/e2e'
# Stories take longest, so one worker begins with them; beside the first half of them the other runs tests of one process.
ORDER = (STORIES, 'test/unit', 'test/property', 'test/golden', 'test/fuzz', 'test/ros')


def pytest_configure() -> None:
    """Ctrl-C reaches this process and those that it starts, also where the runner of the tests ignores it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_runtest_setup() -> None:
    """Whatever a test before did with it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def folder(nodeid: str) -> str:
    """'test/e2e' of 'test/e2e/test_fly.py::test_it'."""
    return '/'.join(nodeid.split('/')[:2])


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """By folders, in ORDER and others last, and as they were within each."""
    places = {name: place for place, name in enumerate(ORDER)}
    items.sort(key=lambda item: places.get(folder(item.nodeid), len(ORDER)))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """--dist loadfile, and all stories to one worker: two at once, each with browsers or ten nodes, starve on two cores."""
    from xdist.scheduler import LoadFileScheduling

    class ByFile(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return STORIES if folder(nodeid) == STORIES else super()._split_scope(nodeid)

    if config.getoption('dist') != 'loadfile':
        return None
    config.option.loadscopereorder = False
    return ByFile(config, log)

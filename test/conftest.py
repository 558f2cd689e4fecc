"""What every test starts from."""

import signal


def pytest_configure() -> None:
    """Ctrl-C reaches this process and those that it starts, also where the runner of the tests ignores it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_runtest_setup() -> None:
    """Whatever a test before did with it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)

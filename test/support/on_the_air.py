"""A simulated autopilot behind UDP, without ROS, for what talks to one over a link."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from advise_ros.config import SimulatorConfig
from advise_ros.sim.link import SimulatorLink
from advise_ros.sim.parameters import AutopilotParameters

TICK_S = 0.0025  # Ten times faster than real.


@contextlib.contextmanager
def on_the_air(
    dialect: Any, port: int, key: bytes | None = None, *, before: Callable[[Any, Any], None] = lambda autopilot, message: None,
) -> Iterator[Any]:
    """The simulated autopilot, in a thread of its own; `before` sees it with each message that it is about to take."""
    autopilot = dialect(SimulatorConfig(ready_after_s=2.0), np.random.default_rng(0))
    link, end = SimulatorLink(f'udpout:127.0.0.1:{port}', 1, 1, key), threading.Event()

    def run() -> None:
        while not end.wait(TICK_S):
            for message in link.read():
                before(autopilot, message)
                link.send(autopilot.receive(message))
            link.send(autopilot.step())

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield autopilot
    finally:
        end.set()
        thread.join(5)
        link.close()


def parameters_of(autopilot: Any) -> AutopilotParameters:
    """The simulated autopilot's own."""
    return autopilot._parameters

"""While the learner learns and previews on a large grid, its callbacks are served."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from advise_msgs.srv import PreviewAnswer
from advise_ros.core.grid.grid import Grid
from advise_ros.core.site import within_advise
from advise_ros.core.site.belief import SamplerSettings, believe, tell
from advise_ros.nodes.advise import AdviseNode
from advise_ros.ros import convert, convert_advice, maps, markers, preview
from support.learner import write_grid
from support.walks import walk

GRID_60X60 = Grid(2.0, 60, 60, (-1.0, -1.0), 3.0, waypoints=(59, 3599, 3540, 0))
PERIOD_S = 0.01
# A timer of the node and a thread beside it count the same periods, and a busy machine holds up both.
LONGEST_PERIODS = 25
# Maps are drawn in compiled loops, which hold nobody up however long they run: they may be few.
FEW_MAPS = SamplerSettings(steps_per_cell=5, last_per_cell=5)


class Ticks:
    """Counts periods in a thread of its own, and how many of them pass between two ticks of a node's timer."""

    def __init__(self) -> None:
        self.count = self.longest = self.of_node = self._last = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.wait(PERIOD_S):
            self.count += 1

    def tick(self) -> None:
        """The node's timer is served."""
        self.of_node += 1
        self.longest, self._last = max(self.longest, self.count - self._last), self.count

    def begin(self) -> None:
        """Count anew."""
        self.longest, self._last = 0, self.count

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()


class Spun:
    """A learner in this process, and its executor in this thread."""

    def __init__(self, grid_file: str) -> None:
        arguments = ['--ros-args', '-p', f'grid_file:={grid_file}', '-p', 'demonstrations_min:=2']
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        self.node = AdviseNode()
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.ticks = Ticks()
        self.node.create_timer(PERIOD_S, self.ticks.tick, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.client = self.node.create_client(PreviewAnswer, 'advise/preview')

    def until(self, condition: Callable[[], Any]) -> None:
        while not condition():
            self.executor.spin_once(timeout_sec=1.0)

    def close(self) -> None:
        self.ticks.stop()
        self.node.close()
        self.node.destroy_node()
        self.executor.shutdown()
        rclpy.shutdown()


@pytest.fixture
def few_maps(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The learner draws a tenth of its maps."""
    monkeypatch.setattr(within_advise, 'believe', partial(believe, settings=FEW_MAPS))
    monkeypatch.setattr(within_advise, 'tell', partial(tell, settings=FEW_MAPS))
    yield
    within_advise._remembered.cache_clear()


@pytest.fixture
def learner(few_maps: None, ros_env: dict[str, str], tmp_path: Path) -> Iterator[Spun]:
    spun = Spun(write_grid(tmp_path, GRID_60X60))
    try:
        yield spun
    finally:
        spun.close()


@pytest.fixture
def threads(monkeypatch: pytest.MonkeyPatch) -> dict[str, set[str]]:
    """Name of what takes long on a large grid -> the threads that it ran in."""
    ran: dict[str, set[str]] = {}
    for module, name in (
        (convert_advice, 'policy_to_msg'), (convert_advice, 'query_to_msg'), (maps, 'uncertainty_map'), (maps, 'reward_map'),
        (markers, 'question_markers'), (preview, 'expected_success'), (preview, 'rollout'),
    ):
        monkeypatch.setattr(module, name, noting(getattr(module, name), ran.setdefault(name, set())))
    return ran


def noting(function: Callable[..., Any], threads: set[str]) -> Callable[..., Any]:
    def noted(*given: Any) -> Any:
        threads.add(threading.current_thread().name)
        return function(*given)

    return noted


def test_a_timer_keeps_its_period_while_a_large_grid_is_learnt_and_previewed(
    learner: Spun, threads: dict[str, set[str]],
) -> None:
    learner.until(learner.client.service_is_ready)
    for number in range(2):
        learner.node._on_demonstration(convert.demonstration_to_msg(walk(GRID_60X60, number)))
    learner.ticks.begin()
    learner.until(lambda: learner.node._session.query)
    query = learner.node._session.query
    assert query is not None
    go = threading.Event()
    learner.node._worker.submit(go.wait, lambda done: None)
    asked = [
        learner.client.call_async(PreviewAnswer.Request(query_id=query.query_id, preferred=[action], avoided=[3]))
        for action in (0, 1, 2)
    ]
    learner.until(lambda: sum(reply.done() for reply in asked) == 2)
    go.set()
    learner.until(lambda: all(reply.done() for reply in asked))
    assert learner.ticks.longest <= LONGEST_PERIODS, f'{learner.ticks.of_node} ticks of {learner.ticks.count}'
    assert {name: ran for name, ran in threads.items() if ran != {'worker'}} == {}
    assert sum(reply.result().valid for reply in asked) == 1
    assert sum('a newer one took its place' in reply.result().message for reply in asked) == 2

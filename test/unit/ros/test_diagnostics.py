"""When a node says how it is: sooner at first, and how long its start took. The node is a MOCK."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Time

from advise_ros.ros.diagnostics import AT_WORK_AFTER, EARLY_TIMES, OK, Diagnostics, age_of_process_s


class MockNode:
    """Keeps what is published, and the timer's period."""

    def __init__(self) -> None:
        self.said: list[dict[str, str]] = []
        self.timer = SimpleNamespace(timer_period_ns=0)

    def get_fully_qualified_name(self) -> str:
        return '/mock'

    def create_publisher(self, *_: Any) -> Any:
        return SimpleNamespace(publish=self._publish)

    def _publish(self, array: Any) -> None:
        (status,) = array.status
        self.said.append({'': status.message, **{pair.key: pair.value for pair in status.values}})

    def create_timer(self, period_s: float, callback: Any, clock: Any) -> Any:
        self.timer.timer_period_ns, self.tick = round(period_s * 1e9), callback
        return self.timer

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time))

    def get_logger(self) -> Any:
        return SimpleNamespace(info=lambda _: None)


def test_a_node_says_it_five_times_a_second_at_first_and_then_once() -> None:
    node, reports = MockNode(), []
    Diagnostics(node, lambda: reports.append(1))  # type: ignore[arg-type]
    periods_s = []
    for _ in range(EARLY_TIMES + 2):
        periods_s.append(node.timer.timer_period_ns / 1e9)
        node.tick()
    assert periods_s == [0.0, *[0.2] * (EARLY_TIMES - 1), 1.0, 1.0], 'before each'
    assert len(node.said) == len(reports) == EARLY_TIMES + 2


def test_what_it_reports_is_in_the_same_publication() -> None:
    node = MockNode()
    diagnostics = Diagnostics(node, lambda: diagnostics.set(OK, 'well', {'count': 1}))  # type: ignore[arg-type]
    node.tick()
    assert node.said[-1][''] == 'well' and node.said[-1]['count'] == '1'


def test_how_long_its_start_took_is_said_once_it_is_at_work() -> None:
    node = MockNode()
    diagnostics = Diagnostics(node)  # type: ignore[arg-type]
    node.tick()
    assert AT_WORK_AFTER not in node.said[-1]
    before_s = age_of_process_s()
    diagnostics.set(OK, 'at work')
    first = node.said[-1][AT_WORK_AFTER]
    assert float(first) >= round(before_s, 2) - 0.01
    diagnostics.set(OK, 'still')
    assert node.said[-1][AT_WORK_AFTER] == first


def test_the_age_of_a_process_goes_with_the_clock() -> None:
    began_s = time.monotonic()
    before_s, after_s = age_of_process_s(), age_of_process_s()
    assert 0.0 < before_s <= after_s <= before_s + time.monotonic() - began_s + 0.02

"""Waiting on a busy machine: only time in which the processes could run counts, and what computes is waited for."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from concurrent.futures import Future
from pathlib import Path

import pytest
import yaml

from advise_ros.core.errors import AdviseError
from advise_ros.demo import trials
from advise_ros.fair_clock import FairClock, cpu_s, queued_s
from advise_ros.ros.graph_client import GraphClient, GraphTimeoutError
from advise_ros.supervisor import Supervisor, ros_arguments

CHILD = 4711


class Machine:
    """A wall clock and what the threads of one child waited for a processor."""

    def __init__(self) -> None:
        self.wall_s = 100.0
        self.waited_s = {'1': 50.0, '2': 0.0}
        self.clock = FairClock(lambda: [CHILD], lambda: self.wall_s, self.queued)

    def queued(self, pid: int) -> dict[tuple[int, str], float]:
        return {(pid, thread): s for thread, s in self.waited_s.items()} if pid == CHILD else {}

    def pass_time(self, seconds: float, *, waited: float = 0.0) -> float:
        self.wall_s += seconds
        self.waited_s['2'] += waited
        return self.clock()


def test_on_a_free_machine_a_second_is_a_second() -> None:
    machine = Machine()
    assert machine.pass_time(1.0) == pytest.approx(1.0)
    assert machine.pass_time(20.0) == pytest.approx(21.0)


def test_time_without_a_processor_does_not_count() -> None:
    machine = Machine()
    machine.pass_time(1.0)
    assert machine.pass_time(100.0, waited=90.0) == pytest.approx(11.0)


def test_a_wait_that_the_kernel_books_late_is_taken_off_afterwards() -> None:
    machine = Machine()
    machine.pass_time(10.0)
    assert machine.pass_time(1.0, waited=11.0) == pytest.approx(10.05)
    assert machine.pass_time(10.0) == pytest.approx(10.55), 'ten of the eleven seconds were still to be taken off'
    assert machine.pass_time(10.0) == pytest.approx(20.0)
    assert machine.pass_time(10.0) == pytest.approx(30.0)


def test_every_wait_ends_however_busy_the_machine() -> None:
    machine = Machine()
    for _ in range(100):
        machine.pass_time(1.0, waited=1.0)
    assert machine.clock() >= 5.0


def test_the_kernel_says_how_long_a_process_waited_and_worked() -> None:
    began = cpu_s(os.getpid())
    while cpu_s(os.getpid()) < began + 0.05:
        pass
    assert queued_s(os.getpid())
    assert all(s >= 0 for s in queued_s(os.getpid()).values())
    gone = subprocess.Popen(['true'])
    gone.wait()
    assert (queued_s(gone.pid), cpu_s(gone.pid)) == ({}, 0.0)


def client_by(clock: Machine) -> GraphClient:
    """A client that waits by a machine's clock, without a graph."""
    client = GraphClient.__new__(GraphClient)
    client._clock, client._check = clock.clock, lambda: None
    return client


def test_what_goes_on_is_waited_for_and_what_hangs_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = Machine()
    client, done = client_by(machine), [0]

    def work(_: float) -> None:
        machine.pass_time(100.0)
        done[0] = min(done[0] + 1, 30)

    monkeypatch.setattr(time, 'sleep', work)
    client.wait('the trials', lambda: done[0] == 30, 300.0, lambda: done[0])
    assert machine.clock() == pytest.approx(3000.0)
    with pytest.raises(GraphTimeoutError, match='waited 300 s in vain for the trials'):
        client.wait('the trials', lambda: done[0] == 31, 300.0, lambda: done[0])


def test_a_dead_process_of_the_trials_is_named() -> None:
    pool = trials.TrialPool()
    dead: Future[trials.TrialResult] = Future()
    dead.set_exception(trials.BrokenProcessPool())
    pool._futures = [dead]
    with pytest.raises(AdviseError, match='the process of the trials was killed'):
        pool.results()
    pool.close()


def test_a_child_that_does_not_stop_is_made_to_and_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('advise_ros.supervisor.STOP_PATIENCE_S', 0.5)
    ready = 'import signal, sys, time; signal.signal(signal.SIGINT, signal.SIG_IGN); print(1, flush=True); time.sleep(600)'
    with Supervisor(tmp_path / 'logs') as supervisor:
        deaf, willing = (supervisor.start(name, [sys.executable, '-u', '-c', code]) for name, code in (
            ('deaf', ready), ('willing', ready.replace('SIG_IGN', 'SIG_DFL')),
        ))
        while not all(child.log_path.read_text() for child in (deaf, willing)):
            time.sleep(0.01)
        assert supervisor.stop(deaf, willing) == ('deaf',)


@pytest.mark.parametrize('path', ['/home/anna/my drones/1: first #2', "/home/Anna's", '/home/jörg', '/home/null'])
def test_a_path_reaches_a_node_as_it_is(path: str) -> None:
    (_, _, given) = ros_arguments({'bag': Path(path)})
    assert yaml.safe_load(given.removeprefix('bag:=')) == path



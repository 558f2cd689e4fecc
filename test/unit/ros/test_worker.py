"""The worker beside the executor."""

import threading

from advise_ros.ros.worker import Finished, Superseded, Worker


def test_results_come_in_order_and_only_on_the_thread_that_delivers() -> None:
    woken, seen = threading.Semaphore(0), []
    worker = Worker(woken.release)

    def job(number: int) -> str:
        return f'{number} {threading.current_thread().name}'

    for number in range(3):
        worker.submit(lambda number=number: job(number), lambda done: seen.append((done.value, threading.current_thread())))
    for _ in range(3):
        assert woken.acquire(timeout=10)
    assert seen == []
    worker.deliver()
    here = threading.current_thread()
    assert seen == [('0 worker', here), ('1 worker', here), ('2 worker', here)]


def test_a_job_that_raises_is_delivered_as_its_error_and_the_next_one_runs() -> None:
    woken = threading.Semaphore(0)
    seen: list[Finished] = []
    worker = Worker(woken.release)
    worker.submit(lambda: 1 // 0, seen.append)
    worker.submit(lambda: 'fine', seen.append)
    for _ in range(2):
        assert woken.acquire(timeout=10)
    worker.deliver()
    assert isinstance(seen[0].error, ZeroDivisionError) and seen[0].value is None
    assert seen[1].error is None and seen[1].value == 'fine'
    assert all(finished.seconds >= 0 for finished in seen)


def test_closed_it_wakes_nobody_though_a_job_still_runs() -> None:
    go, ended, woken = threading.Event(), threading.Event(), []
    worker = Worker(lambda: woken.append(True))

    def job() -> None:
        go.wait(10)
        ended.set()

    worker.submit(job, lambda done: None)
    worker.close()
    go.set()
    assert ended.wait(10)
    assert worker._thread is not None
    worker._thread.join(10)
    assert not worker._thread.is_alive()
    assert woken == []


def test_of_previews_that_wait_the_newest_runs_and_after_what_is_to_be_learnt() -> None:
    go, begun, woken = threading.Event(), threading.Event(), threading.Semaphore(0)
    ran: list[str] = []
    ended: dict[str, Finished] = {}
    worker = Worker(woken.release)

    def first() -> None:
        begun.set()
        go.wait(10)
        ran.append('first')

    worker.submit(first, lambda done: None)
    assert begun.wait(10)
    for name in ('old preview', 'newer preview', 'newest preview'):
        worker.submit_newest(lambda name=name: ran.append(name), lambda done, name=name: ended.update({name: done}))
    worker.submit(lambda: ran.append('learning'), lambda done: None)
    go.set()
    for _ in range(5):
        assert woken.acquire(timeout=10)
    worker.deliver()
    assert ran == ['first', 'learning', 'newest preview']
    assert {name for name, done in ended.items() if isinstance(done.error, Superseded)} == {'old preview', 'newer preview'}
    assert ended['newest preview'].error is None


def test_idle_work_is_done_when_nothing_else_waits_and_only_the_newest() -> None:
    go, begun, woken = threading.Event(), threading.Event(), threading.Semaphore(0)
    ran: list[str] = []
    worker = Worker(woken.release)

    def first() -> None:
        begun.set()
        go.wait(10)

    worker.submit(first, lambda done: None)
    assert begun.wait(10)
    for name in ('old', 'new'):
        worker.submit_idle(lambda name=name: ran.append(name), lambda done: None)
    worker.submit_newest(lambda: ran.append('preview'), lambda done: None)
    worker.submit(lambda: ran.append('learning'), lambda done: None)
    go.set()
    for _ in range(4):
        assert woken.acquire(timeout=10)
    assert ran == ['learning', 'preview', 'new']

"""Work off the thread of the windows: nothing is lost, nothing piles up, everything can be ended."""

from __future__ import annotations

import threading
import time
from functools import partial

import pytest

from stickslip.errors import InputError
from stickslip.system.progress import Cancelled, breathe, portion, showing
from stickslip.workbench.background_work import background, close_all
from stickslip.workbench.session import Session
from stickslip.workbench.worker import Search, Worker


def until(true, seconds=20.0):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_of_many_moves_the_last_is_always_reached_and_no_queue_grows():
    done: list[int] = []
    work = Worker()
    for i in range(200):
        work("hand", lambda i=i: (time.sleep(0.01), done.append(i)))
    until(lambda: done and done[-1] == 199)
    assert len(done) < 5


def test_a_fit_between_two_moves_stays_between_them():
    done: list[str] = []
    work = Worker()
    started, go = threading.Event(), threading.Event()
    work("", lambda: (started.set(), go.wait()))
    started.wait()
    work("hand", lambda: done.append("one"))
    work("", lambda: done.append("fit"))
    work("hand", lambda: done.append("two"))
    go.set()
    until(lambda: len(done) == 3)
    assert done == ["one", "fit", "two"]


def test_what_waits_until_all_is_still_begins_anew_with_each_move():
    done: list[float] = []
    work = Worker()
    for _ in range(5):
        work("judge", lambda: done.append(time.monotonic()), 0.15)
        time.sleep(0.05)
    last = time.monotonic()
    until(lambda: done)
    time.sleep(0.3)
    assert len(done) == 1 and done[0] > last


def test_a_job_ends_at_its_next_step_and_what_waits_is_forgotten():
    said: list[str] = []
    work = Worker()
    started = threading.Event()

    def long():
        started.set()
        try:
            while True:
                breathe()
                time.sleep(0.005)
        except Cancelled:
            said.append("cancelled")

    work("", long)
    work("", lambda: said.append("never"))
    started.wait()
    work.cancel()
    until(lambda: said)
    work("", lambda: said.append("next"))
    until(lambda: "next" in said)
    assert said == ["cancelled", "next"]


def test_outside_of_cancellable_work_nothing_is_asked():
    breathe()


def test_shares_of_parts_add_up_to_the_whole():
    told: list[float] = []
    breathe(0.5)  # nobody is shown it
    with showing(told.append):
        breathe(0.0)
        with portion(0.0, 0.5):
            breathe(0.5)
            with portion(0.5, 1.0):
                breathe(0.5)
        breathe(0.75)
        breathe()
    assert told == [0.0, 0.25, 0.375, 0.75]


def test_a_job_that_fails_leaves_the_thread_alive(caplog):
    work = Worker()
    done = threading.Event()
    work("", lambda: 1 / 0)
    work("", done.set)
    assert done.wait(10)


def _counts(to, tell):
    for i in range(to):
        tell(str(i), (i + 1) / to)
    return to


def _refuses(tell):
    raise InputError("no such thing", key="rig.mass")


def _never(tell):
    tell("begun", 0.0)
    time.sleep(600)


def test_a_search_tells_and_returns():
    told, found, failed = [], [], []
    Search(partial(_counts, 3), (), lambda *a: told.append(a), found.append, failed.append)
    until(lambda: found, 60)
    assert found == [3] and told[-1] == ("2", 1.0) and not failed


def test_a_search_that_fails_says_so():
    failed: list[str] = []
    Search(_refuses, (), lambda *a: None, lambda a: None, failed.append)
    until(lambda: failed, 60)
    assert failed == ["rig.mass: no such thing"]


def test_a_search_is_cancelled_and_says_no_more():
    told, failed = [], []
    search = Search(_never, (), lambda *a: told.append(a), lambda a: None, failed.append)
    until(lambda: told, 60)
    search.cancel()
    until(lambda: not search._process.is_alive())
    time.sleep(0.2)
    assert not failed


def test_a_search_that_the_system_ends_says_so():
    told, failed = [], []
    search = Search(_never, (), lambda *a: told.append(a), lambda a: None, failed.append)
    until(lambda: told, 60)
    search._process.kill()
    until(lambda: failed)
    assert "memory" in failed[0]


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    """Functions of this module are found by a process that is started afresh."""
    import os
    from pathlib import Path

    monkeypatch.setenv(
        "PYTHONPATH", os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    )


def _lingers(tell):
    threading.Thread(target=time.sleep, args=(600,)).start()
    return "done"


@pytest.mark.slow
def test_a_process_that_does_not_end_after_its_answer_is_ended():
    found: list[str] = []
    search = Search(_lingers, (), lambda *a: None, found.append, lambda text: None)
    until(lambda: found, 60)
    until(lambda: not search._process.is_alive(), 20)


def test_work_beside_ends_with_the_server(campaign):
    session = Session(campaign=campaign, worker=Worker())
    begun = threading.Event()

    def endless(tell, show):
        begun.set()
        while True:
            tell("turning", 0.5)
            time.sleep(0.01)

    work = background(session, "simulation")
    work.do("turning", endless)
    begun.wait()
    close_all(session)
    assert work.doing == "" and work.said == "cancelled"

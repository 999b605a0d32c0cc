"""Executors keep what they promise: all of them, or processes alone."""

import contextlib
import os

import pytest
import worker_tasks as tasks

from moldline.errors import ParameterError, TaskError
from moldline.workers import Processes, Serial, Threads


@pytest.fixture(scope="module")
def processes():
    executor = Processes(2)
    yield executor
    executor.close()


@pytest.fixture(params=["serial", "threads", "processes"])
def executor(request, processes):
    return {"serial": Serial(), "threads": Threads(2), "processes": processes}[request.param]


def numbered(*arguments):
    return {f"task {k}": argument for k, argument in enumerate(arguments)}


def test_values_come_in_the_order_of_the_tasks(executor):
    given = {f"task {k}": (k, 4) for k in range(4)}
    assert executor.all(tasks.late, given) == [0, 1, 2, 3]


def test_a_failure_stops_no_other_and_is_told_by_its_task(executor):
    outcomes = sorted(executor.run(tasks.picky, numbered(0, 1, 2, 3)), key=lambda o: o.number)
    assert [o.value for o in outcomes] == [0, 1, None, 3]
    with pytest.raises(TaskError, match=r"^task 2: 2 is a bad number$"):
        outcomes[2].result()
    with pytest.raises(TaskError, match=r"^task 2: 2 is a bad number$"):
        executor.all(tasks.picky, numbered(0, 1, 2, 3))


def test_outcomes_come_as_they_end():
    outcomes = Threads(3).run(tasks.late, {str(k): (k, 3) for k in range(3)})
    assert [o.number for o in outcomes] == [2, 1, 0]


def test_what_takes_too_long_is_stopped_and_told(executor, tmp_path):
    given = {"slow": str(tmp_path)}
    (outcome,) = executor.run(tasks.endless, given, limit=1.5)
    with pytest.raises(TaskError, match=r"^slow: it took longer than its limit of 1\.5 s"):
        outcome.result()
    assert tasks.gone(int(tasks.present(tmp_path / "pid")))


def test_who_stops_listening_cancels_the_rest(executor, tmp_path):
    if isinstance(executor, Serial):
        pytest.skip("one by one, nothing else is under way")
    (tmp_path / "a").mkdir()
    with contextlib.closing(executor.run(tasks.either, {"a": "", "b": str(tmp_path / "a")})) as run:
        assert next(run).name == "a"
        process = int(tasks.present(tmp_path / "a/pid"))
    assert tasks.gone(process)


def test_a_task_whose_worker_is_killed_is_done_by_another(processes, tmp_path):
    given = {"unlucky": str(tmp_path)}
    (outcome,) = processes.run(tasks.killed_once, given)
    assert (outcome.value, outcome.attempts) == ("done", 2)


def test_a_task_that_kills_its_workers_is_given_up_and_told(processes):
    outcomes = {o.name: o for o in processes.run(tasks.killed, {"bad": 0})}
    with pytest.raises(TaskError, match=r"bad: its worker died \(signal 9\), and so did the one"):
        outcomes["bad"].result()
    assert processes.all(tasks.squared, numbered(2, 3)) == [4, 9]


def test_workers_wait_for_more_and_see_their_environment():
    executor = Processes(1, {"MOLDLINE_TEST": "here"})
    first = executor.all(tasks.process, numbered(0, 1))
    second = executor.all(tasks.process, numbered(0))
    executor.close()
    assert {*first, *second} == {(first[0][0], "here")}
    assert first[0][0] != os.getpid()
    assert tasks.gone(first[0][0])


def test_an_error_that_cannot_travel_is_told_in_words(processes):
    with pytest.raises(TaskError, match="task 0: Odd: this"):
        processes.all(tasks.odd, numbered(0))


def test_what_cannot_travel_is_told_by_its_task(processes):
    with pytest.raises(ParameterError, match="task 0: cannot travel to another process"):
        processes.all(tasks.squared, numbered(lambda: 0))


def test_no_workers_are_none():
    for kind in (Threads, Processes):
        with pytest.raises(ParameterError, match="1 worker or more, got 0"):
            kind(0)

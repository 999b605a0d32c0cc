"""A real Dask cluster of this machine, whose worker is killed in mid-run."""

import os
import signal
import time

import pytest
import worker_tasks as tasks

from moldline.errors import ParameterError, TaskError
from moldline.workers import Dask

pytest.importorskip("distributed", reason='Dask comes with pip install "moldline[cluster]"')
pytestmark = pytest.mark.filterwarnings("ignore")  # Dask's own, on ports and clocks


@pytest.fixture(scope="module")
def cluster():
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=3, threads_per_worker=1, dashboard_address=None, processes=True
    ) as started:
        yield started


@pytest.fixture
def executor(cluster):
    executor = Dask(cluster.scheduler_address)
    yield executor
    executor.close()


def test_a_killed_workers_tasks_are_done_elsewhere_and_nothing_is_lost(executor, tmp_path):
    """Each task writes a file of its own, which must hold what is its own."""
    count = 15
    given = {f"sample {k}": (str(tmp_path), k) for k in range(count)}
    outcomes, dead = [], None
    for outcome in executor.run(tasks.written, given):
        outcomes.append(outcome)
        if dead is None:
            dead = _kill_a_busy_one(tmp_path, outcome.value[1])
    assert dead is not None
    assert sorted(o.number for o in outcomes) == list(range(count))
    assert [o.result()[0] for o in sorted(outcomes, key=lambda o: o.number)] == list(range(count))
    for k in range(count):
        assert (tmp_path / f"{k:03}.txt").read_text() == f"{k} " * 1000
    begun = [path.name.split("-") for path in tmp_path.glob("begun-*")]
    lost = [number for _, number, process in begun if int(process) == dead]
    assert lost and all((tmp_path / f"{int(number):03}.txt").exists() for number in lost)
    assert len(begun) > count  # what was under way was begun again


def _kill_a_busy_one(folder, other):
    """Kill a worker, not the one that has just answered, while it is at a task."""
    for _ in range(200):
        names = [path.name.split("-") for path in folder.glob("begun-*")]
        busy = [
            int(process)
            for _, number, process in names
            if int(process) != other and not (folder / f"{int(number):03}.txt").exists()
        ]
        if busy:
            os.kill(busy[0], signal.SIGKILL)
            return busy[0]
        time.sleep(0.01)
    return None


def test_a_failure_is_told_by_its_task_and_stops_no_other(executor):
    outcomes = executor.run(tasks.picky, {f"task {k}": k for k in range(4)})
    outcomes = sorted(outcomes, key=lambda o: o.number)
    assert [o.value for o in outcomes] == [0, 1, None, 3]
    with pytest.raises(TaskError, match=r"^task 2: 2 is a bad number$"):
        outcomes[2].result()


def test_what_takes_too_long_is_stopped_and_told(executor, tmp_path):
    with pytest.raises(TaskError, match=r"^slow: it took longer than its limit of 1 s"):
        executor.all(tasks.endless, {"slow": str(tmp_path)}, limit=1.0)
    assert tasks.gone(int(tasks.present(tmp_path / "pid")))


def test_a_scheduler_that_is_not_there_is_told():
    with pytest.raises(ParameterError, match="no Dask scheduler answers at"):
        Dask("tcp://127.0.0.1:9")

"""A program runs in its own directory, once, and what goes wrong is told with its log."""

import contextlib
import sys

import pytest
from worker_tasks import gone, present

from moldline.errors import TaskError
from moldline.workers import Processes, Threads
from moldline.workers.programs import GivenFile, Job, ran, settled

COPY = """\
import pathlib
print("copies")
pathlib.Path("out").write_text(pathlib.Path("in").read_text() * 2)
"""


def job(store, script=COPY, given=b"word", **options):
    files = (GivenFile("program.py", script.encode()), GivenFile("in", given))
    return Job((sys.executable, "program.py"), files, ("out",), store, **options)


def test_a_program_runs_once_and_its_results_are_kept(tmp_path):
    first, second = ran(job(tmp_path)), ran(job(tmp_path))
    assert first.files == second.files == {"out": b"wordword"}
    assert (first.is_new, second.is_new) == (True, False)
    assert sorted(p.name for p in first.place.iterdir()) == ["log.txt", "out"]
    assert (first.place / "log.txt").read_text() == "copies\n"
    assert list((tmp_path / "running").iterdir()) == []


def test_other_contents_of_any_file_are_another_run(tmp_path):
    keys = {
        job(tmp_path).key,
        job(tmp_path, given=b"other").key,
        job(tmp_path, COPY + "\n").key,
        job(tmp_path, environment=(("MODE", "1"),)).key,
    }
    assert len(keys) == 4
    assert job(tmp_path, limit=3.0).key == job(tmp_path).key


def test_the_same_run_in_two_processes_is_done_once(tmp_path):
    slow = "import time, os; time.sleep(0.5); open('out', 'w').write(str(os.getpid()))"
    executor = Processes(2)
    one, two = executor.all(ran, {"one": job(tmp_path, slow), "two": job(tmp_path, slow)})
    executor.close()
    assert one.files == two.files
    assert sorted([one.is_new, two.is_new]) == [False, True]


def test_a_failure_tells_command_directory_and_last_lines(tmp_path):
    script = "import sys; print('reads the profile'); print('no such gear'); sys.exit(3)"
    with pytest.raises(TaskError) as told:
        ran(job(tmp_path, script))
    text = str(told.value)
    (directory,) = (tmp_path / "failed").iterdir()
    assert f"program.py` ended with status 3; its directory: {directory}" in text
    assert text.endswith("    reads the profile\n    no such gear")
    assert (directory / "in").read_text() == "word"


def test_what_it_should_have_left_is_told(tmp_path):
    with pytest.raises(TaskError, match="ended well but left no 'out'"):
        ran(job(tmp_path, "print(1)"))


def test_a_program_that_is_not_there_is_told(tmp_path):
    missing = Job(("moldline_no_such_program",), (), ("out",), tmp_path)
    with pytest.raises(TaskError, match="cannot be started: no such file"):
        ran(missing)


def test_it_is_tried_again_only_where_asked(tmp_path):
    script = f"""\
import pathlib, sys
mark = pathlib.Path({str(tmp_path / "mark")!r})
if not mark.exists():
    mark.touch()
    sys.exit(1)
pathlib.Path("out").touch()
"""
    with pytest.raises(TaskError, match="status 1"):
        ran(job(tmp_path / "store", script))
    (tmp_path / "mark").unlink()
    assert ran(job(tmp_path / "store", script, retries=1)).is_new


ENDLESS = """\
import pathlib, subprocess, sys, time
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(1000)"])
pathlib.Path(%r).write_text(str(child.pid))
time.sleep(1000)
"""


def test_a_time_limit_ends_it_and_what_it_started(tmp_path):
    pid = tmp_path / "pid"
    with pytest.raises(TaskError, match=r"took longer than its limit of 1 s"):
        ran(job(tmp_path, ENDLESS % str(pid), limit=1.0))
    assert gone(int(pid.read_text()))


@pytest.mark.parametrize("kind", [Threads, Processes])
def test_a_cancelled_program_ends_with_what_it_started(kind, tmp_path):
    pid = tmp_path / "pid"
    both = {"short": job(tmp_path, COPY + "import time; time.sleep(0.5)"),
            "endless": job(tmp_path, ENDLESS % str(pid))}  # fmt: skip
    with contextlib.closing(kind(2).run(ran, both)) as outcomes:
        assert next(outcomes).name == "short"
        process = int(present(pid))
    assert gone(process)


def test_what_another_machine_made_is_kept_here_too(tmp_path):
    here = job(tmp_path / "here")
    there = ran(job(tmp_path / "there"))
    settled(here, there)
    assert here.is_kept
    assert ran(here).files == there.files
    settled(here, there)
    assert [p.name for p in here.store.iterdir()] == [here.key]

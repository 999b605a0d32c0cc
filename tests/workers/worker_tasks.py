"""Functions that the tests let executors run: workers must be able to import them."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from moldline.workers.attempt import is_cancelled


class Odd(Exception):
    """Can be packed, but not unpacked again."""

    def __init__(self, one, two):
        Exception.__init__(self, one)


def squared(number):
    return number * number


def late(argument):
    """The earlier asked, the later done."""
    number, count = argument
    time.sleep(0.1 * (count - number))
    return number


def picky(number):
    if number == 2:
        raise ValueError("2 is a bad number")
    return number


def odd(number):
    raise Odd("this", "that")


def killed_once(folder):
    """Dies without a word in its first worker."""
    mark = Path(folder) / "was_here"
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "done"


def killed(argument):
    os.kill(os.getpid(), signal.SIGKILL)


def endless(folder):
    """Starts a program that never ends, and waits for it."""
    program = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(1000)"])
    Path(folder, "pid").write_text(str(program.pid))
    try:
        while not is_cancelled():
            with contextlib.suppress(subprocess.TimeoutExpired):
                program.wait(0.05)
    finally:
        program.kill()
        program.wait()


def either(folder):
    return endless(folder) if folder else time.sleep(0.5)


def written(argument):
    """Slowly write a file of its own: what it holds says whose it is."""
    folder, number = argument
    (Path(folder) / f"begun-{number}-{os.getpid()}").touch()
    time.sleep(0.3)
    beside = Path(folder) / f"part-{number}-{os.getpid()}"
    beside.write_text(f"{number} " * 1000)
    beside.replace(Path(folder) / f"{number:03}.txt")
    return number, os.getpid()


def process(argument):
    return os.getpid(), os.environ.get("MOLDLINE_TEST")


def is_running(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{process}/stat")  # the dead wait there for their parents
    return not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] != "Z"


def gone(process):
    """Whether a process ends within five seconds."""
    for _ in range(100):
        if not is_running(process):
            return True
        time.sleep(0.05)
    return False


def present(path):
    """What is in a file that another process writes soon."""
    for _ in range(500):
        if path.exists() and path.read_text():
            return path.read_text()
        time.sleep(0.02)
    raise AssertionError(f"{path} did not come")

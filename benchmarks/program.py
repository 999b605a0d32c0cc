"""What differences of a program cost, per variable, on this machine.

python benchmarks/program.py
"""

import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

from moldline.modelers.program import Program
from moldline.workers import Serial, Threads

FOLDER = Path(__file__).parent.parent / "examples/programs"
PUBLISHED = 7.0
"""Seconds per variable of the differences that a published platform reports."""

VALUES = {"length": 12.0, "radius": 1.0, "nose": 0.5, "tail": 0.8, "flatness": 0.9}


def timed(call):
    """Its result and how long it took [s]."""
    start = time.perf_counter()
    result = call()
    return result, time.perf_counter() - start


def costs(program):
    """Of one run, and per variable of the first derivative and of a later one [s]."""
    making, run = timed(program.bind)
    changes = [(row, []) for row in np.eye(program.size)]
    seconds = [run]
    for values in (program.values, 1.01 * program.values):
        making(values)
        seconds.append(timed(partial(making.along, values, [], changes))[1] / program.size)
    return seconds


def main():
    """Two sizes, one run at a time and as many as there are cores."""
    print(f"{'points':>8} {'at a time':>9} {'run':>7} {'first':>7} {'later':>7}  [s, per variable]")
    for rings, around in ((40, 24), (600, 300)):
        with tempfile.TemporaryDirectory() as folder:
            script = Path(folder) / "revolve.py"
            text = (FOLDER / "revolve.py").read_text()
            script.write_text(text.replace("40, 24", f"{rings}, {around}"))
            for executor in (Serial(), Threads()):
                program = Program(
                    "{python} revolve.py body.in body.tri", "body.tri", parameters=dict(VALUES),
                    files=[script], template=FOLDER / "body.in.template", executor=executor,
                    cache=Path(folder) / type(executor).__name__,
                )  # fmt: skip
                told = " ".join(f"{s:7.2f}" for s in costs(program))
                print(f"{(rings - 1) * around + 2:8} {executor.count:9} {told}")
    print(f"published, of another program on another machine: {PUBLISHED:g} s per variable")


if __name__ == "__main__":
    main()

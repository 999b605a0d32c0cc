"""What derivatives of the wing-body cost: exact ones, and differences of one process each."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np

import moldline as ml

HERE = Path(__file__).parent
OUT = HERE.parent / "out"
TRIED = ["normal[21]", "sweep[1]", "radius[6]"]
"""Numbers whose differences are taken; the time of the others is scaled from theirs."""

STEP = 1e-3
"""Of the differences, in each variable's unit."""


def exact(case: ml.Pipeline, design: Any, columns: Callable[..., Any]) -> dict[str, float]:
    """Seconds for the surface and its derivatives, all compiled before."""
    parts = [case.of(name)(design) for name in ("wing", "fuselage")]
    union, shape = ml.Union(symmetry="y"), np.asarray(case.points(design))
    here = case.at(design)
    made = here.branches["configuration"].making
    assert made is not None
    tried = {
        "union": lambda: union.bind(*parts).geometry.points,
        "union, moved parts": lambda: made(np.zeros(0), *(part.points for part in parts)),
        "surface": lambda: here.points(design),
        "57 columns": lambda: columns(here, design),
        "pullback": lambda: here.pullback(design, shape),
    }
    return {name: fastest(call) for name, call in tried.items()}


def fastest(call: Callable[[], Any], times: int = 3) -> float:
    """Seconds of the fastest of several calls, after one that compiles."""
    jax.block_until_ready(call())
    found = []
    for _ in range(times):
        start = time.perf_counter()
        jax.block_until_ready(call())
        found.append(time.perf_counter() - start)
    return min(found)


def by_processes(
    sizes: Mapping[str, int], design: Mapping[str, Any], slopes: Mapping[str, Any], active: int
) -> dict[str, float]:
    """Differences of the wetted area, two processes for each number, and what all would cost.

    Each process makes the surface anew: its points are others, so that only what it measures can
    be compared, not where a point goes.
    """
    OUT.mkdir(exist_ok=True)
    case, values = OUT / "wing_body_sized.toml", OUT / "wing_body_design.json"
    case.write_text(sized((HERE / "wing_body.toml").read_text(), sizes))
    values.write_text(json.dumps({name: list(map(float, v)) for name, v in design.items()}))
    seconds, misses, counts = [], [], set()
    for number in TRIED:
        name, index = number.rstrip("]").split("[")
        ends = []
        for sign in (1, -1):
            present = np.asarray(design[name])[int(index)] + sign * STEP
            start = time.perf_counter()
            report = built(case, values, f"{number}={float(present)!r}")
            seconds.append(time.perf_counter() - start)
            ends.append(report["area"])
            counts.add(report["points"])
        exact_one = slopes["area"][name][int(index)]
        misses.append(abs((ends[0] - ends[1]) / (2 * STEP) - exact_one) / abs(exact_one))
    each = float(np.mean(seconds))
    return {
        "a process": each,
        "114 processes": 2 * active * each,
        "other counts of points": float(len(counts)),
        "off": max(misses),
    }


def sized(text: str, sizes: Mapping[str, int]) -> str:
    """A case file with other numbers of points."""
    for key, count in sizes.items():
        text = re.sub(rf"^{key} = \d+$", f"{key} = {count}", text, flags=re.MULTILINE)
    return text


def built(case: Path, values: Path, change: str) -> dict[str, Any]:
    """What `moldline build` reports, in a process of its own."""
    command = [sys.executable, "-m", "moldline", "build", str(case), "--values", str(values)]
    command += ["--set", change, "--json", "-o", str(OUT / "wing_body_one.tri")]
    told = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ)
    report: dict[str, Any] = json.loads(told.stdout)
    return report

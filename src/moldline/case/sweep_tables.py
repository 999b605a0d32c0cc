"""Tables of a sweep: one row per sample, in the order of their numbers."""

import csv
import io
from typing import TYPE_CHECKING

import numpy as np

from ..mesh.io.files import replacing

if TYPE_CHECKING:
    from .sweep import Sweep

TABLE, ARRAYS = "sweep.csv", "sweep.npz"


def write_tables(sweep: "Sweep") -> None:
    """Write what is known so far as `sweep.csv` and `sweep.npz` in the sweep's folder.

    The arrays are `labels` and `numbers` of the variables, `is_done`, `is_within`, `seconds`, and
    each measure as `measure_NAME`; what is not known is NaN.
    """
    measures = _measures(sweep)
    is_done = np.zeros(len(sweep.samples), bool)
    is_within, seconds = is_done.copy(), np.full(len(is_done), np.nan)
    for number, record in sweep.records.items():
        is_done[number] = record.error is None
        is_within[number] = record.is_within
        seconds[number] = record.seconds
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = [
        name if rows.shape[1] == 1 else f"{name}[{i}]"
        for name, rows in measures.items()
        for i in range(rows.shape[1])
    ]
    writer.writerow(["sample", *sweep.samples.labels, *heads, "is_within", "error"])
    columns = np.concatenate([np.zeros((len(is_done), 0)), *measures.values()], axis=1)
    for number, values in enumerate(sweep.samples.numbers):
        own = sweep.records.get(number)
        told = "not done" if own is None else " ".join((own.error or "").split())
        within = is_within[number] if is_done[number] else ""
        writer.writerow([number, *map(_told, values), *map(_told, columns[number]), within, told])
    with replacing(sweep.folder / TABLE) as file:
        file.write(text.getvalue().encode())
    arrays = {
        "labels": np.array(sweep.samples.labels),
        "numbers": sweep.samples.numbers,
        "is_done": is_done,
        "is_within": is_within,
        "seconds": seconds,
        **{f"measure_{name}": rows for name, rows in measures.items()},
    }
    with replacing(sweep.folder / ARRAYS) as file:
        np.savez(file, allow_pickle=False, **arrays)


def _measures(sweep: "Sweep") -> dict[str, np.ndarray]:
    """Each measure's numbers, one row per sample."""
    count = len(sweep.samples)
    found: dict[str, np.ndarray] = {}
    for name in sweep.case.measurements.constraints:
        rows = {k: r.measures[name] for k, r in sweep.records.items() if name in r.measures}
        width = max(map(len, rows.values()), default=1)
        found[name] = np.full((count, width), np.nan)
        for k, row in rows.items():
            found[name][k, : len(row)] = row
    return found


def _told(number: float) -> str:
    return "" if np.isnan(number) else repr(float(number))

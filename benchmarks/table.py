"""What the benchmarks share: arguments, times, and a table that grows row by row."""

import argparse
import time
from collections.abc import Callable, Iterable, Sequence

Row = dict[str, float | str | None]


def arguments(description: str, sizes: Sequence[int]) -> argparse.Namespace:
    """What every benchmark understands."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--sizes", type=int, nargs="+", default=list(sizes))
    parser.add_argument("--markdown", action="store_true", help="a table for the docs")
    return parser.parse_args()


def show(columns: Sequence[str], rows: Iterable[Row], markdown: bool) -> None:
    """Print each row as it comes."""
    separator = " | " if markdown else "  "
    widths = [max(len(name), 10) for name in columns]
    lines: list[Sequence[str]] = [columns]
    if markdown:
        lines.append(["---:"] * len(columns))
    for cells in lines:
        _print(cells, widths, separator, markdown)
    for row in rows:
        _print([_told(row.get(name)) for name in columns], widths, separator, markdown)


def median(call: Callable[[], object], repeats: int = 21) -> float:
    """Median time of a call [ms], after one that is not counted."""
    call()
    times = sorted(_timed(call) for _ in range(repeats))
    return 1e3 * times[len(times) // 2]


def best(call: Callable[[], object], repeats: int = 3) -> float:
    """The shortest of a few times [s]: files are disturbed more than they vary."""
    return min(_timed(call) for _ in range(repeats))


def _timed(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def _told(value: float | str | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def _print(cells: Sequence[str], widths: list[int], separator: str, markdown: bool) -> None:
    text = separator.join(cell.rjust(w) for cell, w in zip(cells, widths, strict=True))
    print(f"| {text} |" if markdown else text, flush=True)

"""A shape found through a running moldline: this program knows points and gradients, no geometry.

It starts `moldline serve`, opens the case of a wing from a modeler, and finds the wing whose points
it is given, by Gauss and Newton's method with the columns that the server sends. Every further
request is answered by what is compiled already.
"""

import tempfile
import time
from pathlib import Path

import numpy as np

from moldline.server.client import Client

CASE = Path(__file__).parent / "wing.toml"
TARGET = {"sweep": [28.0, 26.5], "twist": [3.0, 0.5, -3.0], "thickness": [13.0, 12.0, 10.0]}
"""What the hidden wing has [deg, deg, %]."""


def main() -> dict[str, float]:
    """Run it; returns the numbers that the test pins."""
    with tempfile.TemporaryDirectory() as folder:
        client = Client.start(socket=str(Path(folder) / "server"), quit_after=60.0)
        try:
            return found(client.open(CASE))
        finally:
            client.shutdown()


def found(case) -> dict[str, float]:  # type: ignore[no-untyped-def]
    """The values whose wing is the hidden one."""
    wanted = case.points(TARGET)
    values = {name: np.array(variable["value"]) for name, variable in case.variables.items()}
    misses, begin = [], time.perf_counter()
    for _ in range(6):
        miss = (case.points(values) - wanted).ravel()
        misses.append(float(np.abs(miss).max()))
        columns = [case.sensitivity(values, name).reshape(len(miss), -1) for name in values]
        step = np.linalg.lstsq(np.concatenate(columns, axis=1), miss, rcond=None)[0]
        sizes = [c.shape[1] for c in columns]
        for name, part in zip(values, np.split(step, np.cumsum(sizes)[:-1]), strict=True):
            values[name] = values[name] - part
    seconds = (time.perf_counter() - begin) / len(misses)
    off = max(float(np.abs(values[name] - TARGET[name]).max()) for name in values)
    print(f"largest distance of a point: {', '.join(f'{m:.1e}' for m in misses)} m")
    print(f"{seconds:.2f} s a step, with the columns of 8 numbers of {len(wanted)} points")
    return {"start": misses[0], "found": misses[-1], "off": off}


if __name__ == "__main__":
    main()

"""A modeler of the Engineering Sketch Pad: its command line makes the shape, we triangulate it."""

import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
from typing_extensions import override

from ..errors import FileError, GeometryError, ParameterError
from ..mesh import Surface
from .cad_form import Asked, Form, Parts
from .cad_sources import Given, from_step
from .differencing import AbstractProgrammed, Programmed


class Esp(AbstractProgrammed):
    """A script of the Engineering Sketch Pad, run by `serveCSM -batch` for each set of parameters.

    The script must write its shape by `DUMP` as a STEP file; that is read and triangulated as
    `Cad` does, with owners that stay, so `pip install 'moldline[step]'` is needed as well. Tried
    with a stand-in for serveCSM only, which behaves as its help page says.

    Attributes
    ----------
    program
        What makes the points of the parameters.
    surface
        The triangulation, in m; its components are as asked for.
    open_edges
        How many edges of the shape have a face on one side only.
    """

    program: Programmed = eqx.field(static=True)
    surface: Surface
    open_edges: int = eqx.field(static=True)

    def __init__(
        self,
        script: Path,
        parameters: dict[str, float] | None = None,
        *,
        result: str = "result.step",
        command: str = "serveCSM",
        time_limit: float = 600.0,
        steps: dict[str, float] | None = None,
        max_edge: float | None = None,
        sag: float | None = None,
        angle: float | None = None,
        degrees: bool = False,
        components: Parts = "auto",
        groups: dict[str, list[int]] | None = None,
    ):
        """From a .csm `script` and the design parameters (despmtr) to set, in its own units.

        `result` is the file that the script dumps. `command` is the program, by name or path, and
        `time_limit` what one run of it may take [s]. The rest is as for `Cad`.
        """
        source = _Runs(Path(script), result, command, time_limit)
        asked = Asked(max_edge, sag, angle, degrees, components, groups)
        form = Form(source, parameters or {}, asked)
        points = np.asarray(form.surface.points)
        self.program = Programmed(form, parameters or {}, steps, points)
        self.surface, self.open_edges = form.surface, form.open_edges

    @classmethod
    @override
    def build(cls, folder: Path, **options: Any) -> "Esp":
        return cls(folder / options.pop("script"), **options)


class _Runs:
    """The program run once for each set of parameters, in a folder of its own."""

    def __init__(self, script: Path, result: str, command: str, time_limit: float):
        if not script.is_file():
            raise FileError(f"{script}: there is no such file")
        if Path(result).is_absolute() or Path(result).suffix.lower() not in (".step", ".stp"):
            raise ParameterError(
                f"result is the STEP file that {script.name} dumps, beside it, got {result!r}"
            )
        program = shutil.which(command)
        if program is None:
            raise ParameterError(
                f"the program {command!r} of the Engineering Sketch Pad is not found; install it "
                "from https://acdl.mit.edu/ESP and source its environment, or give command = a path"
            )
        self.script, self.result, self.time_limit = script.resolve(), result, time_limit
        self.program = program

    def __call__(self, parameters: Mapping[str, Any]) -> Given:
        with tempfile.TemporaryDirectory(prefix="moldline_esp_") as folder:
            values = Path(folder) / "moldline.despmtrs"
            lines = [f"{name} {float(value)!r}\n" for name, value in parameters.items()]
            values.write_text("".join(lines))
            words = [self.program, "-batch", "-despmtrs", str(values), "-outLevel", "1"]
            told = "".join(lines).strip().replace("\n", ", ")
            try:
                run = subprocess.run(
                    [*words, str(self.script)],
                    cwd=folder,
                    timeout=self.time_limit,
                    capture_output=True,
                    text=True,
                    errors="replace",
                    stdin=subprocess.DEVNULL,
                )
            except subprocess.TimeoutExpired:
                raise GeometryError(
                    f"{self.script}: {words[0]} took more than {self.time_limit:g} s at {told}"
                ) from None
            made = Path(folder) / self.result
            if run.returncode or not made.is_file():
                last = "\n".join((run.stdout + run.stderr).strip().splitlines()[-5:])
                why = f"ended with {run.returncode}" if run.returncode else "dumped no such file"
                raise GeometryError(
                    f"{self.script}: {words[0]} {why} at {told}, where {self.result} was expected; "
                    f"its last words: {last or 'none'}"
                )
            return from_step(made)

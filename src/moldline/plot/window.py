"""An interactive window, through PyVista (an optional extra)."""

import os
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import MoldlineError
from ..mesh import Geometry
from ..mesh.joined import joined_points
from .nets import GREY, RED, Net
from .surfaces import METAL

TRIAL = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(64, 64));"
    "p.add_mesh(pyvista.Sphere()); p.screenshot(None, return_img=True)"
)


def show(geometry: Geometry, values: Any = None, label: str = "", nets: Sequence[Net] = ()) -> None:
    """Show a geometry until the window is closed.

    `values`, per point or per face, colour it; `nets` are drawn where they are moved to.
    """
    _check()
    import pyvista

    points = np.asarray(geometry.points)
    faces = getattr(geometry, "faces", None)
    if faces is not None:
        shape = pyvista.PolyData(points, np.insert(np.asarray(faces), 0, 3, axis=1).ravel())
    else:
        lines = np.insert(joined_points(geometry), 0, 2, axis=1).ravel()
        shape = pyvista.PolyData(points, lines=lines)
    plotter = pyvista.Plotter()
    colours: dict[str, Any] = {"color": METAL}
    if values is not None:
        largest = float(np.abs(values).max())
        bar = {"title": label}
        colours = {"scalars": np.asarray(values), "cmap": "RdBu_r", "scalar_bar_args": bar}
        colours["clim"] = (-largest, largest)
    plotter.add_mesh(shape, show_edges=len(points) < 2_000, **colours)
    for net in nets:
        if len(net.lines):
            joined = np.insert(np.asarray(net.lines), 0, 2, axis=1).ravel()
            plotter.add_mesh(pyvista.PolyData(np.asarray(net.moved), lines=joined), color=GREY)
        if not net.is_hidden:
            plotter.add_points(net.moved, color=RED, point_size=9, render_points_as_spheres=True)
    plotter.add_axes()
    plotter.show()


def _check() -> None:
    """Ask a child process whether pictures work here: without OpenGL, VTK crashes the process."""
    trial = subprocess.run([sys.executable, "-c", TRIAL], capture_output=True, text=True)
    if "No module named" in trial.stderr:
        raise MoldlineError('a window needs PyVista: pip install "moldline[window]"')
    # without an X server VTK draws in memory, and a window would be over before it is seen
    has_display = not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY"))
    if trial.returncode != 0 or not has_display:
        raise MoldlineError(
            "a window needs a display with OpenGL, and this machine has none (on Debian: "
            "apt-get install libgl1 libxrender1); write a picture with -o FILE instead"
        )

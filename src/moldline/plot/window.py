"""An interactive window, through PyVista (an optional extra)."""

import subprocess
import sys

import numpy as np

from ..errors import MoldlineError
from ..mesh import Geometry
from ..mesh.joined import joined_points

TRIAL = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(64, 64));"
    "p.add_mesh(pyvista.Sphere()); p.screenshot(None, return_img=True)"
)


def show(geometry: Geometry) -> None:
    """Show a geometry until the window is closed."""
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
    plotter.add_mesh(shape, color="#b9c4d0", show_edges=len(points) < 20_000)
    plotter.add_axes()
    plotter.show()


def _check() -> None:
    """Ask a child process whether pictures work here: without OpenGL, VTK crashes the process."""
    trial = subprocess.run([sys.executable, "-c", TRIAL], capture_output=True, text=True)
    if trial.returncode == 0:
        return
    if "No module named" in trial.stderr:
        raise MoldlineError('a window needs PyVista: pip install "moldline[window]"')
    raise MoldlineError(
        "a window needs a display with OpenGL, and this machine has none (on Debian: "
        "apt-get install libgl1 libxrender1); write a picture with -o FILE instead"
    )

"""A Blender that deforms given points by its own modifiers, in a process of its own.

Tests and benchmarks share it; `make blender` makes the environment that it runs in.
"""

import json
import select
import subprocess
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

ROOT = Path(__file__).parent.parent
PYTHON = ROOT / ".venv-blender/bin/python"
SCRIPT = Path(__file__).parent / "blender_scenes.py"


def lacking() -> str | None:
    """Why there is no Blender to run; None where there is one."""
    if not PYTHON.exists():
        return "no .venv-blender here; `make blender` makes it"
    trial = subprocess.run([PYTHON, "-c", "import bpy"], capture_output=True, text=True)
    if trial.returncode:
        reason = (trial.stderr.strip() or f"exit status {trial.returncode}").splitlines()[-1]
        return f"bpy does not import: {reason}; `make blender` says what is missing"
    return None


class Blender:
    """Holds one scene at a time; what it holds is told in blender_scenes.py."""

    def __init__(self, patience: float = 600.0):
        """`patience` is how long a request may take [s]."""
        self.patience = patience
        self._folder = tempfile.TemporaryDirectory()
        self._log = (Path(self._folder.name) / "log").open("w+")
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            [PYTHON, SCRIPT], stdin=pipe, stdout=pipe, stderr=self._log, text=True
        )

    def open(self, **scene: Any) -> dict[str, Any]:
        """Put a scene in place of the last one; tells of the bind to a cage."""
        given = Path(self._folder.name) / "in.npz"
        np.savez(given, **scene)
        return self._asked({"open": str(given)})

    def deform(self, repeats: int = 1) -> dict[str, np.ndarray]:
        """The deformed points, and the times of as many evaluations [s]."""
        result = Path(self._folder.name) / "out.npz"
        self._asked({"deform": str(result), "repeats": repeats})
        with np.load(result) as found:
            return dict(found)

    def close(self) -> None:
        """End the process and remove its files."""
        if self._process.poll() is None:
            self._process.kill()  # it has nothing to save
        self._process.communicate()
        self._log.close()
        self._folder.cleanup()

    def _asked(self, request: dict[str, Any]) -> dict[str, Any]:
        """Raises RuntimeError for what Blender refuses, or does not answer."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            print(json.dumps(request), file=process.stdin, flush=True)
        except BrokenPipeError:
            raise RuntimeError(self._end()) from None
        if not select.select([process.stdout], [], [], self.patience)[0]:
            raise RuntimeError(f"Blender has not answered for {self.patience:g} s")
        line = process.stdout.readline()
        if not line:
            raise RuntimeError(self._end())
        answer = json.loads(line)
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer

    def _end(self) -> str:
        self._log.seek(0)
        return f"Blender has ended: {self._log.read()[-500:]}"

    def __enter__(self) -> "Blender":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def lattice_scene(
    points: Any, lattice: Any, controls: Any, kind: str = "BSPLINE"
) -> dict[str, Any]:
    """One of our lattices with its controls, as Blender has it; `kind` as Blender names it."""
    return {
        "points": np.asarray(points),
        "lattice_rest": lattice.rest,
        "lattice_edges": lattice.edges,
        "lattice_moves": np.asarray(lattice.moves(controls)),
        "lattice_interpolation": f"KEY_{kind}",
    }


def cage_scene(points: Any, cage: Any, controls: Any, precision: int) -> dict[str, Any]:
    """One of our cages with its controls, as Blender has it."""
    return {
        "points": np.asarray(points),
        "cage_rest": cage.rest,
        "cage_moved": cage.rest + np.asarray(cage.moves(controls)),
        "cage_faces": cage.shape.faces,
        "cage_precision": precision,
    }


def bones_scene(bones: Any, controls: Any, blend: str, weights: Any = None) -> dict[str, Any]:
    """Our bones, parents first, with a skeleton's controls; by envelopes where weights are None.

    A bone's stretch and scale are one to Blender, and its children ride on both.
    """
    own = np.asarray(controls).reshape(len(bones), 10)
    angles = np.linalg.norm(own[:, :3], axis=1, keepdims=True)
    halves = np.sinc(angles / (2 * np.pi)) / 2 * own[:, :3]
    scales = 1 + own[:, 7:]
    scales[:, 1] *= 1 + own[:, 6]
    scene = {
        "bone_heads": bones.heads,
        "bone_tails": bones.tails,
        "bone_ups": bones.axes[:, :, 2],
        "bone_parents": bones.parents,
        "bone_radii": np.array([bone.radii for bone in bones]),
        "bone_distances": np.array([bone.distance for bone in bones]),
        "bone_strengths": np.array([bone.strength for bone in bones]),
        "bone_turns": np.concatenate([np.cos(angles / 2), halves], axis=1),
        "bone_shifts": own[:, 3:6],
        "bone_scales": scales,
        "bone_preserve": blend == "dual quaternion",
    }
    return scene if weights is None else scene | {"bone_weights": np.asarray(weights)}

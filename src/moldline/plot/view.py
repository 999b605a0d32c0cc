"""Where a picture is looked at from."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ParameterError

NAMED = {
    "iso": (155.0, 42.0),
    "top": (-90.0, 90.0),
    "bottom": (-90.0, -90.0),
    "front": (180.0, 0.0),
    "rear": (0.0, 0.0),
    "side": (-90.0, 0.0),
    "iso-left": (-155.0, 32.0),
}
"""Azimuth and elevation of the eye [deg], for x aft, y to starboard and z up."""


@dataclass(frozen=True)
class View:
    """A parallel projection seen from far away.

    Attributes
    ----------
    azimuth_deg
        Direction of the eye in the x-y plane, from x towards y.
    elevation_deg
        Its angle above that plane.
    """

    azimuth_deg: float
    elevation_deg: float

    @classmethod
    def of(cls, view: "View | str") -> "View":
        """A view by its name, or the view given."""
        if isinstance(view, cls):
            return view
        if view not in NAMED:
            raise ParameterError(f"no view named {view!r}; there is: {', '.join(NAMED)}")
        return cls(*NAMED[str(view)])

    @property
    def axes(self) -> np.ndarray:
        """Rows: to the right, up, and towards the eye."""
        a, e = np.radians([self.azimuth_deg, self.elevation_deg])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        return np.stack([right, np.cross(eye, right), eye])

    def project(self, points: Any) -> np.ndarray:
        """Coordinates right, up and towards the eye, shape (n, 3)."""
        return np.asarray(points, float) @ self.axes.T

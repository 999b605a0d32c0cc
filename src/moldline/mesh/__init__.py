"""READ and WRITE: discrete geometries, their topology and their files."""

from typing import TypeAlias

from .cloud import Cloud
from .grid import Grid
from .section import Section
from .surface import Surface
from .volume import VolumeMesh

Geometry: TypeAlias = Surface | Section | Grid | VolumeMesh | Cloud
"""Whatever has points and can be moved; a deformer sees only the points."""

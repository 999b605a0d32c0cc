"""Geometries of one kind made into another, where that is natural."""

from collections.abc import Mapping, Sequence

from ..errors import ParameterError
from . import Geometry, Grid, Section, Surface, VolumeMesh
from .boundary import boundary
from .stitch import stitched


def converted(
    geometry: Geometry,
    kind: type[Geometry],
    components: Mapping[str, Sequence[int]] | None = None,
    markers: Sequence[str] | None = None,
) -> tuple[Geometry, list[str]]:
    """The geometry as a format wants it, and what was done, in sentences.

    Patches become a surface (`components` names their blocks), a volume mesh its boundary or the
    `markers` of it: a surface, or in two dimensions a section. Anything else stays what it is.
    """
    if components and not isinstance(geometry, Grid):
        raise ParameterError(f"components name blocks of a grid, got a {type(geometry).__name__}")
    if markers and not isinstance(geometry, VolumeMesh):
        raise ParameterError(f"markers belong to a volume mesh, got a {type(geometry).__name__}")
    if isinstance(geometry, Grid) and kind is Surface:
        surface, stitching = stitched(geometry, components)
        return surface, stitching.sentences()
    if isinstance(geometry, VolumeMesh) and kind in (Surface, Section):
        made, nodes = boundary(geometry, markers)
        told = f"{len(nodes)} of {len(geometry.points)} points are on the boundary"
        return made, [told]
    return geometry, []

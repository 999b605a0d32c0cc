"""Filling of holes by a smooth surface, such as where a wing has left a body."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import RBFInterpolator

from .._types import Array
from ..errors import GeometryError, ParameterError
from . import topology
from .extend import opening
from .planar import triangulated
from .quality import face_areas
from .surface import Surface

FLATTEST = 0.1
"""Cosine between the plane of a hole and the faces around it: beyond, they do not lie over it."""

APART = 0.6
"""How far points of a filling stay off the hole's edges, by their spacing."""

MOST = 4000
"""Points of a filling."""


@dataclass(frozen=True)
class Filling:
    """How a hole was filled."""

    points: int
    """New ones, inside of the hole."""
    faces: int
    """New ones."""
    cleared: int
    """Faces around the opening that were taken away first."""
    area: float
    """Of the new faces [m²] if the coordinates are in m."""
    kink: float
    """The largest angle between a new face and the old one beside it [rad]."""
    kept: Int[np.ndarray, "k"]
    """Points of the given surface that are the first ones of the result."""

    def sentences(self) -> list[str]:
        """What was done."""
        gone = f", where {self.cleared} faces were taken away first" if self.cleared else ""
        return [
            f"filled by {self.faces} faces with {self.points} points of their own, area "
            f"{self.area:.6g}{gone}; it meets the surface around it at up to "
            f"{np.degrees(self.kink):.3g} degrees"
        ]


def filled(
    surface: Surface,
    loop: Int[Array, "l"] | None = None,
    clear: int = 0,
    rings: int = 3,
    spacing: float | None = None,
    tag: str = "filling",
) -> tuple[Surface, Filling]:
    """Fill a hole by a smooth surface as one more component, and tell what was done.

    Over the plane that lies along the surface around the hole, the filling is a thin-plate spline's
    height: of all that pass through the points of the opening and of `rings` rings around it, that
    which bends least. It has continuous slopes; through several rings it takes over the slopes and
    the curvature around the hole but for their spacing. Its points are `spacing` apart, by default
    the median length of the opening's edges.

    `clear` takes that many rings of faces around the opening away first. The filling then passes by
    the places of their points, which the spline still knows, without having them as its own: that
    suits an opening whose edge lies to the bit on another surface. Unused points are left out; data
    of new points and faces is 0. `loop` is as for `extended`.

    Source: Duchon, Lecture Notes in Mathematics 571, 1977 (thin-plate splines).
    """
    if clear < 0 or rings < 1:
        raise ParameterError(f"clear is 0 or more and rings 1 or more, got {clear} and {rings}")
    points, faces = np.asarray(surface.points, float), np.asarray(surface.faces)
    ring = opening(surface, loop)
    stays, ring, known = _cleared(faces, ring, clear)
    around = _rings(faces[stays], ring, rings)
    known = np.unique(np.concatenate([known, ring, np.unique(faces[stays][around])]))
    frame = _frame(points, faces[stays][around])
    flat = (points - points[ring[0]]) @ frame
    inner = _inside(flat[ring, :2], spacing)
    spline = RBFInterpolator(flat[known, :2], flat[known, 2], kernel="thin_plate_spline")
    fresh = np.column_stack([inner, spline(inner)]) if len(inner) else np.empty((0, 3))
    count = len(points)
    plane = np.concatenate([flat[:, :2], inner])
    new = triangulated(plane, [ring[::-1]], range(count, count + len(inner)))
    places = np.concatenate([points, fresh @ frame.T + points[ring[0]]])
    return _put_together(surface, places, stays, new, tag)


def _cleared(
    faces: np.ndarray, ring: np.ndarray, clear: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which faces stay, the opening then, and the points that lay in between."""
    stays, gone = np.ones(len(faces), bool), []
    for _ in range(clear):
        touched = stays & np.isin(faces, ring).any(axis=1)
        stays &= ~touched
        near = np.setdiff1d(faces[touched], ring)
        found = [own for own in topology.boundary_loops(faces[stays]) if np.isin(own, near).any()]
        gone.append(ring)
        if len(found) != 1 or not np.isin(near, found[0]).all():
            raise GeometryError(
                f"without the faces at an opening of {len(ring)} points there is no single opening "
                "around it: clear fewer rings"
            )
        ring = found[0]
    return stays, ring, np.concatenate([*gone, np.empty(0, np.int64)]).astype(np.int64)


def _rings(faces: np.ndarray, ring: np.ndarray, rings: int) -> Bool[np.ndarray, "m"]:
    """Which faces lie in the first rings around an opening."""
    reached = ring
    for _ in range(rings):
        around = np.isin(faces, reached).any(axis=1)
        reached = np.unique(faces[around])
    return np.asarray(around)


def _frame(points: np.ndarray, faces: np.ndarray) -> Float[np.ndarray, "3 3"]:
    """Columns: two directions in the plane along some faces, and its normal."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    total = normals.sum(axis=0)
    sizes = np.linalg.norm(normals, axis=1)
    normal = total / max(float(np.linalg.norm(total)), 1e-300)
    cosine = normals @ normal / np.where(sizes > 0, sizes, 1.0)
    cosine = np.where(sizes > 0, cosine, 1.0)
    if cosine.min() < FLATTEST:
        worst = points[faces[np.argmin(cosine)]].mean(axis=0)
        raise GeometryError(
            "the surface around the hole does not lie over one plane: near "
            "({:.6g}, {:.6g}, {:.6g}) it turns away; take fewer rings, or close an end with "
            "mesh.cap".format(*worst)
        )
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal], axis=1)


def _inside(outline: Float[np.ndarray, "l 2"], spacing: float | None) -> Float[np.ndarray, "i 2"]:
    """Points in rows of even triangles within an outline, not too near to it."""
    start, end = outline, np.roll(outline, -1, axis=0)
    size = float(np.median(np.linalg.norm(end - start, axis=1))) if spacing is None else spacing
    low, high = outline.min(axis=0), outline.max(axis=0)
    rows = np.arange(low[1], high[1], size * np.sqrt(3) / 2)
    across = np.arange(low[0] - size, high[0], size)
    if not size > 0 or len(rows) * len(across) > 20 * MOST:
        raise ParameterError(
            f"a spacing of {size:.4g} is too small for a hole of {high[0] - low[0]:.4g} by "
            f"{high[1] - low[1]:.4g}: a filling has {MOST} points at most"
        )
    shift = np.where(np.arange(len(rows)) % 2, size / 2, 0.0)
    grid = np.stack(
        [across + shift[:, None], np.broadcast_to(rows[:, None], (len(rows), len(across)))], axis=2
    ).reshape(-1, 2)
    along = end - start
    away = grid[:, None] - start
    share = np.einsum("ijk,jk->ij", away, along) / np.einsum("jk,jk->j", along, along)
    gaps = np.linalg.norm(away - np.clip(share, 0, 1)[..., None] * along, axis=2).min(axis=1)
    spans = (start[:, 1] > grid[:, None, 1]) != (end[:, 1] > grid[:, None, 1])
    with np.errstate(divide="ignore", invalid="ignore"):  # level edges span nothing
        crossing = start[:, 0] + along[:, 0] * away[..., 1] / along[:, 1]
    is_inside = np.sum(spans & (crossing > grid[:, None, 0]), axis=1) % 2 == 1
    return grid[is_inside & (gaps > APART * size)]


def _put_together(
    surface: Surface, places: np.ndarray, stays: np.ndarray, new: np.ndarray, tag: str
) -> tuple[Surface, Filling]:
    faces, tags = np.asarray(surface.faces)[stays], np.asarray(surface.tags)[stays]
    names = surface.components if tag in surface.components else (*surface.components, tag)
    used, numbers = np.unique(np.concatenate([faces, new]), return_inverse=True)
    numbers = numbers.reshape(-1, 3)
    kept = used[used < len(surface.points)]
    added = len(used) - len(kept)
    result = Surface(
        places[used],
        numbers,
        np.append(tags, np.full(len(new), names.index(tag))),
        names,
        {name: _longer(np.asarray(d)[kept], added) for name, d in surface.point_data.items()},
        {name: _longer(np.asarray(d)[stays], len(new)) for name, d in surface.face_data.items()},
    )
    filling = np.arange(len(faces), len(numbers))
    report = Filling(
        added,
        len(new),
        int(np.sum(~stays)),
        float(face_areas(result)[filling].sum()),
        _kink(result, filling),
        kept,
    )
    return result, report


def _kink(surface: Surface, filling: Sequence[int] | np.ndarray) -> float:
    points, faces = np.asarray(surface.points), np.asarray(surface.faces)
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    is_new = np.isin(np.arange(len(faces)), filling)
    near = topology.neighbours(faces)
    meets = is_new[near.one] != is_new[near.other]
    cosine = np.einsum("ij,ij->i", normals[near.one[meets]], normals[near.other[meets]])
    return float(np.arccos(np.clip(cosine.min(initial=1.0), -1, 1)))


def _longer(data: np.ndarray, count: int) -> np.ndarray:
    return np.concatenate([data, np.zeros((count, *data.shape[1:]), data.dtype)])

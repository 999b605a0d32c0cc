"""Slivers along the curves of a wetted surface taken away by collapsed and turned edges."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from .wetted_report import altitudes

PASSES = 20
"""How often all slivers are gone through at most."""

TILT = 0.5
"""A face's normal and that of the face which it is a part of have at least this cosine."""


class Limits(NamedTuple):
    """What counts as a sliver, and what may be done about it.

    Attributes
    ----------
    altitude
        A face is a sliver if its smallest altitude is below this part of its longest side.
    tolerance
        How far corners may go off the plane of their face [m]; None cleans nothing.
    """

    altitude: float
    tolerance: float | None


class Cleaned(NamedTuple):
    """A triangulation with fewer slivers; points are the given ones, some no longer used.

    Attributes
    ----------
    faces
        Triangles.
    rows
        Which of the given faces each of them continues.
    collapsed, turned
        How many edges were.
    moved
        How far a corner is off the plane of the face that it continues at most [m].
    """

    faces: Int[np.ndarray, "k 3"]
    rows: Int[np.ndarray, "k"]
    collapsed: int
    turned: int
    moved: float


class _Change(NamedTuple):
    """Faces that get new corners, faces that go, and the altitude of the worst that stays."""

    faces: list[int]
    corners: np.ndarray
    gone: list[int]
    worst: float


def cleaned(
    points: Float[np.ndarray, "n 3"],
    faces: Int[np.ndarray, "m 3"],
    tags: Int[np.ndarray, "m"],
    is_cut: Bool[np.ndarray, "m"],
    corners: Float[np.ndarray, "m 3 3"],
    limits: Limits,
) -> Cleaned:
    """Collapse and turn edges of faces that were cut until none of them is a sliver, or no way on.

    A point that goes is merged into a neighbour, which stays where it is: points of curves, where
    tags meet or the surface ends, only along their curve, and where curves meet none. An edge is
    turned only between faces of one tag. All corners stay within the tolerance of the plane of
    the `corners` of the face that theirs is a part of, faces keep their side, edges and points stay
    manifold; and each step betters the worst of the faces that it changes.
    """
    patch = _Patch(points, faces, tags, is_cut, corners, limits)
    for _ in range(PASSES):
        before = patch.collapsed + patch.turned
        for face in patch.slivers():
            patch.better(face)
        if patch.collapsed + patch.turned == before:
            break
    rows = np.flatnonzero(patch.is_there)
    return Cleaned(patch.faces[rows], rows, patch.collapsed, patch.turned, patch.moved)


class _Patch:
    """Faces that were cut and their neighbours, which change."""

    def __init__(
        self,
        points: np.ndarray,
        faces: np.ndarray,
        tags: np.ndarray,
        is_cut: np.ndarray,
        corners: np.ndarray,
        limits: Limits,
    ):
        self.points, self.faces, self.tags = points, faces.copy(), tags
        self.is_cut = is_cut.copy()
        self.altitude, self.tolerance = limits.altitude, limits.tolerance or 0.0
        self.is_there = np.ones(len(faces), bool)
        self.collapsed, self.turned, self.moved = 0, 0, 0.0
        a, b, c = (corners[:, k] for k in range(3))
        normal = np.cross(b - a, c - a)
        self.normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        self.height = np.einsum("ij,ij->i", self.normal, a)
        inner = np.unique(faces[is_cut])
        self.around: dict[int, set[int]] = {v: set() for v in inner.tolist()}
        near = np.flatnonzero(np.isin(faces, inner).any(axis=1))
        for face, three in zip(near.tolist(), faces[near].tolist(), strict=True):
            for v in three:
                if v in self.around:
                    self.around[v].add(face)

    def slivers(self) -> list[int]:
        """Those that were cut, the worst first."""
        rows = np.flatnonzero(self.is_cut & self.is_there)
        shares = altitudes(self.points, self.faces[rows])
        order = np.argsort(shares, kind="stable")
        return rows[order[shares[order] < self.altitude]].tolist()

    def better(self, face: int) -> None:
        """Make the best of the changes that rid us of a sliver, if one does."""
        if not self.is_there[face]:
            return
        if altitudes(self.points, self.faces[face][None])[0] >= self.altitude:
            return
        found = [*self._collapses(face), *self._turns(face)]
        if found:
            self._make(max(found, key=lambda change: change.worst))

    def _collapses(self, face: int) -> Iterator[_Change]:
        three = self.faces[face].tolist()
        for k in range(3):
            for goes, stays in ((three[k], three[k - 1]), (three[k - 1], three[k])):
                if self._may_collapse(goes, stays):
                    change = self._collapse(goes, stays)
                    if change is not None:
                        yield change

    def _may_collapse(self, goes: int, stays: int) -> bool:
        """Whether nothing is pinched, and a point of a curve stays on its curve."""
        if goes not in self.around or stays not in self.around:
            return False
        shared = self.around[goes] & self.around[stays]
        common = (self._ring(goes) & self._ring(stays)) - {goes, stays}
        if len(common) != len(shared) or not shared:
            return False
        border = self._border(goes)
        return not border or (len(border) == 2 and stays in border)

    def _collapse(self, goes: int, stays: int) -> _Change | None:
        own = sorted(self.around[goes])
        gone = sorted(self.around[goes] & self.around[stays])
        changed = [f for f in own if f not in gone]
        corners = self.faces[changed]
        corners = np.where(corners == goes, stays, corners)
        return self._change(own, changed, corners, gone)

    def _turns(self, face: int) -> Iterator[_Change]:
        """The edge opposite each corner, if the face beyond has the same tag."""
        three = self.faces[face].tolist()
        for k in range(3):
            a, b, c = three[k], three[(k + 1) % 3], three[(k + 2) % 3]
            if a not in self.around or b not in self.around:
                continue
            beyond = (self.around[a] & self.around[b]) - {face}
            if len(beyond) != 1:
                continue
            other = beyond.pop()
            d = next(v for v in self.faces[other].tolist() if v not in (a, b))
            known, far = (c, d) if c in self.around else (d, c)
            if self.tags[face] != self.tags[other] or known not in self.around:
                continue
            if far not in self._ring(known):
                corners = np.array([[a, d, c], [d, b, c]])
                change = self._change([face, other], [face, other], corners, [])
                if change is not None:
                    yield change

    def _change(
        self, before: list[int], changed: list[int], corners: np.ndarray, gone: list[int]
    ) -> _Change | None:
        """The change, if it betters the worst face and keeps all within the tolerance."""
        worst = float(altitudes(self.points, corners).min(initial=1.0))
        if worst <= altitudes(self.points, self.faces[before]).min():
            return None
        if self._off(changed, corners) > self.tolerance:
            return None
        a, b, c = (self.points[corners[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        along = np.einsum("ij,ij->i", normal, self.normal[changed])
        if np.any(along < TILT * np.linalg.norm(normal, axis=1)):
            return None
        return _Change(changed, corners, gone, worst)

    def _off(self, changed: list[int], corners: np.ndarray) -> float:
        heights = np.einsum("ijk,ik->ij", self.points[corners], self.normal[changed])
        return float(np.abs(heights - self.height[changed][:, None]).max(initial=0.0))

    def _make(self, change: _Change) -> None:
        self.moved = max(self.moved, self._off(change.faces, change.corners))
        for face in (*change.gone, *change.faces):
            for v in self.faces[face].tolist():
                if v in self.around:
                    self.around[v].discard(face)
        self.is_there[change.gone] = False
        self.faces[change.faces] = change.corners
        for face, three in zip(change.faces, change.corners.tolist(), strict=True):
            self.is_cut[face] = True
            for v in three:
                if v in self.around:
                    self.around[v].add(face)
        self.collapsed, self.turned = (
            self.collapsed + bool(change.gone),
            self.turned + (not change.gone),
        )

    def _ring(self, v: int) -> set[int]:
        return set(self.faces[sorted(self.around[v])].ravel().tolist()) - {v}

    def _border(self, v: int) -> set[int]:
        """Neighbours across edges where tags meet or the surface ends."""
        tags: dict[int, list[int]] = {}
        for face in sorted(self.around[v]):
            for w in self.faces[face].tolist():
                if w != v:
                    tags.setdefault(w, []).append(int(self.tags[face]))
        return {w for w, both in tags.items() if len(both) != 2 or both[0] != both[1]}

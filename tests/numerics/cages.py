"""Cages to test with."""

import itertools

import numpy as np


def box(counts, size=(1.0, 1.0, 1.0), shear=0.0, taper=0.0):
    """A closed box with so many vertices along each axis; sweep and taper along y make a wing."""
    places = [
        index
        for index in itertools.product(*map(range, counts))
        if any(i in (0, n - 1) for i, n in zip(index, counts, strict=True))
    ]
    row = {index: number for number, index in enumerate(places)}
    points = np.array(places) / (np.array(counts) - 1) - [0.5, 0, 0.5]
    points[:, [0, 2]] *= 1 - taper * points[:, 1:2]
    points = points * size
    points[:, 0] += shear * points[:, 1]
    faces = []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        sides = (0, counts[axis] - 1)
        for side, i, j in itertools.product(sides, range(counts[b] - 1), range(counts[c] - 1)):
            quad = []
            for u, v in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                index = [0, 0, 0]
                index[axis], index[b], index[c] = side, u, v
                quad.append(row[tuple(index)])
            quad = quad if side else quad[::-1]
            faces += [quad[:3], [quad[0], quad[2], quad[3]]]
    return points, np.array(faces)


def elbow():
    """An L of three cubes, extruded along z: not convex."""
    outline = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2], [0, 1]], float)
    cap = np.array([[0, 1, 4], [0, 4, 7], [1, 2, 3], [1, 3, 4], [7, 4, 5], [7, 5, 6]])
    points = np.concatenate([np.c_[outline, np.full(8, z)] for z in (0.0, 1.0)])
    i = np.arange(8)
    j = (i + 1) % 8
    sides = np.concatenate([np.stack([i, j, j + 8], 1), np.stack([i, j + 8, i + 8], 1)])
    return points, np.concatenate([cap[:, ::-1], cap + 8, sides])


def pair():
    """Two boxes apart from each other."""
    points, faces = box((3, 3, 3))
    return (
        np.concatenate([points, 0.5 * points + [1.2, 0.1, 0.2]]),
        np.concatenate([faces, faces + len(points)]),
    )


def wing():
    """A swept, tapered, thin box, 20 x 3 x 0.3."""
    return box((4, 9, 3), (3.0, 20.0, 0.3), shear=0.4, taper=0.6)


def split(points, faces):
    """Every triangle cut into four flat ones, and the old vertices' part in the new ones."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    unique, inverse = np.unique(ends, axis=0, return_inverse=True)
    ab, bc, ca = (inverse.reshape(-1, 3) + len(points)).T
    a, b, c = faces.T
    quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    half = np.zeros((len(unique), len(points)))
    np.put_along_axis(half, unique, 0.5, axis=1)
    fine = np.concatenate([np.stack(q, axis=1) for q in quarters])
    matrix = np.concatenate([np.eye(len(points)), half])
    return matrix @ points, fine, matrix


def turned(points):
    """So that no triangle is parallel to an axis."""
    a, b = 0.6, 0.35
    about_z = np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(b), np.sin(b)], [0, -np.sin(b), np.cos(b)]])
    return points @ about_z @ about_x


def inside(points, faces, count, seed=0):
    """Random places inside a cage, by the solid angle it covers."""
    rng = np.random.default_rng(seed)
    low, high = points.min(axis=0), points.max(axis=0)
    found = np.empty((0, 3))
    while len(found) < count:
        x = rng.uniform(low, high, (20 * count, 3))
        found = np.concatenate([found, x[_winding(points, faces, x) > 0.5]])
    return found[:count]


def _winding(points, faces, x):
    total = np.zeros(len(x))
    for face in faces:
        a, b, c = points[face][:, None] - x
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        dot = np.einsum
        det = dot("nd,nd->n", a, np.cross(b, c))
        rest = la * lb * lc + dot("nd,nd->n", a, b) * lc
        rest += dot("nd,nd->n", b, c) * la + dot("nd,nd->n", c, a) * lb
        total += np.arctan2(det, rest) / (2 * np.pi)
    return np.abs(total)

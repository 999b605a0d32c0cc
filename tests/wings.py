"""Wings and bodies whose planform is known."""

import numpy as np

from moldline.mesh.surface import Surface


def airfoil(count=40, thickness=0.12, camber=0.0, base=0.0, crest=0.4):
    """A closed loop (p, 2) from the trailing edge over the upper side to the nose and back.

    NACA four-digit, of unit chord; `base` is the height of its blunt trailing edge.
    """
    x = 0.5 * (1 - np.cos(np.linspace(0, np.pi, count + 1)))
    half = 5 * thickness * np.polyval([-0.1036, 0.2843, -0.3516, -0.126, 0.0], x)
    half = half + 5 * thickness * 0.2969 * np.sqrt(x) + base / 2 * x
    mean = camber * np.where(
        x < crest,
        (2 * crest * x - x**2) / crest**2,
        (1 - 2 * crest + 2 * crest * x - x**2) / (1 - crest) ** 2,
    )
    upper, lower = np.stack([x, mean + half], axis=1), np.stack([x, mean - half], axis=1)
    return np.concatenate([upper[::-1], lower[1:] if base else lower[1:-1]])


def wing(y, chord, twist, *, sweep=0.5, dihedral=0.1, section=None, place=(1.0, 0.2), sides=(1,)):
    """Sections at y, turned nose up about their quarter chords, which lie on a straight line.

    Open at its ends. `sides` says on which sides of y = 0 it is.
    """
    section = airfoil() if section is None else section
    y, chord, twist = np.broadcast_arrays(*map(np.asarray, (y, chord, twist)))
    ahead = chord[:, None] * (section[:, 0] - 0.25)
    up = chord[:, None] * section[:, 1]
    cosine, sine = np.cos(twist)[:, None], np.sin(twist)[:, None]
    x = place[0] + (y * np.tan(sweep))[:, None] + cosine * ahead + sine * up
    z = place[1] + (y * np.tan(dihedral))[:, None] - sine * ahead + cosine * up
    half = np.stack([x, np.broadcast_to(y[:, None], x.shape), z], axis=-1)
    surfaces = [joined(half * [1, side, 1]) for side in sides]
    points = np.concatenate([s.points for s in surfaces])
    faces = [s.faces[:, ::side] + i * half[..., 0].size for i, (s, side) in
             enumerate(zip(surfaces, sides, strict=True))]  # fmt: skip
    return Surface(points, np.concatenate(faces))


def body(count=61, around=32, end=np.pi, lift=0.5):
    """An ellipsoidal nose to x = 5, a cabin to 12 and a tail to 20, that rises by `lift`.

    It is 2 wide and 2.4 high. With `end` = pi it is the half at y >= 0, with 2 pi a whole one.
    """
    x = 10 * (1 - np.cos(np.linspace(0, np.pi, count)))
    tail = np.clip((x - 12) / 8, 0, None)
    radius = np.sqrt(1 - np.clip((5 - x) / 5, 0, 1) ** 2) - 0.9 * tail**2
    angle = np.linspace(0, end, around + 1)
    y, z = radius[:, None] * np.sin(angle), 1.2 * radius[:, None] * np.cos(angle)
    y[:, [0, -1]] = 0.0
    z = z + lift * tail[:, None] ** 2
    return joined(np.stack([np.broadcast_to(x[:, None], y.shape), y, z], axis=-1), closed=False)


def joined(rows, closed=True):
    """Two triangles between neighbours in an array of points; its rows are loops."""
    index = np.arange(rows[..., 0].size).reshape(rows.shape[:2])
    index = np.concatenate([index, index[:, :1]], axis=1) if closed else index
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = [np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]
    return Surface(rows.reshape(-1, 3), np.concatenate(faces))

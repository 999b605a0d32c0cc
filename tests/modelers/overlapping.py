"""Closed bodies to unite, and halves of them."""

import numpy as np

from moldline.mesh.surface import Surface


def box(low, high, cells: int = 1, component: str = "1") -> Surface:
    """Axis-parallel, with `cells` x `cells` squares on each side."""
    faces, points = [], []
    side = np.linspace(0, 1, cells + 1)
    u, v = (a.ravel() for a in np.meshgrid(side, side, indexing="ij"))
    i, j = (a.ravel() for a in np.meshgrid(range(cells), range(cells), indexing="ij"))
    a = i * (cells + 1) + j
    squares = np.stack([a, a + cells + 1, a + cells + 2, a + 1], axis=1)
    for axis in range(3):
        for end in (0, 1):
            place = np.empty((len(u), 3))
            place[:, axis], place[:, (axis + 1) % 3], place[:, (axis + 2) % 3] = end, u, v
            turned = squares if end else squares[:, ::-1]
            at = sum(map(len, points))
            faces += [turned[:, [0, 1, 2]] + at, turned[:, [0, 2, 3]] + at]
            points.append(place)
    unique, index = np.unique(np.concatenate(points).round(12), axis=0, return_inverse=True)
    low, high = np.asarray(low, float), np.asarray(high, float)
    faces = index.ravel()[np.concatenate(faces)]
    return Surface(low + unique * (high - low), faces, components=(component,))


def sphere(centre=(0.0, 0.0, 0.0), radius: float = 1.0, level: int = 2, turn=0.0) -> Surface:
    """An icosahedron refined, turned by an angle about (1, 2, 3)."""
    g = (1 + 5**0.5) / 2
    corners = [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0]]
    points = np.array([np.roll(c, k) for k in range(3) for c in corners], float)
    from scipy.spatial import ConvexHull

    faces = ConvexHull(points).simplices
    normal = np.cross(points[faces[:, 1]] - points[faces[:, 0]],
                      points[faces[:, 2]] - points[faces[:, 0]])  # fmt: skip
    inward = np.einsum("ij,ij->i", normal, points[faces[:, 0]]) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(level):
        points, faces = _refined(points, faces)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return Surface(np.asarray(centre) + radius * points @ rotation(turn).T, faces)


def _refined(points, faces):
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1)
    ends, index = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    ab, bc, ca = (index.reshape(-1, 3) + len(points)).T
    a, b, c = faces.T
    new = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    middle = points[ends].mean(axis=1)
    middle *= np.linalg.norm(points[0]) / np.linalg.norm(middle, axis=1, keepdims=True)
    return np.concatenate([points, middle]), np.concatenate([np.stack(f, axis=1) for f in new])


def rotation(angle: float) -> np.ndarray:
    """About the axis (1, 2, 3)."""
    x, y, z = np.array([1, 2, 3]) / 14**0.5
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def ring_skin(rings: np.ndarray, ends=None) -> tuple[np.ndarray, np.ndarray]:
    """Points and faces through rings (s, k, 3); `ends` are points that close it, or None."""
    count, around = rings.shape[:2]
    number = np.arange(count * around).reshape(count, around)
    beside = np.roll(number, -1, axis=1)
    a, b, c, d = (n.ravel() for n in (number[:-1], number[1:], beside[1:], beside[:-1]))
    faces = [np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)]
    points = [rings.reshape(-1, 3)]
    for end, ring, turn in zip(ends or (None, None), (0, -1), (1, -1), strict=True):
        if end is not None:
            at = sum(map(len, points))
            fan = [np.full(around, at), beside[ring], number[ring]][::1]
            faces.append(np.stack(fan, axis=1)[:, ::turn])
            points.append(np.array([end], float))
    return np.concatenate(points), np.concatenate(faces)


def wing(spanwise=12, around=24, root=0.0, tip=3.0, closed_root=True, lift=0.07) -> Surface:
    """A tapered, swept wing of elliptic sections along y."""
    y = np.linspace(root, tip, spanwise)
    angle = 2 * np.pi * (np.arange(around) + 0.3) / around
    chord = 1.0 - 0.2 * y
    rings = np.empty((spanwise, around, 3))
    rings[..., 0] = 0.4 * y[:, None] + 0.5 * chord[:, None] * np.cos(angle)
    rings[..., 1] = y[:, None]
    rings[..., 2] = lift + 0.06 * chord[:, None] * np.sin(angle)
    middle = np.stack([0.4 * y, y, np.full(spanwise, lift)], axis=1)
    points, faces = ring_skin(rings, (middle[0] if closed_root else None, middle[-1]))
    return outward(points, faces)


def body(along=25, around=30, radius=0.4, length=5.0, angles=None, height=0.0) -> Surface:
    """A spindle along x; with `angles` only what lies between the first and the last."""
    x = length * 0.5 * (1 - np.cos(np.linspace(0, np.pi, along + 2)))[1:-1] - 0.45 * length
    share = (x + 0.45 * length) / length
    r = radius * np.sqrt(4 * share * (1 - share))
    ends = [[-0.45 * length, 0, height], [0.55 * length, 0, height]]
    is_half = angles is not None
    angle = angles if is_half else 2 * np.pi * (np.arange(around) + 0.13) / around
    rings = np.empty((along, len(angle), 3))
    rings[..., 0] = x[:, None]
    rings[..., 1] = r[:, None] * np.cos(angle)
    rings[..., 2] = height + r[:, None] * np.sin(angle)
    points, faces = ring_skin(rings, ends)
    if is_half:  # the faces between the last and the first angle close the ring: leave them out
        points[: along * len(angle)].reshape(along, -1, 3)[:, [0, -1], 1] = 0.0
        numbers = faces % len(angle)
        on_rings = faces < along * len(angle)
        first = (on_rings & (numbers == 0)).any(axis=1)
        last = (on_rings & (numbers == len(angle) - 1)).any(axis=1)
        faces = faces[~(first & last)]
    return outward(points, faces)


def outward(points, faces) -> Surface:
    """Turned so that the volume is positive, against the middle."""
    a, b, c = (points[faces[:, i]] - points.mean(axis=0) for i in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c))
    return Surface(points, faces if volume > 0 else faces[:, ::-1])

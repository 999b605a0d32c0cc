"""Slivers taken away without losing what points are made of."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from overlapping import body, sphere, wing

from moldline.measures.volume import Volume
from moldline.mesh import quality
from moldline.mesh.cap import capped
from moldline.mesh.health import health
from moldline.modelers.union import Union
from moldline.modelers.wetted_report import ALTITUDE, altitudes
from moldline.numerics.taylor import remainder

NONE = np.zeros(0)
HALF = np.linspace(-np.pi / 2, np.pi / 2, 16)
CASES = {
    "transport": ((wing(40, 60), body(80, 90)), {}),
    "spheres": ((sphere(), sphere([1, 0.1, 0], turn=0.3), sphere([0.4, 1, 0.2], turn=0.7)), {}),
    "half": ((wing(closed_root=False), body(angles=HALF)), {"symmetry": "y"}),
}


@pytest.fixture(scope="module", params=list(CASES))
def both(request):
    parts, options = CASES[request.param]
    return parts, Union(**options).bind(*parts), Union(slivers="clean", **options).bind(*parts)


def test_slivers_go_and_the_surface_stays_sound(both):
    _, raw, clean = both
    assert raw.report.slivers > 5
    assert clean.report.slivers <= raw.report.slivers / 10
    assert clean.report.smallest_altitude > raw.report.smallest_altitude
    assert clean.report.is_watertight
    assert (clean.report.genus, clean.report.pieces, clean.report.openings) == (
        raw.report.genus,
        raw.report.pieces,
        raw.report.openings,
    )
    closed = capped(clean.geometry)[0] if clean.report.openings else clean.geometry
    assert health(closed).is_sound
    assert "slivers along the curves became" in " ".join(clean.report.sentences())


def test_what_stays_is_where_it_was(both):
    _, raw, clean = both
    given = {tuple(row) for row in np.asarray(raw.geometry.points)}
    assert all(tuple(row) in given for row in np.asarray(clean.geometry.points))
    assert clean.report.points < raw.report.points
    assert clean.report.residual == raw.report.residual


def test_the_shape_changes_by_no_more_than_the_tolerance(both):
    parts, raw, clean = both
    extent = np.linalg.norm(np.ptp(np.asarray(raw.geometry.points), axis=0))
    cut_area = raw.report.area
    assert abs(clean.report.volume - raw.report.volume) < 1e-4 * extent * cut_area
    assert clean.report.volume == pytest.approx(raw.report.volume, rel=1e-5)
    options = {"symmetry": "y"} if raw.report.openings else {}
    careful = Union(slivers="clean", tolerance=1e-12, **options).bind(*parts)
    assert careful.report.volume == pytest.approx(raw.report.volume, rel=1e-12)


def test_faces_that_were_not_cut_nor_beside_stay(both):
    _, raw, clean = both

    def corners(w):
        points = np.asarray(w.geometry.points)
        return {tuple(sorted(map(tuple, points[f]))) for f in w.geometry.faces}

    lost = corners(raw) - corners(clean)
    assert len(lost) < 3 * raw.report.cut


def test_a_cleaned_surface_follows_exactly(both):
    parts, _, clean = both
    points = tuple(np.asarray(p.points) for p in parts)
    along = tuple(
        5e-5 * np.sin(p @ np.array([[1.0, 0, 2], [2, 0, 1], [0.5, 0, -1]]) + k) * [1, 0, 1]
        for k, p in enumerate(points)
    )
    volume = Volume(clean.geometry.faces)

    def moved(s):
        return tuple(p + s[0] * d for p, d in zip(points, along, strict=True))

    for f in (lambda s: clean(NONE, *moved(s)), lambda s: volume.of(clean(NONE, *moved(s)))):
        assert remainder(f, jnp.zeros(1), jnp.ones(1)).is_right
    assert np.array_equal(clean(NONE, *points), np.asarray(clean.geometry.points))


def test_its_volume_changes_nearly_as_that_of_the_plain_one(both):
    parts, raw, clean = both
    points = tuple(np.asarray(p.points) for p in parts)
    lift = tuple(np.broadcast_to([0.1, 0, 1.0 - k], p.shape) for k, p in enumerate(points))
    slopes = []
    for made in (raw, clean):
        dx = jax.jvp(lambda *p, m=made: m(NONE, *p), points, lift)[1]
        x = jnp.asarray(made.geometry.points)
        volume = Volume(made.geometry.faces)
        slopes.append(float(jax.jvp(lambda p, v=volume: v.of(p)[0], (x,), (dx,))[1]))
    area = quality.area(raw.geometry)
    assert slopes[1] == pytest.approx(slopes[0], abs=1e-3 * area)


def test_the_limit_is_the_users():
    parts = CASES["transport"][0]
    plain = Union(altitude=0.05).bind(*parts)
    clean = Union(altitude=0.05, slivers="clean").bind(*parts)
    assert plain.report.slivers > 100
    assert clean.report.slivers <= plain.report.slivers / 20
    assert health(clean.geometry).is_sound


def test_slivers_are_measured_by_their_altitude():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, ALTITUDE / 2, 0], [0.5, 0.5, 0]])
    faces = np.array([[0, 1, 2], [0, 1, 3]])
    np.testing.assert_allclose(altitudes(points, faces), [ALTITUDE / 2, 0.5])

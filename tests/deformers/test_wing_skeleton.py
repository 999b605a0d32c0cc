"""Wing skeletons: what the moved wing's planform is, and what its sections are."""

import numpy as np
import pytest
from wings import airfoil, wing

import moldline as ml
from moldline.deformers.contract import check
from moldline.deformers.wing_skeleton import WingSkeleton
from moldline.errors import GeometryError, ParameterError
from moldline.mesh.planform import planform

SPAN = 10.0
STATIONS = np.linspace(0, SPAN, 5)
SECTION = airfoil(40, camber=0.04, base=0.004)


def swept(rows=9, section=SECTION, **options):
    """Linear chord and twist; every second row is a station."""
    y = np.linspace(0, SPAN, rows)
    return wing(y, 4 - 0.25 * y, np.radians(3 - 0.6 * y), section=section, **options)


def some(skeleton, seed=0):
    """All controls at once: semispan, chords, sweeps, dihedrals, twists up to 17 degrees."""
    scale = {"span": 2.0, "chord": 0.5, "sweep": 0.2, "dihedral": 0.2, "twist": 0.3}
    controls = np.random.default_rng(seed).uniform(-1, 1, skeleton.size)
    for name, rows in skeleton.parameters.items():
        controls[rows] *= scale[name]
    return controls


def only(skeleton, **changes):
    controls = np.zeros(skeleton.size)
    for name, change in changes.items():
        controls[skeleton.parameters[name]] = change
    return controls


def moved(skeleton, surface, controls):
    return surface.moved(np.asarray(skeleton.bind(surface.points)(controls)))


def measured(skeleton, surface, semispan):
    """What the surface's planform is, in the order of the controls."""
    places = skeleton.net.stations * semispan / skeleton.net.stations[-1]
    plan = planform(surface, places)
    angles = (plan.sweep_at(skeleton.sweep_at), plan.dihedral_at(skeleton.twist_at), plan.twist)
    return np.concatenate([[surface.points[:, 1].max()], plan.chord, *angles])


OPTIONS = [
    {},
    {"sweep_at": 0.25},
    {"sweep_at": 0.0, "twist_at": 1.0},
    {"sweep_at": 0.5, "twist_at": 0.0, "loft": "cubic"},
]


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_the_planform_read_back_is_what_was_asked_for(options):
    """All parameters at once; rows of the mesh lie on the stations."""
    skeleton = WingSkeleton.fitted(swept(), STATIONS, **options)
    controls = some(skeleton)
    found = measured(skeleton, moved(skeleton, swept(), controls), SPAN + controls[0])
    np.testing.assert_allclose(found, skeleton.values + controls, rtol=0, atol=1e-12)


def test_between_rows_it_is_read_back_as_well_as_the_mesh_resolves():
    """Stations fall between rows: a kink of the loft there is cut off, as far as a cell is wide."""
    for rows, near in ((40, 2e-2), (160, 7e-3)):
        surface = swept(rows)
        skeleton = WingSkeleton.fitted(surface, STATIONS)
        controls = some(skeleton)
        found = measured(skeleton, moved(skeleton, surface, controls), SPAN + controls[0])
        np.testing.assert_allclose(found, skeleton.values + controls, rtol=0, atol=near)


@pytest.mark.parametrize("loft", ["linear", "cubic"])
def test_sections_keep_their_shape_at_stations(loft):
    """Turned by 90 degrees and more, swept and lifted: all distances in a section stay."""
    surface = swept()
    skeleton = WingSkeleton.fitted(surface, STATIONS, loft=loft)
    controls = only(skeleton, twist=np.linspace(-0.5, 2.0, 5), sweep=0.3, dihedral=-0.2, span=1.0)
    shape = (9, len(SECTION), 3)
    before = np.asarray(surface.points).reshape(shape)[::2]
    after = np.asarray(moved(skeleton, surface, controls).points).reshape(shape)[::2]
    for rest, row in zip(before, after, strict=True):
        lengths = [np.linalg.norm(part[:, None] - part, axis=2) for part in (rest, row)]
        np.testing.assert_allclose(lengths[1], lengths[0], rtol=0, atol=1e-12 * 4)
        np.testing.assert_allclose(np.ptp(row[:, 1]), 0, atol=1e-13)


def test_between_stations_a_linear_loft_shrinks_turned_sections_by_an_eighth_of_the_square():
    surface = wing(np.linspace(0, SPAN, 9), 2.0, 0.0, section=SECTION)
    skeleton = WingSkeleton.fitted(surface, STATIONS)
    turn = 0.2
    after = moved(skeleton, surface, only(skeleton, twist=turn * np.arange(5)))
    plans = planform(surface, STATIONS[:-1] + 1.25), planform(after, STATIONS[:-1] + 1.25)
    shrunk = 1 - plans[1].chord / plans[0].chord
    np.testing.assert_allclose(shrunk, turn**2 / 8, rtol=0.01)


def test_lines_along_the_chords_stay_straight_between_stations():
    y = np.linspace(0, SPAN, 9)
    surface = wing(y, 4 - 0.25 * y, 0.05, section=SECTION)
    skeleton = WingSkeleton.fitted(surface, STATIONS)
    rows = np.asarray(moved(skeleton, surface, some(skeleton)).points).reshape(9, -1, 3)
    middles = (rows[:-2:2] + rows[2::2]) / 2
    np.testing.assert_allclose(rows[1::2], middles, rtol=0, atol=1e-12)


def test_twist_turns_about_its_axis_positive_nose_up():
    surface = swept()
    skeleton = WingSkeleton.fitted(surface, STATIONS, sweep_at=0.25, twist_at=0.25)
    after = moved(skeleton, surface, only(skeleton, twist=[0, 0, 0.3, 0.2, -0.1]))
    plans = planform(surface, STATIONS), planform(after, STATIONS)
    np.testing.assert_allclose(plans[1].quarter(), plans[0].quarter(), rtol=0, atol=1e-13)
    turned = plans[1].leading[:, 2] - plans[0].leading[:, 2]
    assert turned[2] > 0 > turned[4]


def test_a_chord_grows_about_the_line_that_carries_the_sweep():
    skeleton = WingSkeleton.fitted(swept(), STATIONS, sweep_at=0.0)
    after = moved(skeleton, swept(), only(skeleton, chord=0.5))
    plan = planform(after, STATIONS)
    np.testing.assert_allclose(plan.leading[:, 0], skeleton.net.origins[:, 0], rtol=0, atol=1e-13)
    heights = plan.high - plan.low
    before = planform(swept(), STATIONS)
    ratio = plan.chord / before.chord
    np.testing.assert_allclose(heights, ratio * (before.high - before.low), rtol=1e-12)


@pytest.mark.parametrize("at", [0.0, 0.25])
def test_turned_sections_are_rigid_and_the_line_they_turn_about_is_as_asked_for(at):
    """Swept by 40 degrees and lifted by 20 in the outer panels, twisted, and a span more."""
    surface = swept()
    skeleton = WingSkeleton.fitted(surface, STATIONS, sweep_at=at, twist_at=at, sections="turned")
    sweep, dihedral = np.array([0, 0, 0.7, 0.7]), np.array([0, 0, 0.35, 0.35])
    controls = only(skeleton, sweep=sweep, dihedral=dihedral, twist=0.2, span=1.0)
    before, after = (
        np.asarray(s.points).reshape(9, len(SECTION), 3)[::2]
        for s in (surface, moved(skeleton, surface, controls))
    )
    for rest, row in zip(before, after, strict=True):
        lengths = [np.linalg.norm(part[:, None] - part, axis=2) for part in (rest, row)]
        np.testing.assert_allclose(lengths[1], lengths[0], rtol=0, atol=1e-12 * 4)
    flat = np.ptp(after[..., 1], axis=1)
    np.testing.assert_allclose(flat[:2], 0, atol=1e-13)
    assert np.all(flat[2:] > 0.5)
    plan = planform(surface, STATIONS)
    line = plan.leading + at * (plan.trailing - plan.leading)
    found = np.asarray(skeleton.bind(line)(controls))
    np.testing.assert_allclose(found[:, 1], STATIONS * 1.1, rtol=0, atol=1e-12)
    for axis, angles in ((0, skeleton.sweep + sweep), (2, skeleton.dihedral + dihedral)):
        slopes = np.diff(found[:, axis]) / np.diff(found[:, 1])
        np.testing.assert_allclose(slopes, np.tan(angles), rtol=0, atol=1e-12)


def test_what_lies_beyond_the_tip_station_follows_rigidly():
    skeleton = WingSkeleton.fitted(swept(), STATIONS[:-1])
    controls = only(skeleton, twist=0.4, span=1.0, dihedral=0.2, sweep=-0.1)
    beyond = np.random.default_rng(0).uniform([3, 7.6, -1], [8, 12, 2], (30, 3))
    after = np.asarray(skeleton.bind(beyond)(controls))
    before, found = (np.linalg.norm(cloud - cloud[0], axis=1) for cloud in (beyond, after))
    np.testing.assert_allclose(found, before, rtol=1e-13)


def test_the_motion_has_no_jump_at_stations():
    skeleton = WingSkeleton.fitted(swept(), STATIONS[1:-1])
    place = np.array([4.0, 0.0, 0.5])
    for station in skeleton.net.stations:
        beside = place + np.outer([station - 1e-9, station + 1e-9], [0, 1, 0])
        one, other = np.asarray(skeleton.bind(beside)(some(skeleton)))
        np.testing.assert_allclose(one, other, rtol=0, atol=2e-8)


def test_whole_wings_move_as_mirror_images():
    half, whole = swept(), swept(sides=(1, -1))
    skeletons = [WingSkeleton.fitted(s, STATIONS) for s in (half, whole)]
    assert [s.net.sides for s in skeletons] == [(1,), (1, -1)]
    controls = some(skeletons[0])
    right = np.asarray(moved(skeletons[0], half, controls).points)
    both = np.asarray(moved(skeletons[1], whole, controls).points)
    np.testing.assert_array_equal(both, np.concatenate([right, right * [1, -1, 1]]))
    root = np.asarray(whole.points)[:, 1] == 0
    assert root.sum() == 2 * len(SECTION) and np.all(both[root, 1] == 0)


def test_a_left_wing_moves_as_the_right_one_s_image():
    skeletons = [WingSkeleton.fitted(swept(sides=(side,)), STATIONS * side) for side in (1, -1)]
    np.testing.assert_array_equal(skeletons[0].values, skeletons[1].values)
    controls = some(skeletons[0])
    right, left = (
        np.asarray(moved(s, swept(sides=s.net.sides), controls).points) for s in skeletons
    )
    np.testing.assert_array_equal(left, right * [1, -1, 1])


def test_a_skeleton_drawn_by_numbers_is_the_fitted_one():
    """Of a symmetric section, whose chord line the numbers are."""
    surface = swept(section=airfoil())
    fitted = WingSkeleton.fitted(surface, STATIONS, sweep_at=0.25)
    twist = np.radians(3 - 0.6 * STATIONS)
    numbers = {"taper": 0.375, "sweep": 0.5, "dihedral": 0.1, "twist": twist}
    root = (0.0, 0.0, 0.2)  # 1 less a quarter of the root's chord
    drawn = WingSkeleton.drawn(
        10, 4, **numbers, root=root, stations=STATIONS / 10, sides=(1,), sweep_at=0.25
    )
    np.testing.assert_allclose(drawn.values, fitted.values, rtol=0, atol=1e-13)
    controls = some(fitted)
    np.testing.assert_allclose(
        moved(drawn, surface, controls).points, moved(fitted, surface, controls).points, atol=1e-12
    )
    built = WingSkeleton.build(
        surface, stations=5, span=10.0, root_chord=4.0, taper=0.375, sweep=0.5, dihedral=0.1,
        twist=tuple(twist), root=root, sweep_at=0.25, sections="turned",
    )  # fmt: skip
    assert built.sections == "turned"
    np.testing.assert_array_equal(built.values, drawn.values)


@pytest.mark.parametrize(
    ("loft", "sides", "options"),
    [
        ("linear", (1, -1), {}),
        ("cubic", (1,), {}),
        ("linear", (1, -1), {"sections": "turned", "twist_at": 0.0}),
    ],
)
def test_a_wing_skeleton_keeps_the_contract(loft, sides, options):
    """Points between two stations, on both sides of the plane, and beyond the tip."""
    rng = np.random.default_rng(0)
    inside = rng.uniform([0, 2.9, -1], [8, 4.6, 1], (40, 3))
    inside[::2, 1] *= sides[-1]
    outside = rng.uniform([4, 10.5, 0], [8, 12, 2], (20, 3))
    skeleton = WingSkeleton.fitted(swept(sides=sides), STATIONS, loft=loft, **options)
    check(skeleton, np.concatenate([inside, outside]))


def test_controls_are_named_and_their_values_are_the_wing_s():
    skeleton = WingSkeleton.fitted(swept(section=airfoil()), STATIONS, sweep_at=0.25)
    counts = {name: len(rows) for name, rows in skeleton.parameters.items()}
    assert counts == {"span": 1, "chord": 5, "sweep": 4, "dihedral": 4, "twist": 5}
    assert skeleton.size == 19
    known = [10.0, *(4 - 0.25 * STATIONS), *[0.5] * 4, *[0.1] * 4, *np.radians(3 - 0.6 * STATIONS)]
    np.testing.assert_allclose(skeleton.values, known, rtol=0, atol=1e-13)


@pytest.mark.parametrize("loft", ["linear", "cubic"])
def test_the_drawn_net_moves_as_its_sections_do(loft):
    """The spline of the moved rows is where the corners of the sections at stations go."""
    skeleton = WingSkeleton.fitted(swept(), STATIONS, loft=loft)
    net, controls = skeleton.net, skeleton.pose(some(skeleton))
    back = np.linalg.inv(net.rows)
    rest, after = (np.einsum("sr,arbi->asbi", back, rows[0])
                   for rows in (net.rest, np.asarray(net.moved(controls))))  # fmt: skip
    np.testing.assert_allclose(rest[0, :, 0, 1], STATIONS, atol=1e-12)
    found = np.asarray(net.bind(rest.reshape(-1, 3))(controls))
    np.testing.assert_allclose(found, after.reshape(-1, 3), rtol=0, atol=1e-12)
    assert net.lines.max() == net.size // 3 - 1
    samples = net.samples(1000)
    assert len(samples) > 200
    assert samples[:, 1].min() == 0 and samples[:, 1].max() == SPAN


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: WingSkeleton.fitted(swept(), [0, 12.0]), "no section at y = 12"),
        (lambda: WingSkeleton.fitted(swept(), [5.0]), "two or more ascending stations"),
        (lambda: WingSkeleton.fitted(swept(), 3, "fin"), "no component named 'fin'"),
        (lambda: WingSkeleton.fitted(swept(), loft="ruled"), "linear or cubic, got 'ruled'"),
        (lambda: WingSkeleton.fitted(swept(), sections="flat"), "streamwise or turned, got 'flat'"),
        (lambda: WingSkeleton.fitted(swept(), sections="turned"), "alike, got 0.0 and 0.25"),
        (lambda: WingSkeleton.build(ml.Grid(np.zeros((8, 3)), ((2, 2, 2),))), "a Grid; give span"),
        (lambda: WingSkeleton.build(None, span=5.0, stations=10**12), "stations are 2 to 1000"),
        (lambda: WingSkeleton.drawn(0.0, 1.0), "to y = span, got root"),
        (lambda: WingSkeleton.drawn(5.0, 1.0, stations=(0, 1, 0.5)), "ascending fractions"),
        (lambda: WingSkeleton.drawn(5.0, 1.0, chord=[1, 2, 3]), "chord takes one number or 2"),
        (lambda: WingSkeleton.drawn(5.0, 1.0, taper=-1), r"above 0, got \[1.0, -1.0\]"),
        (lambda: WingSkeleton.drawn(5.0, 1.0, dihedral=1.5), "panel 0 .* more than 80 degrees"),
        (
            lambda: WingSkeleton.drawn(
                5.0, chord=[1, 1, 0.01, 0.01, 1], stations=np.linspace(0, 1, 5), loft="cubic"
            ),
            "falls below 0 between them; use loft = 'linear'",
        ),
    ],
)  # fmt: skip
def test_what_is_no_wing_skeleton_is_refused(make, said):
    with pytest.raises((GeometryError, ParameterError), match=said):
        make()


def test_a_real_wing_is_fitted_and_changed(data):
    """The ONERA M6, of single precision and with a rounded tip, 2.6 mm between points."""
    surface = ml.read(data("su2/onera_m6_surface.stl"))
    skeleton = WingSkeleton.fitted(surface, 4)
    assert skeleton.semispan == pytest.approx(1.1964, abs=0.03)
    np.testing.assert_allclose(np.degrees(skeleton.sweep), 30.0, atol=0.15)
    wanted = only(skeleton, span=0.2, sweep=-0.1, dihedral=0.05, twist=[0, -0.02, -0.04, -0.06])
    after = moved(skeleton, surface, wanted)
    places = skeleton.net.stations * (1 + 0.2 / skeleton.net.stations[-1])
    found = planform(after, places.tolist()).twist - planform(surface, skeleton.net.stations).twist
    np.testing.assert_allclose(found, [0, -0.02, -0.04, -0.06], atol=2e-3)
    assert after.points[:, 1].max() == pytest.approx(skeleton.values[0] + 0.2, abs=1e-12)

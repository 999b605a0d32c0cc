"""Variables and what links do with them."""

import math

import numpy as np
import pytest

import moldline as ml
from moldline import links
from moldline.deformers.contract import check
from moldline.deformers.lattice import Lattice
from moldline.deformers.posed import AbstractPosed
from moldline.errors import ParameterError

BOX = ml.Lattice.box((-1, -2, -0.5), (1, 2, 0.5), (4, 3, 2))


def motion(link, numbers, lattice=BOX):
    return (link.matrix @ np.asarray(numbers, float)).reshape(*lattice.shape, 3)


def test_thickness_moves_the_sides_apart_by_half_each():
    moves = motion(links.thickness(BOX, along="x", axis="z"), [0, 1, 0, 0])
    assert np.all(moves[1, :, 1, 2] == 0.5) and np.all(moves[1, :, 0, 2] == -0.5)
    assert np.count_nonzero(moves) == 6


def test_camber_moves_a_station_as_a_whole():
    moves = motion(links.camber(BOX, along="y", axis="z"), [0, 0, 2])
    assert np.all(moves[:, 2, :, 2] == 2) and np.count_nonzero(moves) == 8


def test_stations_along_two_axes_run_over_the_second_first():
    link = links.camber(BOX, along=("x", "y"), axis="z")
    assert link.size == 12
    assert np.all(motion(link, np.eye(12)[5])[1, 2, :, 2] == 1)


def test_radius_moves_every_side_outwards():
    moves = motion(links.radius(BOX, along="x"), [1, 0, 0, 0])
    assert np.all(moves[0, 0, 0] == [0, -1, -1]) and np.all(moves[0, 2, 1] == [0, 1, 1])
    assert np.all(moves[0, 1, 1] == [0, 0, 1]) and np.all(moves[1:] == 0)


def test_groups_are_chosen_by_index_box_and_distance():
    by_index = links.group(BOX, "x", index=[(0, 0, 0), (3, 2, 1)])
    assert np.count_nonzero(by_index.matrix) == 2
    by_box = links.group(BOX, "z", inside=[(-2, -3, 0), (2, 3, 1)])
    assert np.count_nonzero(by_box.matrix) == 12
    by_distance = links.group(BOX, "z", near=(-1, -2, -0.5), radius=0.5)
    assert np.count_nonzero(by_distance.matrix) == 1
    assert links.each(BOX, "y", index=[(0, 1, 0), (1, 1, 0)]).size == 2


def test_links_follow_the_lattices_own_axes():
    turned = ml.Lattice((0, 0, 0), [[0, 2, 0], [-1, 0, 0], [0, 0, 1]], (2, 2, 2))
    moves = motion(links.group(turned, "x"), [1.0], turned)
    np.testing.assert_allclose(moves[0, 0, 0], [0, 1, 0], atol=1e-15)


def test_frozen_stations_get_no_number():
    lattice = ml.Lattice.box((0, 0, 0), (1, 1, 1), (7, 2, 2), freeze=("x+",))
    assert links.thickness(lattice, "x", "z").size == 4
    assert links.each(lattice, "z").size == 16


@pytest.mark.parametrize(("low", "count"), [(-1.0, 5), (-1.0, 4), (0.0, 5)])
def test_a_mirrored_link_keeps_the_plane_to_the_bit_and_mirrors_the_rest(low, count):
    lattice = ml.Lattice.box((-1, low, -1), (1, 1, 1), (4, count, 3))
    rng = np.random.default_rng(0)
    free = links.controls(lattice) @ rng.normal(size=(lattice.size, 3))
    link = links.mirrored(lattice, free, "y")
    points = rng.uniform(-0.9, 0.9, (400, 3))
    points[:, 1] = np.abs(points[:, 1])
    points[:50, 1] = 0.0
    t = ml.variable("t", size=3)
    case = ml.Pipeline(ml.Cloud(points), [ml.Stage(lattice, {t: link})] * 2)
    values = {"t": [0.05, -0.03, 0.04]}
    moved = np.asarray(case(values).points)
    assert np.all(moved[:50, 1] == 0.0) and np.abs(moved - points).max() > 0.01
    sensitivity = case.sensitivity(values, "t")
    assert np.all(sensitivity[:50, 1] == 0.0)
    if low < 0:
        flip = np.array([1, -1, 1])
        other = np.asarray(case.embed(points * flip)(values).points)
        np.testing.assert_allclose(other, moved * flip, atol=1e-14)


def test_a_lattice_that_is_not_symmetric_cannot_be_mirrored():
    lattice = ml.Lattice.box((-1, -0.5, -1), (1, 1, 1), (4, 4, 3))
    with pytest.raises(ParameterError, match="not symmetric about y = 0"):
        links.mirrored(lattice, links.camber(lattice, "x", "z"), "y")


@pytest.mark.parametrize(
    ("low", "count", "options"),
    [
        (0.0, 4, {"ends": "blender"}),  # the second row moves points at the end too
        (0.0, 1, {}),  # the one row moves all points alike
        (0.3, 4, {"outside": "extend"}),  # the first row moves what is beyond the end
    ],
)
def test_a_lattice_that_would_move_the_plane_cannot_be_mirrored(low, count, options):
    lattice = ml.Lattice.box((-1, low, -1), (1, 1, 1), (3, count, 3), **options)
    with pytest.raises(ParameterError, match="move points at y = 0 off that plane, by "):
        links.mirrored(lattice, links.controls(lattice), "y")


def test_a_lattice_beside_the_plane_leaves_it_alone():
    lattice = ml.Lattice.box((-1, 0.3, -1), (1, 1, 1), (3, 4, 3))
    free = links.controls(lattice)
    np.testing.assert_array_equal(links.mirrored(lattice, free, "y").matrix, free.matrix)


def test_links_add_and_scale():
    up, down = links.camber(BOX, "x", "z"), links.thickness(BOX, "x", "z")
    both = up + 2 * down
    np.testing.assert_array_equal(both.matrix, up.matrix + 2 * down.matrix)
    with pytest.raises(ParameterError, match="do not add"):
        up + links.group(BOX, "z")


def test_units_are_converted_at_the_edge():
    angle = ml.variable("angle", unit="deg", bounds=(-5, 5))
    assert angle.factor == math.pi / 180
    inches = ml.variable("t", value=2.0, unit="in")
    case = ml.Pipeline(ml.Cloud(np.zeros((1, 3))), [ml.Stage(BOX, {inches: links.group(BOX, "z")})])
    assert float(case().points[0, 2]) == pytest.approx(0.0508, abs=1e-15)
    assert case.sensitivity(None, "t")[0, 2, 0] == pytest.approx(0.0254, abs=1e-15)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"name": "two words"}, "a word without spaces"),
        ({"name": "t", "unit": "furlong"}, "'furlong' is none of"),
        ({"name": "t", "bounds": (1, -1)}, "leave no choice"),
        ({"name": "t", "size": 3, "value": [1, 2]}, "one value and one pair of bounds"),
        ({"name": "t", "typical": 0.0}, "typical must be above 0"),
    ],
)
def test_a_variable_that_cannot_be_is_refused(arguments, message):
    with pytest.raises(ParameterError, match=message):
        ml.variable(**arguments)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: links.thickness(BOX, "z", "z"), "cannot move along z too"),
        (lambda: links.thickness(ml.Lattice.box((0,) * 3, (1,) * 3, (2, 2, 1)), "x", "z"), "two"),
        (lambda: links.group(BOX, "z", index=[(9, 0, 0)]), "of a lattice of"),
        (lambda: links.group(BOX, "z", near=(9, 9, 9), radius=0.1), "no control point there"),
        (lambda: links.group(BOX, "z", near=(9, 9, 9)), "near with radius"),
        (lambda: links.controls(BOX, [99]), "run from 0 to 71, got 99"),
    ],
)
def test_a_link_that_cannot_be_is_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


class Posed(AbstractPosed):
    """A box whose two parameters lift it and stretch it upwards."""

    net: Lattice

    @property
    def size(self):
        return 3

    @property
    def parameters(self):
        return {"lift": np.array([2]), "spread": np.array([0, 1])}

    @property
    def values(self):
        return np.array([2.0, 3.0, 5.0])

    def pose(self, controls):
        low, high, lift = controls
        share = self.net.rest.reshape(-1, 3)[:, 2:] + 0.5
        up = np.array([0.0, 0.0, 1.0])
        return ((lift + share * high + (1 - share) * low) * up).reshape(-1)


def test_a_named_parameter_is_turned_by_changes_or_by_what_it_measures():
    posed = Posed(BOX)
    change = links.named(posed, "spread")
    np.testing.assert_array_equal(change(np.array([0.5, 0.25])), [0.5, 0.25, 0.0])
    measured = links.named(posed, "spread", absolute=True)
    np.testing.assert_array_equal(measured(np.array([2.5, 3.25])), [0.5, 0.25, 0.0])
    one = links.named(posed, "spread", index=[1], absolute=True)
    np.testing.assert_array_equal(one(np.array([3.25])), [0.0, 0.25, 0.0])
    several = links.named(posed, ["lift", "spread"], index=[2, 0])
    np.testing.assert_array_equal(several(np.array([3.0, 5.0])), [0.0, 3.0, 5.0])
    lift = links.named(posed, "lift", absolute=True)
    both = (lift + one) * 2.0
    np.testing.assert_array_equal(both(np.array([4.0])), [0.0, 2.0, -2.0])
    np.testing.assert_array_equal((measured @ np.ones((2, 1)))(np.array([3.0])), [1.0, 0.0, 0.0])


def test_an_unknown_parameter_is_refused_with_those_there_are():
    with pytest.raises(ParameterError, match="no parameter 'twist'; there is: lift, spread"):
        links.named(Posed(BOX), "twist")
    with pytest.raises(ParameterError, match="numbers of 'spread' run from 0 to 1, got 2"):
        links.named(Posed(BOX), "spread", index=[2])


def test_a_posed_net_keeps_the_contract():
    rng = np.random.default_rng(5)
    check(Posed(BOX), rng.uniform(-0.4, 0.4, (40, 3)))


def test_absolute_values_at_rest_move_nothing(ball):
    points = np.asarray(ball.points) * 0.4
    twist = ml.variable("spread", value=(2.0, 3.0))
    stage = ml.Stage(Posed(BOX), {twist: links.named(Posed(BOX), "spread", absolute=True)})
    pipeline = ml.Pipeline(ml.Cloud(points), [stage])
    assert np.array_equal(pipeline.points(), points)
    moved = pipeline.points({"spread": (2.0, 3.5)})
    assert np.abs(np.asarray(moved) - points).max() > 0.2

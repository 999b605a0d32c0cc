"""Child boxes: stages that those before them carry along."""

import jax.numpy as jnp
import numpy as np
import pytest

import moldline as ml
from moldline import links
from moldline.deformers.contract import prove
from moldline.pipeline import examine
from moldline.plot.pictures import nets


@pytest.fixture(scope="module")
def family(ball):
    """A parent that moves everything far, and a child around the nose."""
    parent = ml.Lattice.around(ball, (4, 3, 3), margin=0.05)
    child = ml.Lattice.box((-1.2, -1, -1), (0.2, 1, 1), (6, 4, 4), freeze=("x+",))
    bend = ml.variable("bend", size=4, bounds=(-5, 5))
    nose = ml.variable("nose", size=3, bounds=(-1, 1))
    return ml.Pipeline(
        ball,
        [
            ml.Stage(parent, {bend: links.camber(parent, "x", "z")}, name="parent"),
            ml.Stage(child, {nose: links.camber(child, "x", "z")}, name="child", carried=True),
        ],
    )


VALUES = {"bend": np.array([3.0, -1.0, 0.5, 2.0]), "nose": np.array([0.3, -0.2, 0.1])}


def test_a_carried_box_adds_what_it_does_at_rest(family):
    rest = np.asarray(family.geometry.points)
    alone = [{**VALUES, other: 0 * VALUES[other]} for other in VALUES]
    child, parent = (np.asarray(family.points(values)) for values in alone)
    both = np.asarray(family.points(VALUES))
    np.testing.assert_allclose(both, parent + (child - rest), rtol=0, atol=1e-14)
    assert np.abs(child - rest).max() > 0.02


def test_it_differs_from_one_that_stays_in_space(family, ball):
    stages = [ml.Stage(s.deformer, s.links, name=s.name) for s in family.stages]
    apart = np.abs(np.asarray(ml.Pipeline(ball, stages).points(VALUES)) - family.points(VALUES))
    assert apart.max() > 0.05


def test_neutral_values_leave_every_coordinate_equal(family):
    assert np.array_equal(family.points(), family.geometry.points)


def test_its_derivatives_are_right(family):
    at = {name: jnp.asarray(value) for name, value in VALUES.items()}
    prove(family.points, at, {name: 0.1 * jnp.ones_like(v) for name, v in at.items()})


def test_points_that_ride_are_carried_too(family):
    rider = family.embed(np.asarray(family.geometry.points)[:20])
    np.testing.assert_array_equal(rider.points(VALUES), np.asarray(family.points(VALUES))[:20])


def test_a_picture_shows_the_child_where_its_parent_takes_it(family):
    _, (_, rest, moved, _) = nets(family, VALUES)
    still = {**VALUES, "nose": np.zeros(3)}
    parent = family.stages[0]
    expected = parent.deformer.follow(rest.reshape(-1, 3), parent.controls(family.values(still)))
    np.testing.assert_allclose(nets(family, still)[1].moved, expected, rtol=0, atol=1e-13)
    assert np.abs(moved - nets(family, still)[1].moved).max() > 0.1


def test_folds_of_a_carried_stage_are_found_by_its_own_slopes(family):
    """Against differences of the whole map at the place that is told."""
    found = examine.folding(family, VALUES)
    place = np.array(found.place)
    step = 1e-6
    cloud = np.concatenate([place + step * np.eye(3), place - step * np.eye(3)])
    moved = np.asarray(family.embed(cloud).points(VALUES))
    slopes = (moved[:3] - moved[3:]).T / (2 * step)
    assert np.linalg.det(slopes) == pytest.approx(found.smallest, abs=1e-4)


def test_a_child_box_in_a_case_file(tmp_path, ball):
    ml.write(tmp_path / "ball.tri", ball)
    lines = np.linspace(-1.1, 1.1, 4)
    points = np.stack(np.meshgrid(lines, lines, lines, indexing="ij"), axis=-1)
    points[..., 2] += 0.1 * points[..., 0] ** 2
    flat = points.transpose(2, 1, 0, 3).reshape(-1, 3)
    (tmp_path / "boxes").mkdir()
    ml.write(tmp_path / "boxes/box.xyz", ml.Grid(flat, ((4, 4, 4),)))
    (tmp_path / "case.toml").write_text(
        """
moldline = 1
[geometry.ball]
file = "ball.tri"
[variable.stretch]
value = 0.2
[variable.nose]
value = 0.1
[[stage]]
deformer = "lattice"
shape = [3, 2, 2]
[[stage.link]]
variable = "stretch"
link = "group"
axis = "x"
index = [[2, 0, 0], [2, 1, 1]]
[[stage]]
deformer = "control_volume"
file = "boxes/box.xyz"
outside = "keep"
carried = true
[[stage.link]]
variable = "nose"
link = "group"
axis = "z"
index = [[0, 0, 0]]
"""
    )
    case = ml.load(tmp_path / "case.toml")
    assert case.pipeline.stages[1].carried
    (tmp_path / "elsewhere").mkdir()
    case.save(tmp_path / "elsewhere/case.toml")
    again = ml.load(tmp_path / "elsewhere/case.toml")
    np.testing.assert_array_equal(again.pipeline.points(), case.pipeline.points())
    assert np.any(np.asarray(case.pipeline.points({"nose": 0.0})) != case.pipeline.points())


def test_points_outside_a_box_are_an_error_of_the_case(tmp_path, ball):
    ml.write(tmp_path / "ball.tri", ball)
    ml.write(
        tmp_path / "box.xyz",
        ml.Grid(np.indices((2, 2, 2)).reshape(3, -1).T[:, ::-1].astype(float), ((2, 2, 2),)),
    )
    (tmp_path / "case.toml").write_text(
        'moldline = 1\n[geometry.ball]\nfile = "ball.tri"\n[[stage]]\ndeformer = "control_volume"\n'
        'file = "box.xyz"\n'
    )
    with pytest.raises(ml.errors.CaseError) as told:
        ml.load(tmp_path / "case.toml")
    assert "case.toml: stage 'controlvolume' on 'ball': " in str(told.value)
    assert "of 1026 points lie outside" in str(told.value)

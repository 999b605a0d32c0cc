"""Measures read and hold the shape, colours say how it answers, checks find what is bad."""

import math
import tomllib

import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import insight, legend, measuring, project, session, view
from conftest import ball, write_tri


@pytest.fixture
def scene(ball_case):
    scene = bpy.context.scene
    project.open_case(scene, ball_case.read_text(), str(ball_case.parent))
    view.sync(scene)
    return scene


def measure(scene, name):
    return tomllib.loads(scene.moldline.text.as_string())["measure"][name]


def select_vertices(scene, numbers):
    surface = scene.moldline.surface
    surface.data.vertices.foreach_set("select", np.isin(np.arange(258), numbers))


def test_measures_are_read_at_the_values_as_they_are(scene):
    insight.refresh(scene)
    volume = measuring.reading(scene).numbers["volume"][0]
    assert 3.9 < volume < 4 * math.pi / 3
    assert measuring.reading(scene).beyond == {}
    table = {"measure": "volume", "bounds": [5.0, math.inf]}
    ((said, is_beyond),) = measuring.lines(table, [4.0], [1.0])
    assert said == "4 m³ (≥ 5), off by 1" and is_beyond
    ((said, is_beyond),) = measuring.lines({"measure": "volume"}, [4.0], None)
    assert said == "4 m³" and not is_beyond


def test_a_measure_is_added_held_let_go_and_removed(scene):
    bpy.ops.moldline.add_measure(kind="projected_area", along="x", name="front", keep="LEAST")
    told = measure(scene, "front")
    assert told["measure"] == "projected_area" and told["along"] == "x"
    assert told["bounds"][0] == pytest.approx(math.pi, rel=0.05) and told["bounds"][1] == math.inf
    assert view.active_measure(scene) == "front"
    assert measuring.reading(scene).numbers["front"][0] == pytest.approx(told["bounds"][0])

    bpy.ops.moldline.bound_measure(keep="NUMBERS", lower=3.5, upper=4.0)
    assert measure(scene, "front")["bounds"] == [3.5, 4.0]
    miss = measuring.reading(scene).beyond["front"]
    assert abs(float(np.ravel(miss)[0])) == pytest.approx(3.5 - told["bounds"][0])
    bpy.ops.moldline.bound_measure(keep="FREE")
    assert "bounds" not in measure(scene, "front")
    bpy.ops.moldline.remove_measure()
    assert "front" not in tomllib.loads(scene.moldline.text.as_string())["measure"]
    assert "front" not in measuring.reading(scene).numbers


def test_places_are_the_selected_vertices(scene):
    select_vertices(scene, [2, 5])
    bpy.ops.moldline.add_measure(kind="distance")
    assert measure(scene, "distance") == {
        "measure": "distance", "start": {"vertex": 2}, "end": {"vertex": 5}
    }  # fmt: skip
    assert measuring.reading(scene).numbers["distance"][0] == pytest.approx(2.0)


def test_a_box_that_is_selected_must_fit_within(scene):
    bpy.ops.mesh.primitive_cube_add(size=0.5, location=(0.1, 0, 0))
    bpy.ops.moldline.add_measure(kind="enclosed", name="tank", keep="NUMBERS", sides="LEAST")
    told = measure(scene, "tank")
    assert told["bounds"] == [0.0, math.inf]
    assert told["box"][0] == [-0.15, -0.25, -0.25] and told["box"][1] == [-0.15, -0.25, 0.25]
    assert told["box"][7] == [0.35, 0.25, 0.25]
    assert min(measuring.reading(scene).numbers["tank"]) > 0.3


def test_what_is_wrong_with_a_measure_is_a_sentence(scene):
    before = scene.moldline.text.as_string()
    select_vertices(scene, [])
    for given, sentence in (
        ({"kind": "position"}, "needs 1 selected vertex of the surface"),
        ({"kind": "volume", "name": "volume"}, "there is a measure 'volume' already"),
        ({"kind": "volume", "component": "tail"}, "tail"),
        ({"kind": "volume", "keep": "NUMBERS", "lower": 2.0, "upper": 1.0}, "no number"),
        ({"kind": "chord", "at": "left"}, "numbers apart by commas"),
    ):
        with pytest.raises(RuntimeError, match=sentence):
            bpy.ops.moldline.add_measure(**given)
    assert scene.moldline.text.as_string() == before


def colours(scene):
    held = scene.moldline.surface.data.color_attributes.active_color
    found = np.empty(4 * len(held.data), np.float32)
    held.data.foreach_get("color", found)
    return found.reshape(-1, 4)


def shading():
    areas = [area for screen in bpy.data.screens for area in screen.areas]
    views = [area for area in areas if area.type == "VIEW_3D"]
    return {area.spaces.active.shading.color_type for area in views}


def test_the_surface_is_coloured_by_sensitivity_and_gets_its_own_colours_back(scene):
    before = shading()
    scene.moldline.active_number = 1
    assert bpy.ops.moldline.show_sensitivity() == {"FINISHED"}
    scale, shades = legend.shown(), colours(scene)
    case = project.case(scene)
    expected = case.colour(project.values(scene), "lift", 1)
    assert scale.largest == pytest.approx(np.abs(expected).max())
    assert scale.title.startswith("lift[1]") and scale.unit == "m/m" and scale.is_signed
    np.testing.assert_allclose(shades, scale.rgba(expected), atol=1e-6)
    top, bottom = shades[np.argmax(expected)], shades[np.argmin(expected)]
    assert top[0] > top[2] and bottom[2] > bottom[0]  # red outwards, blue inwards
    assert shading() <= {"VERTEX"}

    scene.moldline_view.how = "size"
    assert not legend.shown().is_signed
    bpy.ops.moldline.hide_sensitivity()
    assert legend.shown() is None and shading() == before
    assert scene.moldline.surface.data.color_attributes.active_color is None


def test_a_check_says_what_is_sound(scene):
    bpy.ops.moldline.check_health()
    found = insight.health(scene)
    assert found["is_sound"] and found["is_of_now"] and not len(found["faces"])
    assert not bpy.ops.moldline.select_faults.poll()
    project.set_values(scene, {"lift": [0.1, 0.2]})
    assert not insight.health(scene)["is_of_now"]


def test_bad_faces_are_selected(tmp_path, ball_case):
    points, faces = ball()
    other = points * 0.5 + [0.9, 0.0, 0.0]
    write_tri(
        ball_case.parent / "ball.tri",
        np.vstack([points, other]),
        np.vstack([faces, faces + len(points)]),
    )
    scene = bpy.context.scene
    project.open_case(scene, ball_case.read_text(), str(ball_case.parent))
    bpy.ops.moldline.check_health()
    found = insight.health(scene)
    assert not found["is_sound"] and len(found["faces"]) > 10 and found["sentences"]
    assert bpy.ops.moldline.select_faults() == {"FINISHED"}
    surface = scene.moldline.surface
    assert surface.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    chosen = np.empty(len(surface.data.polygons), bool)
    surface.data.polygons.foreach_get("select", chosen)
    assert set(found["faces"]) <= set(np.flatnonzero(chosen))


def test_the_pipeline_is_told(scene):
    told = insight.overview(scene)
    assert told["geometries"]["ball"]["steps"][1]["variables"] == ["lift[2]"] or (
        told["geometries"]["ball"]["steps"][1]["variables"] == ("lift[2]",)
    )


def test_a_lost_moldline_is_said_and_readings_stay(scene):
    insight.refresh(scene)
    session.stop()
    insight.refresh(scene)
    assert "volume" in measuring.reading(scene).numbers
    assert insight.trouble(scene)

"""Cases are opened, saved and taken back; the command line runs what was saved, unchanged."""

import os
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import (
    case_files,
    convert,
    files,
    following,
    handles,
    project,
    session,
)
from conftest import ball, write_tri

PYTHON = os.environ.get("MOLDLINE_PYTHON", str(Path(__file__).parents[2] / ".venv/bin/python"))


def shape():
    """Points of the case's surface, up to date."""
    following.settle()
    return convert.points(project.surface(bpy.context.scene).data)


def run_by_command(path):
    """Points that the command line makes of a case file."""
    out = path.with_name("made.vtp")
    command = [PYTHON, "-m", "moldline", "deform", str(path), "-o", str(out)]
    subprocess.run(command, check=True, capture_output=True)
    found = []
    files.import_file(out, then=found.append)
    return convert.points(found[0].data)


def test_a_case_written_by_hand_opens_and_is_saved_with_its_comments(ball_case):
    assert bpy.ops.moldline.open_case(filepath=str(ball_case)) == {"FINISHED"}
    scene = bpy.context.scene
    assert scene.moldline.path == str(ball_case) and len(handles.all_of(scene)) == 1
    assert bpy.context.object == project.surface(scene)
    project.set_values(scene, {"lift": [0.25, -0.125]})
    points = shape()
    assert bpy.ops.moldline.save_case() == {"FINISHED"}
    text = ball_case.read_text()
    assert "# Comments of a hand-written case stay." in text and "0.25" in text
    assert project.text(scene) == text and "saved" in scene.moldline.status
    np.testing.assert_array_equal(shape(), points)
    np.testing.assert_array_equal(run_by_command(ball_case), points)


def test_with_a_handle_in_hand_the_surface_is_what_is_exported(ball_case, tmp_path):
    bpy.ops.moldline.open_case(filepath=str(ball_case))
    bpy.ops.moldline.select_handle(stage=0)
    assert bpy.ops.moldline.export_geometry(filepath=str(tmp_path / "out.vtp")) == {"FINISHED"}
    points = shape()
    files.import_file(tmp_path / "out.vtp")
    np.testing.assert_array_equal(convert.points(bpy.context.object.data), points)


def test_a_case_begun_in_blender_is_saved_with_what_it_needs(tmp_path):
    write_tri(tmp_path / "ball.tri", *ball())
    files.import_file(tmp_path / "ball.tri", "m")
    bpy.ops.moldline.add_cage(faces=60)
    scene, obj = bpy.context.scene, bpy.context.object
    for vertex in list(obj.data.vertices)[:5]:
        vertex.co *= 1.1
    points = shape()
    with pytest.raises(RuntimeError, match="no file yet"):
        bpy.ops.moldline.save_case()
    target = tmp_path / "saved" / "mine.toml"
    target.parent.mkdir()
    assert bpy.ops.moldline.save_case_as(filepath=str(target)) == {"FINISHED"}
    assert scene.moldline.folder == str(target.parent) and scene.moldline.path == str(target)
    assert [p.suffix for p in target.parent.iterdir() if p.is_file()].count(".obj") == 1
    np.testing.assert_array_equal(shape(), points)
    np.testing.assert_array_equal(run_by_command(target), points)


def test_revert_brings_back_what_is_on_disk(ball_case):
    bpy.ops.moldline.open_case(filepath=str(ball_case))
    before = shape()
    project.set_values(bpy.context.scene, {"lift": [0.25, 0.25]})
    shape()
    assert bpy.ops.moldline.revert_case() == {"FINISHED"}
    np.testing.assert_array_equal(shape(), before)


def test_a_case_that_is_closed_leaves_its_surface(ball_case):
    bpy.ops.moldline.open_case(filepath=str(ball_case))
    scene = bpy.context.scene
    surface = project.surface(scene)
    assert bpy.ops.moldline.close_case() == {"FINISHED"}
    assert not project.has_case(scene) and not handles.all_of(scene)
    assert surface.name in scene.objects and "lift" not in surface


def test_what_cannot_be_opened_is_said_and_changes_nothing(ball_case, tmp_path):
    bpy.ops.moldline.open_case(filepath=str(ball_case))
    scene, text = bpy.context.scene, project.text(bpy.context.scene)
    wrong = ball_case.parent / "wrong.toml"
    wrong.write_text(text.replace('deformer = "lattice"', 'deformer = "lettuce"'))
    with pytest.raises(RuntimeError, match="lettuce"):
        bpy.ops.moldline.open_case(filepath=str(wrong))
    with pytest.raises(RuntimeError, match="cannot be read"):
        bpy.ops.moldline.open_case(filepath=str(tmp_path / "none.toml"))
    assert project.text(scene) == text and len(handles.all_of(scene)) == 1


def test_only_values_that_differ_are_written():
    text = "[variable.a]\nvalue = 1.0\n[variable.b]\nsize = 2\n[variable.c]\nvalue = [1.0, 2.0]\n"
    values = {"a": np.array([2.0]), "b": np.zeros(2), "c": np.array([1.0, 3.0])}
    assert case_files.changes(text, values) == [
        {"set": ["variable", "a", "value"], "to": 2.0},
        {"set": ["variable", "c", "value"], "to": [1.0, 3.0]},
    ]


def test_moldline_is_started_by_opening_a_case(ball_case):
    session.stop()
    assert bpy.ops.moldline.open_case(filepath=str(ball_case)) == {"FINISHED"}
    assert session.state() == "ready" and project.is_open(bpy.context.scene)

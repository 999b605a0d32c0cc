"""Variables by what a skeleton measures: they begin at what the wing has."""

import importlib
import tomllib
from pathlib import Path

import bpy
import numpy as np
import pytest
from bl_ext.user_default.moldline import project, view

WING = Path(__file__).parents[2] / "examples/data/transport_wing.tri"
CASE = """\
moldline = 1

[geometry.wing]
file = "{file}"
units = "m"

[variable.twist]
size = 3
unit = "deg"

[[stage]]
deformer = "wing_skeleton"
stations = 3

[[stage.link]]
variable = "twist"
link = "named"
parameter = "twist"
"""


@pytest.fixture
def scene(tmp_path):
    scene = bpy.context.scene
    project.open_case(scene, CASE.format(file=WING.resolve().as_posix()), str(tmp_path))
    view.sync(scene)
    (handle,) = [one for one in scene.objects if one.moldline.role]
    bpy.context.view_layer.objects.active = handle
    return scene


def table(scene, name):
    return tomllib.loads(scene.moldline.text.as_string())["variable"][name]


def test_an_absolute_sweep_begins_at_the_wings_own(scene):
    before = project.case(scene).points(project.values(scene))
    assert bpy.ops.moldline.add_variable(by="NAMED", parameter="sweep") == {"FINISHED"}
    told = table(scene, "sweep")
    assert told["unit"] == "deg" and len(told["value"]) == 2 and min(told["value"]) > 10
    after = project.case(scene).points(project.values(scene))
    np.testing.assert_allclose(after, before, atol=1e-9)


def test_a_change_of_chord_begins_at_zero(scene):
    bpy.ops.moldline.add_variable(by="NAMED", parameter="chord", absolute=False, name="wider")
    told = table(scene, "wider")
    assert told["value"] == 0.0 and told["size"] == 3 and told["unit"] == "m"


def test_other_parameters_are_named(scene):
    choosing = importlib.import_module("bl_ext.user_default.moldline.choosing")
    assert choosing.parameters(bpy.context) == ["span", "chord", "sweep", "dihedral", "twist"]
    with pytest.raises(RuntimeError, match="no parameter 'angle' of a wing skeleton"):
        bpy.ops.moldline.add_variable(by="NAMED", parameter="angle")

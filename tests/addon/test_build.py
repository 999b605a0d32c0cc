"""The built extension: whole, valid, and with the client as it is in moldline."""

import tomllib
import zipfile
from pathlib import Path

import bl_ext.user_default.moldline as addon
import bpy

TOP = Path(__file__).parents[2]
HERE = Path(addon.__file__).parent


def test_it_is_installed_and_switched_on():
    assert addon.__name__ in bpy.context.preferences.addons


def test_the_client_is_the_servers_own():
    for copied in (HERE / "client").glob("*.py"):
        assert copied.read_text() == (TOP / "src/moldline/server" / copied.name).read_text()


def test_it_brings_one_wheel_of_the_same_version():
    (wheel,) = (HERE / "moldline").glob("*.whl")
    with zipfile.ZipFile(wheel) as inside:
        assert "moldline/server/front.py" in inside.namelist()
    manifest = tomllib.loads((HERE / "blender_manifest.toml").read_text())
    assert manifest["version"].replace("-dev.", ".dev") == wheel.name.split("-")[1]


def test_every_file_says_its_licence_and_imports_nothing_of_moldline_but_the_client():
    for module in HERE.glob("*.py"):
        text = module.read_text()
        assert text.startswith("# SPDX-License-Identifier: GPL-3.0-or-later\n"), module.name
        named = {
            line.split()[1] for line in text.splitlines() if line.startswith(("import ", "from "))
        }
        assert not {"jax", "moldline"} & {name.split(".")[0] for name in named}, module.name
        assert "sys.path" not in text, module.name


def test_it_can_be_switched_off_and_on_again():

    for act in (addon.unregister, addon.register):
        act()
    assert all(module.__name__.startswith(addon.__name__) for module in addon.MODULES)
    assert bpy.ops.moldline.import_geometry.idname_py() == "moldline.import_geometry"
    assert all(hasattr(bpy.types, f"MOLDLINE_OT_{one}_geometry") for one in ("import", "export"))

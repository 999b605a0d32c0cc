"""The environment's button: what it needs is looked for, what fails is a sentence."""

import stat
import subprocess
import sys
from pathlib import Path

import bpy
import pytest
from bl_ext.user_default.moldline import environment, session


class Online:
    """Blender with network access allowed, which as a module it has not."""

    class app:
        online_access = True
        background = True

    context, utils, path = bpy.context, bpy.utils, bpy.path


@pytest.fixture
def own(preferences, monkeypatch, tmp_path):
    """The add-on's own environment, in a folder of the test's."""
    preferences.python = ""
    preferences.socket = str(tmp_path / "own.sock")
    monkeypatch.setattr(environment, "bpy", Online)
    monkeypatch.setattr(environment, "folder", lambda: tmp_path / "environment")
    yield tmp_path / "environment"
    session.stop()


def program(path, *lines):
    """A command that does what some lines of Python say."""
    path.write_text("\n".join([f"#!{sys.executable}", "import sys", *lines]) + "\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def test_it_lies_in_blenders_folder_for_the_extension():
    assert environment.folder().is_relative_to(bpy.utils.resource_path("USER"))
    assert environment.folder().parent.name == "moldline"


def test_without_network_access_it_says_where_to_allow_it(own, monkeypatch):
    monkeypatch.setattr(Online.app, "online_access", False)
    with pytest.raises(RuntimeError, match=r"Preferences > System > Network"):
        bpy.ops.moldline.make_environment()
    assert session.state() == "failed" and "Network" in session.sentence()


def test_without_a_python_that_can_it_says_what_to_install(own, monkeypatch, tmp_path):
    lacking = program(tmp_path / "lacking", "raise ImportError('No module named ensurepip')")
    old = program(tmp_path / "old", "print(3, 9)")
    none = str(tmp_path / "none")
    monkeypatch.setattr(environment, "_candidates", lambda: iter([lacking, old, none]))
    with pytest.raises(environment.Unmade) as told:
        environment.base_python()
    said = str(told.value)
    assert "No module named ensurepip" in said and "is 3.9" in said and "apt install" in said
    with pytest.raises(RuntimeError, match="apt install python3-venv"):
        bpy.ops.moldline.make_environment()
    assert "apt install" in session.sentence()


def test_blenders_own_python_is_the_first_that_is_tried():
    assert next(environment._candidates()) == sys.executable
    assert environment.base_python() == sys.executable


def test_an_installation_that_fails_is_told_by_its_last_words(own, monkeypatch, tmp_path):
    said = "ERROR: no matching distribution"
    base = program(
        tmp_path / "base",
        "from pathlib import Path",
        "if '-c' in sys.argv: print(3, 12); sys.exit()",
        "where = Path(sys.argv[-1], 'bin'); where.mkdir(parents=True)",
        f"(where / 'python').write_text('#!/bin/sh\\necho {said}\\nexit 1\\n')",
        "(where / 'python').chmod(0o755)",
    )
    monkeypatch.setattr(environment, "_candidates", lambda: iter([base]))
    with pytest.raises(RuntimeError, match=f"could not be installed.*{said}"):
        bpy.ops.moldline.make_environment()
    assert environment.log()[-2] == said
    assert not environment.is_making() and session.state() == "failed"


def test_an_environment_that_cannot_be_made_is_told(own, monkeypatch, tmp_path):
    base = program(
        tmp_path / "base", "if '-c' in sys.argv: print(3, 12); sys.exit()", "sys.exit('disk full')"
    )
    monkeypatch.setattr(environment, "_candidates", lambda: iter([base]))
    with pytest.raises(RuntimeError, match="could not be made: disk full"):
        bpy.ops.moldline.make_environment()


def test_the_users_own_python_comes_first_and_switches_the_button_off(preferences):
    assert environment.python() == preferences.python and not environment.is_own()
    assert not bpy.ops.moldline.make_environment.poll()


def test_windows_has_its_interpreter_elsewhere(monkeypatch):
    where = Path("somewhere")
    monkeypatch.setattr(environment.os, "name", "nt")
    try:
        assert environment._python_in(where).as_posix() == "somewhere/Scripts/python.exe"
    finally:
        monkeypatch.undo()
    assert environment._python_in(where).as_posix() == "somewhere/bin/python"


def test_the_wheel_tells_the_version():
    own = environment.wheel()
    assert own is not None and own.name.startswith(f"moldline-{environment.version()}-")


@pytest.mark.slow
def test_the_button_makes_an_environment_that_works(own, ball_case):
    assert session.state() == "no environment" and environment.button() == "Make environment"
    assert bpy.ops.moldline.make_environment() == {"FINISHED"}
    assert environment.log()[-1] == "the environment is ready"
    assert session.state() == "ready" and not session.mismatch()
    told = []
    session.run(lambda client: client.open(ball_case).points(), told.append)
    assert told[0].shape == (258, 3)
    assert environment.button() == "Update environment"
    assert bpy.ops.moldline.make_environment() == {"FINISHED"}
    assert session.state() == "ready"
    says = subprocess.run(
        [environment.python(), "-c", "import moldline; print(moldline.__file__)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert str(own) in says.stdout

"""The Blender extension, as a file to install: addon/ with the client and a wheel of moldline.

    python tools/build_addon.py                  into dist/moldline-VERSION.zip
    python tools/build_addon.py --wheel A.whl    with a wheel that is there already

Blender's own `extension build` and `validate` do it: those of the program that BLENDER names or
PATH has, or of Blender as a module in .venv-blender. Only the standard library is needed.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[1]
CLIENT = ("client", "remote", "live", "places", "starting", "shared", "wire", "protocol")
"""Modules of moldline.server that are a client by themselves."""


def wheel(folder: Path) -> Path:
    """A new wheel of moldline, alone in a folder."""
    shutil.rmtree(folder, ignore_errors=True)
    uv = TOP / ".uv/bin/uv"
    command = [str(uv) if uv.exists() else shutil.which("uv") or "", "build", "--wheel", "--quiet"]
    if not command[0]:
        sys.exit("building moldline's wheel needs uv: `make .venv/ready` installs it in .uv")
    _run([*command, "--out-dir", str(folder)])
    return next(folder.glob("*.whl"))


def stage(target: Path, given: Path) -> Path:
    """All that the extension consists of, in one folder."""
    shutil.rmtree(target, ignore_errors=True)
    left_out = shutil.ignore_patterns("__pycache__", "client", "moldline", ".*")
    shutil.copytree(TOP / "addon", target, ignore=left_out)
    for name in ("__init__", *CLIENT):
        (target / "client").mkdir(exist_ok=True)
        shutil.copy(TOP / f"src/moldline/server/{name}.py", target / "client")
    (target / "moldline").mkdir()
    shutil.copy(given, target / "moldline")
    manifest = target / "blender_manifest.toml"
    version = f'version = "{_semantic(given.name.split("-")[1])}"'
    told = re.sub(r'(?m)^version = ".*"$', version, manifest.read_text())
    manifest.write_text(told)
    return target


def build(staged: Path, output: Path) -> Path:
    """The file to install, valid by Blender's own rules."""
    output.mkdir(exist_ok=True, parents=True)
    for old in output.glob("moldline-*.zip"):
        old.unlink()
    extension = _extension_command()
    _run([*extension, "build", "--source-dir", str(staged), "--output-dir", str(output)])
    made = next(output.glob("moldline-*.zip"))
    _run([*extension, "validate", str(made)])
    return made


def _semantic(version: str) -> str:
    """A version as extensions have it: 0.1.1.dev193 is 0.1.1-dev.193."""
    numbers, _, rest = version.partition(".dev")
    return f"{numbers}-dev.{rest}" if rest else numbers


def _run(command: list[str]) -> None:
    told = subprocess.run(command, cwd=TOP)
    if told.returncode:
        sys.exit(f"{' '.join(command)}: ended with {told.returncode}")


def _extension_command() -> list[str]:
    """Blender's `extension` command: this Python's, the program's, or that of .venv-blender."""
    return (
        _of_module(Path(sys.executable))
        or _of_program(os.environ.get("BLENDER") or shutil.which("blender"))
        or _of_module(TOP / ".venv-blender/bin/python")
        or sys.exit("no Blender 4.2 or later on PATH or as BLENDER, no .venv-blender: make blender")
    )


def _of_program(program: str | None) -> list[str]:
    told = (
        subprocess.run([program, "--version"], capture_output=True, text=True) if program else None
    )
    found = re.search(r"Blender (\d+)\.(\d+)", told.stdout) if told else None
    is_new = found is not None and (int(found[1]), int(found[2])) >= (4, 2)
    return [str(program), "--command", "extension"] if is_new else []


def _of_module(python: Path) -> list[str]:
    """The command of Blender as a module, which needs no more than Python itself."""
    inside = "site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py"
    found = [*python.parents[1].glob(f"lib/*/{inside}"), *python.parents[1].glob(f"Lib/{inside}")]
    return [str(python), str(found[0])] if found else []


def main() -> None:
    """What the command line says."""
    reader = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    reader.add_argument("--wheel", type=Path, help="of moldline; by default a new one is built")
    reader.add_argument("--output", type=Path, default=TOP / "dist", help="folder for the file")
    reader.add_argument("--staged", type=Path, default=TOP / "build/addon", help="folder to use")
    asked = reader.parse_args()
    given = asked.wheel or wheel(asked.staged.parent / "wheel")
    print(build(stage(asked.staged, given), asked.output))


if __name__ == "__main__":
    main()

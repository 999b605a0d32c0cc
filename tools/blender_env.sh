#!/usr/bin/env bash
# An environment with Blender as a Python module, apart from moldline's own: bpy is GPL-3.0, wants
# NumPy 1 and is 800 MB. Only tests and benchmarks that compare with Blender use it, as a process.
#
#   bash tools/blender_env.sh                     make .venv-blender (needs Python 3.11)
#   bash tools/blender_env.sh --system-libraries  first install Debian's X11 libraries (as root)
set -euo pipefail
cd "$(dirname "$0")/.."
libraries="libx11-6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libgl1 libxxf86vm1"
bin=.venv-blender/bin
works() { "$bin/python" -c 'import bpy' >/dev/null 2>&1; }

if [ -x "$bin/python" ] && works; then
  echo "Blender is in .venv-blender"
  exit 0
fi
python=$(command -v python3.11 || command -v python3)
if ! "$python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))'; then
  echo "bpy 4.5 needs Python 3.11; $python is $("$python" --version)" >&2
  exit 1
fi
if [ "${1:-}" = --system-libraries ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $libraries; } >/dev/null 2>&1 ||
    echo "could not install the system libraries: $libraries" >&2
fi
"$python" -m venv .venv-blender
"$bin/pip" install --quiet --disable-pip-version-check 'bpy==4.5.*' || {
  echo "the package index has no bpy 4.5 for this machine" >&2
  exit 1
}
if ! works; then
  echo "bpy does not import:" >&2
  "$bin/python" -c 'import bpy' 2>&1 | tail -1 >&2
  echo "on Debian: apt-get install $libraries" >&2
  exit 1
fi
echo "Blender is in .venv-blender"

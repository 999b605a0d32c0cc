#!/usr/bin/env bash
# An environment with Blender as a Python module, apart from moldline's own: bpy is GPL-3.0, wants
# a NumPy of its own and is 800 MB. Tests and benchmarks that compare with Blender use it, as a
# process; the add-on's own tests run in it.
#
#   bash tools/blender_env.sh                     make .venv-blender: Blender 4.5, needs Python 3.11
#   bash tools/blender_env.sh --system-libraries  first install what bpy needs of Debian (as root)
#   VERSION=5.2 bash tools/blender_env.sh         make .venv-blender52: needs Python 3.13
set -euo pipefail
cd "$(dirname "$0")/.."
libraries="libx11-6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libgl1"
version=${VERSION:-4.5}
case $version in
  4.5) needed=3.11 folder=.venv-blender ;;
  5.2) needed=3.13 folder=.venv-blender52 ;;
  *) echo "VERSION is 4.5 or 5.2, the two that get repairs for years; got $version" >&2; exit 1 ;;
esac
bin=$folder/bin

works() { "$bin/python" -c 'import bpy, pytest' >/dev/null 2>&1; }
is_needed() { [ "$("$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)" = $needed ]; }
fail() { printf '%s\n' "$@" >&2; exit 1; }

if works; then
  echo "Blender $version is in $folder"
  exit 0
fi
for python in "${PYTHON:-python$needed}" python$needed python3 none; do
  if is_needed "$python"; then break; fi
done
if [ "$python" = none ]; then
  fail "bpy $version needs Python $needed exactly, and neither python$needed nor python3 ($(python3 --version 2>&1)) is it; say where one is with PYTHON="
fi
if [ "${1:-}" = --system-libraries ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  export DEBIAN_FRONTEND=noninteractive
  # shellcheck disable=SC2086  # a list of words
  problem=$({ apt-get update -qq && apt-get install -y -qq --no-install-recommends $libraries; } 2>&1 >/dev/null) ||
    printf '%s\n' "$problem" >&2
fi
"$python" -m venv $folder || fail "$python cannot make virtual environments; on Debian: apt-get install python3-venv"
"$bin/pip" install --quiet --disable-pip-version-check "bpy==$version.*" pytest ||
  fail "bpy $version (373 MB) could not be installed from the package index, for the reason above"
if ! works; then
  reason=$("$bin/python" -c 'import bpy, pytest' 2>&1 | tail -1) || true
  absent=$(ldd $folder/lib/python$needed/site-packages/bpy/__init__.so 2>/dev/null | awk '/not found/ {print $1}' | sort -u | xargs) || true
  fail "bpy is installed in $folder but does not import: $reason" \
    "system libraries not found: ${absent:-none}; on Debian, as root: apt-get install $libraries"
fi
echo "Blender $version is in $folder"

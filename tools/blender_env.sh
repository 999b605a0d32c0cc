#!/usr/bin/env bash
# An environment with Blender as a Python module, apart from moldline's own: bpy is GPL-3.0, wants
# NumPy 1 and is 800 MB. Only tests and benchmarks that compare with Blender use it, as a process.
#
#   bash tools/blender_env.sh                     make .venv-blender (needs Python 3.11)
#   bash tools/blender_env.sh --system-libraries  first install what bpy needs of Debian (as root)
set -euo pipefail
cd "$(dirname "$0")/.."
libraries="libx11-6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libgl1"
bin=.venv-blender/bin

works() { "$bin/python" -c 'import bpy' >/dev/null 2>&1; }
is_311() { "$1" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' >/dev/null 2>&1; }
fail() { printf '%s\n' "$@" >&2; exit 1; }

if works; then
  echo "Blender is in .venv-blender"
  exit 0
fi
for python in "${PYTHON:-python3.11}" python3.11 python3 none; do
  if is_311 "$python"; then break; fi
done
if [ "$python" = none ]; then
  fail "bpy 4.5 needs Python 3.11 exactly, and neither python3.11 nor python3 ($(python3 --version 2>&1)) is it; say where one is with PYTHON="
fi
if [ "${1:-}" = --system-libraries ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  export DEBIAN_FRONTEND=noninteractive
  # shellcheck disable=SC2086  # a list of words
  problem=$({ apt-get update -qq && apt-get install -y -qq --no-install-recommends $libraries; } 2>&1 >/dev/null) ||
    printf '%s\n' "$problem" >&2
fi
"$python" -m venv .venv-blender || fail "$python cannot make virtual environments; on Debian: apt-get install python3-venv"
"$bin/pip" install --quiet --disable-pip-version-check 'bpy==4.5.*' ||
  fail "bpy 4.5 (373 MB) could not be installed from the package index, for the reason above"
if ! works; then
  reason=$("$bin/python" -c 'import bpy' 2>&1 | tail -1) || true
  absent=$(ldd .venv-blender/lib/python3.11/site-packages/bpy/__init__.so 2>/dev/null | awk '/not found/ {print $1}' | sort -u | xargs) || true
  fail "bpy is installed in .venv-blender but does not import: $reason" \
    "system libraries not found: ${absent:-none}; on Debian, as root: apt-get install $libraries"
fi
echo "Blender is in .venv-blender"

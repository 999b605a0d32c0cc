r"""The tests inside a whole Blender, where that is there and not Blender as a module.

    BLENDER_USER_RESOURCES=$(mktemp -d) PYTEST=SITE-PACKAGES MOLDLINE_PYTHON=PYTHON \
        blender -b --python tests/addon/in_blender.py -- -q tests/addon

SITE-PACKAGES has pytest for Blender's version of Python, PYTHON is of an environment with moldline.
"""

import os
import sys

sys.path.append(os.environ["PYTEST"])
import pytest

code = pytest.main(sys.argv[sys.argv.index("--") + 1 :])
sys.stdout.flush()
os._exit(code)  # Blender would forget it

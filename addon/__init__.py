# SPDX-License-Identifier: GPL-3.0-or-later
"""Moldline in Blender: parameterise shapes by hand, see the exact result live, keep it as a case."""

import importlib
import importlib.util
from types import ModuleType

MODULES = (
    "preferences", "session", "buttons", "project", "files", "case_files", "handles", "following",
    "controls", "variables", "insight", "legend", "panels", "translations",
)  # fmt: skip
"""In the order in which they are registered."""


def _modules() -> list[ModuleType]:
    names = [f"{__package__}.{name}" for name in MODULES]
    return [importlib.import_module(n) for n in names if importlib.util.find_spec(n)]


def register() -> None:
    """Switch the add-on on."""
    for module in _modules():
        module.register()


def unregister() -> None:
    """Switch it off."""
    for module in reversed(_modules()):
        module.unregister()

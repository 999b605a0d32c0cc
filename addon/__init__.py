# SPDX-License-Identifier: GPL-3.0-or-later
"""Moldline in Blender: shapes parameterised by hand, exact results live, kept as a case."""

import importlib
from types import ModuleType

MODULES = (
    "preferences", "session", "buttons", "project", "files", "case_files", "handles", "following",
    "controls", "variables", "insight", "legend", "panels", "menus", "translations",
)  # fmt: skip
"""In the order in which they are registered."""


def _modules() -> list[ModuleType]:
    found = []
    for name in MODULES:
        try:
            found.append(importlib.import_module(f"{__package__}.{name}"))
        except Exception as error:  # while they are being written: some are still to come
            print(f"{name} is left out: {error}")  # noqa: T201
    return found


def register() -> None:
    """Switch the add-on on."""
    for module in _modules():
        module.register()


def unregister() -> None:
    """Switch it off."""
    for module in reversed(_modules()):
        module.unregister()

# SPDX-License-Identifier: GPL-3.0-or-later
"""Moldline in Blender: shapes parameterised by hand, exact results live, kept as a case."""

from . import (
    buttons,
    case_files,
    controls,
    files,
    following,
    handles,
    insight,
    legend,
    menus,
    panels,
    preferences,
    project,
    session,
    translations,
    variables,
)

MODULES = (
    preferences, session, buttons, project, files, case_files, handles, following, controls,
    variables, insight, legend, panels, menus, translations,
)  # fmt: skip
"""In the order in which they are registered."""


def register() -> None:
    """Switch the add-on on."""
    for module in MODULES:
        module.register()


def unregister() -> None:
    """Switch it off."""
    for module in reversed(MODULES):
        module.unregister()

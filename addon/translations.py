# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in other languages; whoever adds one adds a table."""

import bpy

ANY, OPERATOR = "*", "Operator"

GERMAN = {
    (ANY, "Parameterise"): "Parametrisieren",
    (ANY, "Variables"): "Variablen",
    (ANY, "Variable"): "Variable",
    (ANY, "Measures"): "Messwerte",
    (ANY, "Look"): "Ansicht",
    (ANY, "Health"): "Netzprüfung",
    (ANY, "Pipeline"): "Ablauf",
    (ANY, "Sensitivity"): "Empfindlichkeit",
    (ANY, "Bounds"): "Grenzen",
    (ANY, "Unit"): "Einheit",
    (ANY, "Mirrored"): "Gespiegelt",
    (ANY, "Component"): "Bauteil",
    (ANY, "Stations"): "Stationen",
    (ANY, "Sound"): "In Ordnung",
    (ANY, "Of an earlier shape"): "Von einer früheren Form",
    (ANY, "Moves nothing: it has no link"): "Bewegt nichts: keine Verknüpfung",
    (OPERATOR, "New Variable"): "Neue Variable",
    (OPERATOR, "Edit Variable"): "Variable ändern",
    (OPERATOR, "Remove Variable"): "Variable entfernen",
    (OPERATOR, "Reset Values"): "Werte zurücksetzen",
    (OPERATOR, "Add Measure"): "Messwert hinzufügen",
    (OPERATOR, "Check Health"): "Netz prüfen",
    (OPERATOR, "Check"): "Prüfen",
    (OPERATOR, "Check Deeply"): "Gründlich prüfen",
    (OPERATOR, "Lattice"): "Gitter",
    (OPERATOR, "Cage"): "Käfig",
    (OPERATOR, "Wing Skeleton"): "Flügelskelett",
    (OPERATOR, "Body Skeleton"): "Rumpfskelett",
    (OPERATOR, "Open Case"): "Fall öffnen",
    (OPERATOR, "Restart"): "Neu starten",
}

TABLES = {"de_DE": GERMAN}
"""Words by language; Blender's context tells labels from operators."""


def register() -> None:
    """Let Blender know."""
    bpy.app.translations.register(__package__, TABLES)


def unregister() -> None:
    """Take it back."""
    bpy.app.translations.unregister(__package__)

"""What is drawn, with and without a case, in every state of moldline; nothing raises."""

from types import SimpleNamespace

import bpy
import pytest
from bl_ext.user_default.moldline import (
    drawing,
    insight,
    measuring,
    panels,
    project,
    session,
    translations,
    variables,
    view,
)

BLENDERS = {"filepath", "check_existing", "files", "directory"}
CONTAINERS = {"row", "column", "box", "split", "grid_flow", "column_flow"}


class Layout:
    """Stands for Blender's layout: remembers what is drawn, checks that it is there."""

    def __init__(self):
        self.calls = []

    def __getattr__(self, name):
        def call(*given, **named):
            self.calls.append((name, given, named))
            if name == "operator":
                assert hasattr(bpy.types, "MOLDLINE_OT_" + given[0].removeprefix("moldline."))
                return SimpleNamespace()
            if name == "prop":
                assert given[1] in given[0].bl_rna.properties or given[1].startswith('["')
            if name == "menu":
                assert hasattr(bpy.types, given[0])
            if name == "template_list":
                self.draw_rows(*given)
            return self if name in CONTAINERS else None

        return call

    def draw_rows(self, kind, _, data, rows, here, active):
        """Each row of a list."""
        for row in getattr(data, rows):
            getattr(bpy.types, kind).draw_item(
                None, bpy.context, self, data, row, 0, here, active, 0, 0
            )

    def texts(self):
        """What can be read."""
        return [
            str(named.get("text", "")) for name, _, named in self.calls if name in ("label", "prop")
        ]

    def operators(self):
        """What can be pressed."""
        return {given[0] for name, given, _ in self.calls if name == "operator"}


def drawn():
    """What all panels draw; a sentence with the name of an error is a failure."""
    found = {}
    for kind in panels.CLASSES:
        layout = Layout()
        kind.draw(SimpleNamespace(layout=layout), bpy.context)
        assert not [text for text in layout.texts() if "Error:" in text], layout.texts()
        found[kind.__name__] = layout
    return found


@pytest.fixture
def scene(ball_case):
    scene = bpy.context.scene
    project.open_case(scene, ball_case.read_text(), str(ball_case.parent))
    view.sync(scene)
    return scene


@pytest.mark.parametrize("state", ["no environment", "stopped", "starting", "ready", "failed"])
@pytest.mark.parametrize("busy", ["", "opening the case"])
def test_an_empty_scene_says_what_to_do(monkeypatch, state, busy):
    monkeypatch.setattr(session, "state", lambda: state)
    monkeypatch.setattr(session, "sentence", lambda: f"it is so: {state}")
    monkeypatch.setattr(session, "busy", lambda: busy)
    found = drawn()
    assert state in " ".join(found["MOLDLINE_PT_main"].texts())
    main = found["MOLDLINE_PT_main"].operators()
    assert ("moldline.start_server" in main) == (state == "stopped")
    assert ("moldline.restart_server" in main) == (state in ("ready", "failed"))
    assert ("moldline.make_environment" in main) == (state == "no environment")
    assert "add a lattice" in " ".join(found["MOLDLINE_PT_variables"].texts())


def test_a_case_has_lists_sliders_and_readings(scene):
    insight.refresh(scene)
    found = drawn()
    told = found["MOLDLINE_PT_variables"].texts()
    assert "lift" in told and "lift[0]" in told and "lift[1]" in told
    assert "from -1 to 1 m" in told
    assert any("m³ (≥ 1)" in text for text in found["MOLDLINE_PT_measures"].texts())
    assert "box" in str(found["MOLDLINE_PT_parameterise"].calls)
    assert any("result" in text for text in found["MOLDLINE_PT_overview"].texts())
    assert "moldline.show_sensitivity" in found["MOLDLINE_PT_look"].operators()
    bpy.ops.moldline.show_sensitivity()
    bpy.ops.moldline.check_health()
    found = drawn()
    assert any("motion outwards" in text for text in found["MOLDLINE_PT_look"].texts())
    assert "Sound" in found["MOLDLINE_PT_health"].texts()


def test_a_lost_moldline_leaves_all_that_is_known(scene):
    insight.refresh(scene)
    session.stop()
    found = drawn()
    assert "lift[0]" in found["MOLDLINE_PT_variables"].texts()
    assert any("m³" in text for text in found["MOLDLINE_PT_measures"].texts())


def test_a_text_that_is_no_case_is_drawn_as_none(scene):
    scene.moldline.text.from_string("moldline = [[[")
    assert view.is_stale(scene)
    view.sync(scene)
    found = drawn()
    assert not [text for text in found["MOLDLINE_PT_variables"].texts() if "lift" in text]


def test_many_numbers_are_shown_in_part(scene, monkeypatch):
    monkeypatch.setattr(drawing, "MOST_SLIDERS", 1)
    scene.moldline_view.first = 7
    told = drawn()["MOLDLINE_PT_variables"].texts()
    assert "lift[1]" in told and "lift[0]" not in told


def test_readings_of_measures_stay_short():
    table = {"measure": "thickness", "bounds": [[0.1, 0.1], [0.0, float("inf")]], "relative": True}
    told = measuring.lines(table, [0.12, 0.5], [0.02, 0.0])
    assert told == [("0.12 of chord (= 0.1), off by 0.02", True), ("0.5 of chord (≥ 0)", False)]


def test_a_draw_that_fails_is_a_line():
    layout = Layout()
    drawing.safely(lambda layout, context: 1 / 0)(SimpleNamespace(layout=layout), bpy.context)
    assert layout.texts() == ["ZeroDivisionError: division by zero"]


def test_every_operator_and_property_has_a_tooltip():
    operators = [getattr(bpy.ops.moldline, name) for name in dir(bpy.ops.moldline)]
    assert len(operators) > 10
    for operator in operators:
        told = operator.get_rna_type()
        assert told.description and not told.description.endswith("."), told.identifier
        for name, held in told.properties.items():
            if name != "rna_type" and not held.is_hidden:
                is_plain = held.type == "ENUM" or name.startswith("filter_") or name in BLENDERS
                assert held.description or is_plain, f"{told.identifier}.{name}"


def test_what_is_shown_can_be_translated():
    told = bpy.app.translations
    for (context, word), other in translations.GERMAN.items():
        assert other and other.strip() == other and word.strip() == word
        assert context in (told.contexts.default, told.contexts.operator_default)
    view_preferences = bpy.context.preferences.view
    if "de_DE" not in told.locales:
        pytest.skip("this Blender has no translations")
    before = view_preferences.language
    try:
        view_preferences.language = "de_DE"
        assert told.pgettext_iface("Mirrored") == "Gespiegelt"
    finally:
        view_preferences.language = before


def test_units_have_names_for_menus():
    for name, _, _ in variables.UNITS:
        assert variables.unit_choice(variables.unit_text(name)) == name

"""What documents say, and what names in them stand for."""

import pytest
from xddm_documents import CONFIGURATION, DESIGN, FUNCTIONALS, MODEL

from moldline.errors import FileError
from moldline.xddm.document import Document
from moldline.xddm.model import Design
from moldline.xddm.numbers import number, written


def design(text, path=""):
    return Design(Document(text.encode(), "d.xml"), path)


def test_variables_are_read_with_their_namespaces():
    model = design(MODEL, "/Model[@ID='wing']")
    assert [value.name for value in model.variables] == [
        "Model__wing__Variable__span",
        "Model__wing__Variable__sweep",
        "Model__wing__Lattice__sections__Variable__dz[3,1]",
        "Model__wing__Lattice__sections__Deeper__tip__Variable__dz",
    ]
    span, _, dz, unset = model.variables
    assert (span.value, span.lower, span.upper, span.typical, span.step) == (6, 5, 8, 1, 1e-4)
    assert (span.differencing, dz.differencing) == ("oFD", None)
    assert (dz.base, dz.indices, span.base, span.indices) == ("dz", (3, 1), "span", ())
    assert unset.value is None
    assert [value.id for value in model.inputs if not value.is_variable] == ["chord"]
    assert [value.is_required for value in model.analyses] == [True, False]
    assert [(t.body, t.edge, t.sag, t.angle) for t in model.tessellations] == [
        (0, 0.02, 0.001, 12),
        (1, 0.01, 0.0005, 8),
    ]


def test_names_are_found_in_full_in_part_and_by_id():
    model = design(MODEL)
    for name in ("dz[3,1]", "dz[3, 1]", "sections__Variable__dz[3,1]"[len("sections__") :],
                 "Lattice__sections__Variable__dz[3,1]",
                 "Model__wing__Lattice__sections__Variable__dz[3,1]"):  # fmt: skip
        assert model.find(name).indices == (3, 1)
    with pytest.raises(
        FileError, match=r"d.xml: nothing is named 'spam'; it has: Model__wing__Var"
    ):
        model.find("spam")
    with pytest.raises(FileError, match="nothing is named 'unread'"):
        model.find("unread")


def test_a_bare_id_is_the_nearest_and_ambiguous_ones_are_told():
    point = design(DESIGN)
    b = point.points[1].element
    assert point.find("CL", b).name == "Optimize__DesignPoint__B__Analysis__CL"
    assert point.find("DesignPoint__B__Analysis__CL").value == 0.4
    with pytest.raises(FileError, match=r"'CL' may stand for 2 values: Optimize__DesignPoint__A"):
        point.find("CL", point.target)
    inner = design("<M><Variable ID='x' Value='1'/><G ID='g'><Variable ID='x' Value='2'/></G></M>")
    assert inner.find("x", inner.target).value == 1
    assert inner.find("x", inner.target.children[1]).value == 2
    assert inner.find("M__Variable__x").value == 1


def test_a_design_has_points_and_wetted_surfaces():
    whole = design(DESIGN)
    assert whole.intersects[0].id == "wb"
    assert whole.intersects[0].parts == ("wing.xml", "body.xml", "pylon.tri")
    assert [(p.element.id, p.geometry) for p in whole.points] == [("A", "wb"), ("B", "wb")]
    assert [v.id for v in whole.points[0].values] == ["Mach", "alpha", "CL", "CD", "J"]
    volume = whole.find("vol")
    assert (volume.lower, volume.upper) == (0.85, None)  # as Bound says
    assert [v.id for v in design(DESIGN, "//DesignPoint[@ID='B']").values] == [
        "alpha",
        "CL",
        "CD",
        "J",
    ]


def test_configure_wins_over_what_stands_nearer():
    text = "<M ID='m'>{}<G ID='g' Sensitivity='required'>{}</G></M>"
    for switch, own, expected in [
        ("", "", True),
        ("", "Sensitivity='none'", False),
        ("<Configure Sensitivity='None'/>", "Sensitivity='Required'", False),
        ("<Configure Sensitivity='REQUIRED'/>", "Sensitivity='None'", True),
        ("<Configure/>", "Sensitivity='None'", False),
    ]:
        document = text.format(switch, f"<Analysis ID='a' {own}/>")
        assert design(document).analyses[0].is_required is expected
    assert not design("<M><Analysis ID='a'/></M>").analyses[0].is_required
    with pytest.raises(FileError, match="Configure: a second one"):
        _ = design("<M><Configure/><Configure/><Analysis ID='a'/></M>").values


def test_functionals_of_the_flow_are_read_line_by_line():
    found = design(FUNCTIONALS).functionals
    lift, drag = found["Functionals__AeroFun__LplusD"]
    assert (lift.kind, lift.name, lift.line, lift.components) == ("optForce", "CL", 5, ("entire",))
    assert lift.numbers == {
        "force": 2, "frame": 0, "J": 0, "N": 1, "target": 0.0, "weight": 0.1, "bound": 0,
    }  # fmt: skip
    assert (drag.line, drag.components) == (8, ("wing", "body"))
    assert found["Functionals__AeroFun__Pitch"][0].numbers["moment"] == 1
    assert found["Functionals__AeroFun__LoD"][0].numbers["bias"] == 0.001
    assert design(DESIGN).functionals["Optimize__DesignPoint__A__Analysis__CL"][0].name == "CL"


@pytest.mark.parametrize(
    "line, message",
    [
        (
            "optForce CL 2 0 0 1 0. 1. 0",
            "line 2: AeroFun: optForce has 8 words after it, expected at",
        ),
        ("optForce CL x 0 0 1 0. 1. 0 entire", "optForce 'CL': force is 'x', expected a whole"),
        ("optLD L 0 0 1 nan 0 0 1 0 entire", "A is 'nan', expected a number"),
        ("optLD", "optLD has 0 words after it"),
    ],
)
def test_functionals_that_cannot_be_read_are_told(line, message):
    with pytest.raises(FileError, match=message):
        _ = design(f"<F><AeroFun ID='a'>\n{line}\n</AeroFun></F>").functionals


def test_components_have_faces_and_parents():
    wing, body, container = design(CONFIGURATION).components
    assert (wing.name, wing.parent, wing.labels, wing.is_container) == (
        "wing",
        "lifting",
        (1, 3),
        False,
    )
    assert body.labels == (2,)
    assert container.is_container


@pytest.mark.parametrize(
    "text", ["inf", "nan", "1_0", "0x1p3", "1e999", "1,5", "1.5d0", "٣", "--1", "1 2"]
)
def test_numbers_are_finite_decimals(text):
    with pytest.raises(ValueError, match="is no finite decimal number; expected one such as"):
        number(text)


def test_numbers_are_written_in_full_where_they_are_values():
    assert number(" -1.5e-3\n") == -1.5e-3
    assert number("-888888") is number("-8.88888e5") is number(" ") is None
    assert written("Value", 0.1) == "1.00000000000000006e-01"
    assert written("Max", 0.1) == "0.1"
    third = 1 / 3
    assert float(written("value", third)) == third


def test_a_number_that_is_none_is_told_with_its_place():
    with pytest.raises(FileError, match=r"d.xml: line 2: Variable 'x': Max='inf' is no finite"):
        _ = design("<M>\n<Variable ID='x' Value='1' Max='inf'/></M>").values

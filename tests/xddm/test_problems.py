"""Validation: a sentence for each thing that is wrong, with its line."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from xddm_documents import ALL, CONFIGURATION, DESIGN, FUNCTIONALS, MODEL

from moldline.errors import FileError, MoldlineError
from moldline.xddm.chain import evaluated, quantities
from moldline.xddm.document import Document
from moldline.xddm.edit import Draft, Edit
from moldline.xddm.model import Design
from moldline.xddm.problems import findings, problems
from moldline.xddm.results import filled

SPAN = "Model__wing__Variable__span"


@pytest.mark.parametrize("text", ALL.values(), ids=ALL)
def test_sound_documents_have_no_problems(text):
    assert problems(Document(text.encode())) == []


def test_what_is_not_read_is_noted():
    assert findings(Document(MODEL.encode(), "m.xml")).notes == [
        "m.xml: line 16: Foreign: is no element of XDDM and has no ID, so what is in it is not read"
    ]
    notes = findings(Document(DESIGN.encode())).notes
    assert [note.split(": ")[2:4] for note in notes] == [
        [f"Sensitivity '{SPAN}'", f"P='{SPAN}' must be of another document"],
        ["Constraint 'vol'", "Expr"],
    ]


def inside(text, root="M"):
    return problems(Document(f"<{root}>\n{text}\n</{root}>".encode(), "m.xml"))


@pytest.mark.parametrize(
    "text, sentence",
    [
        ("<Variable Value='1'/>", "line 2: Variable: has no ID, expected one; add ID=\"...\""),
        ("<Constant ID='c'/>", "line 2: Constant 'c': has no Value, expected one; add"),
        ("<Variable ID='v' Value='1e'/>", "Value='1e' is no finite decimal number; expected"),
        ("<Variable ID='v' Value='3' Max='2'/>", "Value=3 is above Max=2; change one of them"),
        ("<Variable ID='v' Value='1' Min='2'/>", "Value=1 is below Min=2; change one of them"),
        ("<Variable ID='v' Value='1' Min='2' Max='0'/>", "Min=2 is above Max=0; swap them"),
        ("<Variable ID='v' Value='1' FDstep='0'/>", "FDstep=0, expected a number above zero"),
        ("<Analysis ID='a' Sensitivity='yes'/>", "Sensitivity='yes', expected Required or None"),
        ("<Function ID='f' Expr='1' Bound='Left'/>", "Bound='Left', expected Upper or Lower"),
        ("<Function ID='f'/>", "Function 'f': has no Expr, expected one"),
        ("<Function ID='f' Expr='1+'/>", "Function 'f': Expr: column 3 of '1+': expected a number"),
        ("<Function ID='f' Expr='2*x'/>", "Expr: column 3: 'x' is not in the document; known"),
        ("<Function ID='f' Expr='f'/>", "Expr: circular: M__Function__f -> M__Function__f"),
        (
            "<Analysis ID='a'/><G ID='g'><Analysis ID='a'/></G><H ID='h'><Sum ID='f' Expr='a'/></H>"
            "<G ID='i'><Function ID='a' Expr='1'/></G><H ID='j'><H ID='k'><Sum ID='g' Expr='H__x'/>"
            "</H></H>",
            "'H__x' is not in the document",
        ),
        (
            "<G ID='g'><Analysis ID='a'/></G><G ID='h'><Analysis ID='a'/></G>"
            "<Sum ID='f' Expr='a'/>",
            "Expr: column 1: 'a' may stand for 2 values: M__G__g__Analysis__a (line 2), M",
        ),
        (
            "<Analysis ID='a'><SensitivityArray><Sensitivity P='b' Value='1'/></SensitivityArray>"
            "</Analysis>",
            "P='b' is not in the document; known are: M__Analysis__a",
        ),
        (
            "<Analysis ID='a'><SensitivityArray><Sensitivity P='a' Value='1'/></SensitivityArray>"
            "</Analysis>",
            "P='a' names the Analysis 'a', expected a Variable",
        ),
        (
            "<Variable ID='v' Value='1'/><Analysis ID='a'><SensitivityArray><Sensitivity P='v' "
            "Value='1'/>\n<Sensitivity P='v' Value='x'/></SensitivityArray></Analysis>",
            "line 3: Sensitivity 'v': a second one for it (the first is in line 2)",
        ),
        ("<Analysis ID='a'><AeroFun/><AeroFun/></Analysis>", "a second one within Analysis 'a'"),
        ("<Analysis ID='a'/>\n<Analysis ID='a'/>", "line 3: Analysis 'a': the full name"),
        ("<Configure/>\n<Configure/>", "line 3: Configure: a second one (the first is in line 2)"),
        ("<AeroFun ID='a'>\noptForce CL\n</AeroFun>", "line 3: AeroFun: optForce has 1 words"),
        ("<Tessellate MaxEdge='-1'/>", "MaxEdge=-1, expected a number above zero"),
        ("<Tessellate ID='x'/>", "the ID must be the number of a body"),
        ("<Tessellate/>\n<Tessellate/>", "Tessellate: a second one for the same, as in"),
        ("<Intersect ID='a'/>", "Intersect 'a': has no Parts"),
        (
            "<Intersect ID='a' Parts='b.tri'/><DesignPoint ID='p' Geometry='c'/>",
            "Geometry='c', expected the ID of an Intersect: a",
        ),
        ("<Component Name='a' Type='tria'/>", "Type='tria', expected tri or container"),
        ("<Component Name='a' Type='tri' Parent='b'/>", "Parent='b', expected the Name of another"),
    ],
)  # fmt: skip
def test_each_problem_is_told(text, sentence):
    found = inside(text)
    assert any(sentence in one for one in found), found
    assert all(one.startswith("m.xml: line ") for one in found)


def test_all_problems_are_told_once_in_order():
    found = inside(
        "<Variable ID='v' Value='x' Min='nan'/>\n<Tessellate Sag='y'/>\n"
        "<Function ID='f' Expr='v*('/>"
    )
    assert [one.split(": ")[1] for one in found] == ["line 2", "line 2", "line 3", "line 4"]


def test_long_values_and_unknown_functionals_are_noted():
    long = "x" * 5000
    text = (
        f"<M a='{long}'><AeroFun ID='a'>optBoom x 1</AeroFun><Analysis ID='b'><Odd/></Analysis></M>"
    )
    notes = " ".join(findings(Document(text.encode())).notes)
    assert "a has 5000 characters; others may read 4096" in notes
    assert "the kind 'optBoom' in line 1 is not known" in notes
    assert "Odd: is not read within Analysis 'b'" in notes


BRIEF = [MODEL, DESIGN, FUNCTIONALS, CONFIGURATION]
PIECES = [b"<", b">", b"/>", b'"', b"&", b"\0", b"\xff", b"nan", b"<!--", b"]]>", b"<![CDATA[",
          b"--", b"<Variable ID='x'/>", b"<!DOCTYPE a>", b"&#0;", b"&lt;", b"1e999", b"(", b"__",
          b"\r", b"[", b"ID='wing'", b"Expr='J^'", b"</Model>", b"\xc3\xa9"]  # fmt: skip


def all_said(data):
    """Ask a document for all it can say, and change it."""
    document = Document(data, "m.xml")
    findings(document)
    edit = Edit()
    for element in document.root.descendants():
        edit.set(element, "Value", "<é\">'&")
        edit.add(element, Draft("New"))
    changed = document.edited(edit)
    assert all(e.get("value") == "<é\">'&" for e in changed.root.descendants() if e.tag != "New")
    assert document.data == data
    design = Design(document)
    _ = design.points, design.intersects, design.components, design.tessellations
    _ = design.functionals
    results = quantities(design) | evaluated(design)
    assert quantities(Design(filled(design, results))).keys() == quantities(design).keys()


@settings(max_examples=120, deadline=None)
@given(
    st.sampled_from(BRIEF),
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 12), st.sampled_from(PIECES)), max_size=4),
    st.floats(0.0, 2.0),
)
def test_damaged_documents_are_understood_or_refused(text, damage, cut):
    data = text.encode()
    for place, gone, piece in damage:
        start = int(place * len(data))
        data = data[:start] + piece + data[start + gone :]
    data = data[: int(cut * len(data)) + 1] if cut < 1 else data
    try:
        all_said(data)
    except MoldlineError as problem:
        assert isinstance(problem, FileError), problem
        assert str(problem).startswith("m.xml: ")


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=60))
def test_any_bytes_are_read_or_refused(data):
    with pytest.raises(FileError, match=r"^m.xml: "):
        Document(data, "m.xml")

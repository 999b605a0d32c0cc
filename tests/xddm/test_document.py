"""XDDM documents: unchanged ones to the byte, changed ones but for the change."""

import difflib

import pytest
from xddm_documents import ALL, DESIGN, MODEL

from moldline.errors import FileError, ParameterError
from moldline.xddm import document, reading
from moldline.xddm.document import Document
from moldline.xddm.edit import Draft, Edit


def test_an_element_knows_its_place():
    model = Document(MODEL.encode(), "wing.xml")
    span = model.by_name["Model__wing__Variable__span"]
    assert (span.line, span.tag, span.parent) == (4, "Variable", model.root)
    assert span.get("VALUE") == span.get("Value") == "6.0"
    assert span.spelling("max") == "MAX"
    assert list(span.attributes)[:3] == ["ID", "value", "Min"]
    assert "Model__wing__Lattice__sections__Variable__dz[3,1]" in model.by_name
    assert model.place(span) == "wing.xml: line 4: Variable 'span'"


@pytest.mark.parametrize("text", ALL.values(), ids=ALL)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_an_unchanged_document_is_the_same_to_the_byte(tmp_path, text, newline):
    data = text.replace("\n", newline).encode()
    (tmp_path / "in.xml").write_bytes(data)
    read = document.read(tmp_path / "in.xml")
    read.edited(Edit()).save(tmp_path / "out.xml")
    assert (tmp_path / "out.xml").read_bytes() == data
    edit = Edit()
    for element in read.root.descendants():
        for name, value in element.attributes.items():
            edit.set(element, name.swapcase(), value)
    assert read.edited(edit) is read  # what is as it was keeps its quotes and references


@pytest.mark.parametrize(
    "head, codec",
    [
        ("", "utf-8"),
        ('<?xml version="1.0" encoding="ISO-8859-1"?>', "latin-1"),
        ("<?xml version='1.0'  encoding = 'windows-1252' standalone='yes' ?>", "cp1252"),
        ('<?xml version="1.0"?>', "utf-8-sig"),
        ('<?xml version="1.0" encoding="UTF-16"?>', "utf-16"),
    ],
)
def test_every_encoding_survives_a_change(head, codec):
    text = (
        f'{head}\r\n<Model ID="Flügel">\r\n  <!-- für é -->\r\n  <V a="ü" b="1"/>\r\n</Model>\r\n'
    )
    text = text if head else text.lstrip()
    read = Document(text.encode(codec))
    assert read.root.id == "Flügel"
    changed = read.with_attribute(read.root.children[0], "b", "ä2")
    assert changed.data == text.replace('b="1"', 'b="ä2"').encode(codec)


def test_letters_that_an_encoding_lacks_become_references():
    read = Document(b'<?xml version="1.0" encoding="US-ASCII"?><M ID="a"/>')
    changed = read.with_attribute(read.root, "ID", "Höhe Ω")
    assert changed.data.endswith(b'<M ID="H&#246;he &#937;"/>')
    assert changed.root.id == "Höhe Ω"


def test_a_changed_value_is_all_that_changes():
    read = Document(MODEL.encode())
    edit = Edit()
    edit.set_number(read.by_name["Model__wing__Variable__sweep"], "value", 25.0)  # as it is
    edit.set_number(read.by_name["Model__wing__Variable__span"], "Value", 6.5)
    edit.set(read.by_name["Model__wing__Variable__sweep"], "Max", "it's <\"&\n")
    changed = read.edited(edit)
    expected = MODEL.replace('value="6.0"', 'value="6.50000000000000000e+00"').replace(
        "Max='40'", "Max='it&apos;s &lt;\"&amp;&#10;'"
    )
    assert changed.data.decode() == expected
    assert changed.by_name["Model__wing__Variable__sweep"].get("Max") == "it's <\"&\n"


def test_attributes_are_added_last_and_removed_alone():
    read = Document(b"<M  ID='x'\n  a = \"1\" b='2' ><N/><O /></M>")
    edit = Edit()
    edit.set(read.root, "A", None)
    edit.set(read.root, "c", "3")
    edit.set(read.root.children[0], "d", "4")
    edit.set(read.root.children[1], "d", "5")
    assert read.edited(edit).data == b'<M  ID=\'x\' b=\'2\' c="3" ><N d="4"/><O d="5" /></M>'


def test_added_elements_are_indented_as_their_brothers_are():
    read = Document(MODEL.encode())
    edit = Edit()
    array = Draft("SensitivityArray", children=[Draft("Sensitivity", {"P": "a", "Value": "1"})])
    for name in ("Volume", "Thickness"):
        edit.add(read.by_name[f"Model__wing__Analysis__{name}"], array)
    edit.add(read.root, Draft("Analysis", {"ID": "Area"}, text="1 < 2"))
    edit.add(read.root, Draft("Analysis", {"ID": "Mass"}))
    edit.add(read.by_name["Model__wing__Lattice__sections__Deeper__tip"], Draft("Constant"))
    changed = read.edited(edit)
    added = [
        line[2:]
        for line in difflib.ndiff(MODEL.splitlines(), changed.data.decode().splitlines())
        if line.startswith("+ ")
    ]
    assert added == [
        '    <Deeper ID="tip"><Variable ID="dz" Value="-888888"/><Constant/></Deeper>',
        '  <Analysis ID="Volume" Sensitivity="required">',
        "    <SensitivityArray>",
        '      <Sensitivity P="a" Value="1"/>',
        "    </SensitivityArray>",
        "  </Analysis>",
        '  <Analysis ID="Thickness" Sensitivity="None">',
        "    <SensitivityArray>",
        '      <Sensitivity P="a" Value="1"/>',
        "    </SensitivityArray>",
        "  </Analysis>",
        '  <Analysis ID="Area">1 &lt; 2</Analysis>',
        '  <Analysis ID="Mass"/>',
    ]


def test_removed_elements_take_their_lines_with_them():
    read = Document(MODEL.replace("\n", "\r\n").encode())
    edit = Edit()
    for name in ("Variable__span", "Variable__sweep", "Lattice__sections__Deeper__tip"):
        edit.remove(read.by_name[f"Model__wing__{name}"])
    inside = read.by_name["Model__wing__Lattice__sections__Deeper__tip__Variable__dz"]
    edit.set(inside, "Value", "1")  # goes with what is around it
    edit.add(inside, Draft("Constant"))
    edit.add(read.root, Draft("Analysis", {"ID": "Area"}))
    lines = read.edited(edit).data.decode().split("\r\n")
    kept = [line for i, line in enumerate(MODEL.split("\n")) if i not in (3, 4, 8)]
    kept.insert(-2, '  <Analysis ID="Area"/>')
    assert lines == kept


def test_a_new_document_reads_back():
    draft = Draft(
        "Model",
        {"ID": "b", "Note": 'a "b" <\x85 &'},
        [Draft("Variable", {"ID": "x", "Value": "1"}), Draft("AeroFun", text="# a\noptLD")],
    )
    new = document.made(draft, "new.xml")
    assert new.data.startswith(b'<?xml version="1.0" encoding="ISO-8859-1"?>\n<Model ID="b"')
    assert new.root.get("note") == 'a "b" <\x85 &'
    assert new.data.endswith(
        b'\n  <Variable ID="x" Value="1"/>\n  <AeroFun># a\noptLD</AeroFun>\n</Model>\n'
    )


def test_an_edit_refuses_what_no_document_can_hold():
    read, other = Document(b"<M/>"), Document(b"<M><N/></M>")
    edit = Edit()
    with pytest.raises(ParameterError, match=r"'a b' cannot name"):
        edit.set(read.root, "a b", "1")
    with pytest.raises(ParameterError, match=r"'\\x00' holds '\\x00', which XML cannot hold"):
        edit.set(read.root, "a", "\0")
    with pytest.raises(ParameterError, match="Value is nan, expected a finite number"):
        edit.set_number(read.root, "Value", float("nan"))
    with pytest.raises(ParameterError, match="the whole document"):
        edit.remove(read.root)
    edit.set(other.root.children[0], "a", "1")
    with pytest.raises(ParameterError, match="N is of another document"):
        read.edited(edit)


LAUGHS = b'<?xml version="1.0"?>\n<!DOCTYPE M [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]>\n<M>&b;</M>'
OUTSIDE = b'<!DOCTYPE M [<!ENTITY x SYSTEM "file:///etc/passwd">]><M>&x;</M>'


@pytest.mark.parametrize(
    "data, message",
    [
        (LAUGHS, r"m.xml: line 2: found a document type \(DOCTYPE\).*remove it"),
        (OUTSIDE, "line 1: found a document type"),
        (b'<!DOCTYPE M SYSTEM "http://a/b.dtd"><M/>', "line 1: found a document type"),
        (b"<M>&unknown;</M>", "line 1, column 4: undefined entity"),
        (b"<M>" * 33 + b"</M>" * 33, "line 1: more than 32 elements within each other"),
        (b'<M a="' + b"x" * 65537 + b'"/>', "M: a has 65537 characters, expected at most 65536"),
        (
            b"<M " + b" ".join(b'a%d="1"' % i for i in range(257)) + b"/>",
            "more than 256 attributes",
        ),
        (DESIGN[:700].encode(), r"line \d+, column \d+: .*was the copy cut short\?"),
        (b"<M>\n", "no element found, expected XML; was the copy cut short"),
        (b"hello", "line 1, column 1: .*expected XML"),
        (b"<M><N></M>", "mismatched tag"),
        (b"<M/><N/>", "junk after document element"),
        (b'<M a="1" a="2"/>', "duplicate attribute"),
        (b'<M Value="1" value="2"/>', "'Value' and 'value' are one attribute"),
        (b"<M>\n\0</M>", "line 2: holds a NUL character"),
        (b"<\0M\0/\0>\0", "line 1: holds a NUL"),
        (b'<M a="\xe9"/>', r"line 1: byte 0xe9 is no UTF-8; write the encoding"),
        (b'<?xml version="1.0" encoding="EBCDIC-X"?><M/>', "the encoding is 'EBCDIC-X', expected"),
        (b'<?xml version="1.0" encoding="UTF-16"?><M/>', "declares UTF-16 but does not begin so"),
        (b'\xef\xbb\xbf<?xml version="1.0" encoding="latin1"?><M/>', "begins as UTF-8 does but"),
        (b"\xff\xfe<\0M", "UTF-16"),
        (b"", "no element found"),
    ],
)
def test_attacks_and_accidents_are_told(data, message):
    with pytest.raises(FileError, match=message):
        Document(data, "m.xml")


def test_too_large_a_file_is_refused_unread(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "LARGEST", 10)
    (tmp_path / "m.xml").write_text("<Model></Model>")
    with pytest.raises(FileError, match="15 bytes, expected at most 10"):
        document.read(tmp_path / "m.xml")
    with pytest.raises(FileError, match="15 bytes"):
        Document(b"<Model></Model>")
    monkeypatch.setattr(reading, "LARGEST", 100)
    monkeypatch.setattr(reading, "MOST", 1)
    with pytest.raises(FileError, match="more than 1 elements"):
        Document(b"<M><N/></M>")


def test_a_missing_file_is_told(tmp_path):
    for name in ("none.xml", "a\0b.xml", "x" * 300):
        with pytest.raises(FileError):
            document.read(tmp_path / name)


def test_a_failing_save_leaves_the_old_file(tmp_path):
    (tmp_path / "m.xml").mkdir()
    with pytest.raises(FileError, match="is a folder"):
        Document(b"<M/>").save(tmp_path / "m.xml")
    assert list(tmp_path.iterdir()) == [tmp_path / "m.xml"]

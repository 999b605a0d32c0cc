"""XPaths: one element, or an error that says why not."""

import pytest
from xddm_documents import DESIGN, MODEL

from moldline.errors import FileError, ParameterError
from moldline.xddm.document import Document
from moldline.xddm.xpath import chosen, matches


@pytest.mark.parametrize(
    "path, name",
    [
        ("", "Optimize"),
        ("/Optimize", "Optimize"),
        ("Optimize", "Optimize"),
        ("/*", "Optimize"),
        ("/Optimize/DesignPoint[@ID='A']", "Optimize__DesignPoint__A"),
        ('//DesignPoint[ @id = "B" ]', "Optimize__DesignPoint__B"),
        ("/Optimize/DesignPoint[2]", "Optimize__DesignPoint__B"),
        ("//DesignPoint[@ID][@Geometry='wb'][1]/Function", "Optimize__DesignPoint__A__Function__J"),
        ("//Constraint", "Optimize__Constraint__vol"),
        ("/Optimize//Constant", "Optimize__DesignPoint__A__Constant__Mach"),
    ],
)
def test_a_path_chooses_one_element(path, name):
    assert chosen(Document(DESIGN.encode()), path).full_name == name


def test_paths_that_match_none_or_several_are_told():
    document = Document(DESIGN.encode(), "d.xml")
    with pytest.raises(
        FileError, match=r"d.xml: no element matches '/Model'; the first one is Opt"
    ):
        chosen(document, "/Model")
    with pytest.raises(FileError, match=r"2 elements match '//Function' \(Function 'J' in line 24"):
        chosen(document, "//Function")


OTHER = ["/", "//", "/a/", "/a[", "/a[x]", "/a[@b=c]", "/a b", "a|b", "/a[0]", "/@ID"]


@pytest.mark.parametrize("path", [*OTHER, "/" + "a/" * 600 + "a"])
def test_other_paths_are_refused(path):
    with pytest.raises(ParameterError, match="cannot be read from"):
        chosen(Document(MODEL.encode()), path)


def test_nested_matches_come_once_in_order():
    root = Document(b"<a><a><a><b/></a></a><b/></a>").root
    assert [e.start for e in matches(root, "//a//b")] == [9, 21]
    assert len(matches(root, "//a//a")) == 2
    assert len(matches(root, "//" + "//".join("*" * 5))) == 0

"""Cart3D's extended triangulations."""

import jax
import numpy as np
import pytest
from conftest import same_bits
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import geometry

from moldline.errors import FileError, ParameterError
from moldline.mesh import io
from moldline.mesh.io import tri, trix
from moldline.mesh.surface import Surface

PIECE = """\
<Piece Name="{name}" NumberOfPoints="3" NumberOfCells="2">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
 0.0 0.0 0.0
 1.0 0.0 0.0
 0.0 3.33333333333333315e-01 0.0
</DataArray></Points>
<Cells>
<DataArray type="Int32" Name="connectivity" format="ascii"> 0 1 2 0 2 1</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii"> 3 6</DataArray>
<DataArray type="UInt32" Name="types" format="ascii"> 5 5</DataArray>
</Cells>
<CellData>
<DataArray Name="IntersectComponents" NumberOfComponents="1" type="Int16"
 format="ascii" TRIXtype="COMPONENT_TAG">
 {tags}
</DataArray>
<DataArray Name="GMPtags" NumberOfComponents="1" type="Int16"
 format="ascii" TRIXtype="COMPONENT_TAG">
 {patches}
</DataArray>
</CellData>
{data}</Piece>
"""

SPAN = """\
<PointData><DataArray Name="span" NumberOfComponents="3" type="Float64"
 TRIXtype="SHAPE_LINEARIZATION" format="ascii">
 0.0 0.0 0.0 0.0 0.0 0.0 0.0 1.0e+00 -0.0
</DataArray></PointData>
"""


def piece(name="wing", tags="1 1", patches="1 1", data=SPAN):
    return PIECE.format(name=name, tags=tags, patches=patches, data=data)


def file(*pieces):
    return (
        '<?xml version="1.0" encoding="ISO-8859-1"?>\n<VTKFile type="UnstructuredGrid" '
        f'version="0.1">\n<UnstructuredGrid>\n{"".join(pieces)}</UnstructuredGrid>\n</VTKFile>\n'
    )


def read(tmp_path, content):
    path = tmp_path / "Components.i.tri"
    path.write_text(content, "latin-1")
    assert io.found(path) is trix
    return trix.read_marked(path)


def same(one, other):
    assert jax.tree.structure(one) == jax.tree.structure(other)
    assert all(map(same_bits, jax.tree.leaves(one), jax.tree.leaves(other)))


def two_parts(joined=False):
    """Two components of two triangles; they share points if they are joined."""
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]) - 2 * joined * np.array(
        [[0], [0], [1], [1]]
    )
    points = np.random.default_rng(3).standard_normal((8 - 2 * joined, 3))
    data = {"dz[3,1]": points / 3, "Cp": points[:, 0].copy(), "small": points.astype("f4")}
    areas = {"area": np.arange(4) / 7, "GMPtags": np.array([4, 5, 6, 7], np.int16)}
    return Surface(points, faces, [1, 1, 0, 0], ("körper", "wing & <body>"), data, areas)


def test_a_piece_is_a_component_by_its_name(tmp_path):
    surface, marked = read(tmp_path, file(piece("wing"), piece("körper", "2 2", "7 8")))
    assert surface.components == ("wing", "körper")
    assert surface.tags.tolist() == [0, 0, 1, 1]
    assert surface.faces.tolist() == [[0, 1, 2], [0, 2, 1], [3, 4, 5], [3, 5, 4]]
    assert marked == ("span",)
    assert surface.point_data["span"][[2, 5]].tolist() == [[0, 1, 0], [0, 1, 0]]
    assert np.signbit(surface.point_data["span"][5, 2])


def test_patches_are_kept_where_they_differ_from_components(tmp_path):
    surface, _ = read(tmp_path, file(piece(patches="7 8")))
    assert surface.face_data["GMPtags"].tolist() == [7, 8]
    assert "GMPtags" not in read(tmp_path, file(piece()))[0].face_data


def test_numbers_in_one_piece_are_components(tmp_path):
    assert read(tmp_path, file(piece(tags="7 3")))[0].components == ("3", "7")
    surface, _ = read(tmp_path, file(piece("a", "2 1"), piece("b", "2 2")))
    assert surface.components == ("a:1", "a:2", "b")
    assert surface.tags.tolist() == [1, 0, 2, 2]


def test_a_piece_without_a_derivative_does_not_move(tmp_path):
    surface, _ = read(tmp_path, file(piece("a"), piece("b", data="")))
    assert surface.point_data["span"].shape == (6, 3)
    assert not surface.point_data["span"][3:].any()


def test_other_vectors_are_not_taken_for_derivatives(tmp_path):
    velocity = SPAN.replace("SHAPE_LINEARIZATION", "FLOW_VARIABLE").replace("span", "velocity")
    surface, marked = read(tmp_path, file(piece(data=SPAN + velocity)))
    assert marked == ("span",)
    assert set(surface.point_data) == {"span", "velocity"}
    trix.write(tmp_path / "a.trix", surface, linearizations=marked)
    assert trix.read_marked(tmp_path / "a.trix")[1] == ("span",)


@pytest.mark.parametrize("joined", [False, True])
def test_what_is_written_reads_back_to_the_bit(tmp_path, joined):
    surface = two_parts(joined)
    trix.write(tmp_path / "a.trix", surface)
    again, marked = trix.read_marked(tmp_path / "a.trix")
    same(again, surface)
    assert marked == ("dz[3,1]", "small")
    text = (tmp_path / "a.trix").read_text()
    assert text.count("<Piece ") == (1 if joined else 2)
    assert 'type="Int16" Name="IntersectComponents"' in text


def test_other_readers_find_the_components_without_our_names(tmp_path):
    trix.write(tmp_path / "a.trix", two_parts())
    text = (tmp_path / "a.trix").read_text()
    bare = text[: text.index("<FieldData>")] + text[text.index("</UnstructuredGrid>") :]
    surface, _ = read(tmp_path, bare.replace("ö", "o"))
    assert surface.components == ("wing & <body>", "korper")
    assert surface.tags.tolist() == [0, 0, 1, 1]


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(seed=st.integers(0, 2**32))
def test_random_surfaces_read_back_to_the_bit(tmp_path_factory, seed):
    surface, rng = geometry(Surface, seed), np.random.default_rng(seed)
    order = rng.permutation(len(surface.faces))
    names = (*surface.components, "a", "a")[rng.integers(0, 3) :]
    tags = rng.integers(0, len(names), len(order))
    mixed = Surface(surface.points, surface.faces[order], tags, names, surface.point_data)
    path = tmp_path_factory.getbasetemp() / "random.trix"
    trix.write(path, mixed)
    same(trix.read(path), mixed)


def test_a_name_of_cart3d_holds_it_too(tmp_path):
    path = tmp_path / "Components.i.tri"
    io.write(path, two_parts(), format="trix")
    same(io.read(path), two_parts())
    with pytest.raises(FileError, match="line 1: found '<\\?xml', expected a number"):
        tri.read(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("> 5 5<", "> 5 9<", "line 4: Piece 'wing' has cells of VTK's type 9, expected triangles"),
        ("> 5 5<", "> 5<", "'types': 1 numbers, expected 2"),
        ("> 5 5<", "> 5 nan<", "'types': holds 'nan', which is no UInt32"),
        ("> 3 6<", "> 3 5<", "'offsets': offsets must rise by 1 or more, up to the 6 entries"),
        ("> 3 6<", "> inf -inf<", "'offsets': holds 'inf', which is no Int32"),
        ("0 2 1<", "0 2 3<", "'connectivity', entry 6, refers to 3, expected .* from 0 to 2"),
        (' 1 1\n</DataArray>\n<DataArray Name="GMP', ' 1.5 1\n</DataArray><DataArray Name="GMP',
         "'IntersectComponents': holds '1.5', which is no Int16"),
        (' 1 1\n</DataArray>\n<DataArray Name="GMP', ' 1 70000\n</DataArray><DataArray Name="GMP',
         "'IntersectComponents': holds '70000', which is no Int16"),
        ('Points="3"', 'Points="999999999999999"', "9 numbers, expected 999999999999999 times 3"),
        ('Cells="2"', 'Cells="999999999999999"', "2 numbers, expected 999999999999999 times 1"),
        ('span" NumberOfComponents="3"', 'span" NumberOfComponents="9"', "9 numbers, expected 3 t"),
        ('span" NumberOfComponents="3"', 'span" NumberOfComponents="1"', "9 numbers, expected 3 t"),
        ("<VTKFile", '<!DOCTYPE a [<!ENTITY b "c">]><VTKFile', "line 2: found a document type"),
        ("<Points>", "<Dots>" * 99, "more than 32 elements within each other"),
        ("Name=\"connectivity", "Name=\"c", "Cells need the arrays connectivity and offsets"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_place(tmp_path, old, new, message):
    whole = file(piece())
    assert old in whole
    with pytest.raises(FileError, match=message):
        read(tmp_path, whole.replace(old, new, 1))


def test_derivatives_need_three_numbers_per_point(tmp_path):
    scalar = SPAN.replace('Components="3"', 'Components="1"')[: SPAN.index("\n 0.0") + 1]
    with pytest.raises(FileError, match="derivatives 'span' need three numbers per point"):
        read(tmp_path, file(piece(data=scalar + " 1 2 3</DataArray></PointData>")))


def test_pieces_that_disagree_are_named(tmp_path):
    flow = SPAN.replace("SHAPE_LINEARIZATION", "OTHER")
    scalar = flow.replace('Components="3"', 'Components="1"')[: flow.index("\n 0.0") + 1]
    scalar += " 1 2 3</DataArray></PointData>"
    with pytest.raises(FileError, match="the pieces' data 'span' differ in NumberOfComponents"):
        read(tmp_path, file(piece("a", data=flow), piece("b", data=scalar)))


def test_a_number_without_a_name_is_refused(tmp_path):
    trix.write(tmp_path / "a.trix", two_parts())
    text = (tmp_path / "a.trix").read_text().replace(">\n2\n2\n<", ">\n2\n9\n<")
    with pytest.raises(FileError, match="triangle 1 is of the component 9, expected one of the 2"):
        read(tmp_path, text.replace("ö", "o"))


def test_a_file_cut_short_anywhere_is_refused(tmp_path):
    whole = file(piece("a"), piece("b", "2 2")).rstrip().encode()
    path = tmp_path / "a.trix"
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        with pytest.raises(FileError):
            trix.read(path)


def test_many_components_are_read_again(tmp_path):
    count = 2_000
    faces = np.arange(3 * count).reshape(-1, 3)
    names = tuple(f"part {k}" for k in range(count))
    surface = Surface(np.random.default_rng(2).random((3 * count, 3)), faces, range(count), names)
    trix.write(tmp_path / "a.trix", surface)
    same(trix.read(tmp_path / "a.trix"), surface)


def test_more_components_than_trix_counts_are_refused(tmp_path):
    names = tuple(f"part {k}" for k in range(2**15))
    surface = Surface(np.eye(3), [[0, 1, 2]], [0], names)
    with pytest.raises(FileError, match="32768 components, but trix counts only 32767"):
        trix.write(tmp_path / "a.trix", surface)
    assert not list(tmp_path.iterdir())


def test_only_vectors_can_be_derivatives(tmp_path):
    for name in ("Cp", "nothing"):
        with pytest.raises(ParameterError, match=f"no point data of three floats named '{name}'"):
            trix.write(tmp_path / "a.trix", two_parts(), linearizations=[name])


def test_whole_numbers_that_no_float_holds_are_exact(tmp_path):
    large = np.array([2**63 - 1, -(2**63), 2**53 + 1, 7])
    data = {"i": large, "u": large.astype(np.uint64)}
    surface = Surface(np.eye(3), [[0, 1, 2]] * 4, face_data=data)
    trix.write(tmp_path / "a.trix", surface)
    same(trix.read(tmp_path / "a.trix"), surface)

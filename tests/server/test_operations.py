"""What a worker answers, without a server around it."""

import numpy as np
import pytest
from servers import CASE

import moldline as ml
from moldline.server import operations, protocol
from moldline.server.held import opened
from moldline.server.live import Live, shape_of
from moldline.server.protocol import Message, ServerError

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
TRIANGLES = [half for a, b, c, d in SIDES for half in ((a, b, c), (a, c, d))]

JOINED = """\
moldline = 1

[geometry.body]
file = "body.tri"

[geometry.wing]
file = "wing.tri"

[variable.shift]
bounds = [-5.0, 5.0]

[[stage]]
name = "where"
deformer = "lattice"
on = "wing"
shape = [2, 2, 2]
margin = [0.1, 0.1, 0.1]

[[stage.link]]
variable = "shift"
link = "group"
axis = "x"

[[stage]]
name = "union"
modeler = "union"
of = ["body", "wing"]
to = "all"
"""


@pytest.fixture(scope="module")
def joined(tmp_path_factory):
    """A wing through a body, which may be shifted until it stands in its other half."""
    folder = tmp_path_factory.mktemp("joined")
    body, wing = CUBE * [4, 1, 1], CUBE * [0.5, 3, 0.2] + [0.3, 0.4, 0.3]
    ml.write(folder / "body.tri", ml.Surface(body, TRIANGLES))
    ml.write(folder / "wing.tri", ml.Surface(wing, TRIANGLES))
    (folder / "case.toml").write_text(JOINED)
    return opened({"path": str(folder / "case.toml")})


def asked(held, op, arrays=None, **fields):
    """The answer of a worker."""
    return operations.OPERATIONS[op](held, Message({"id": 1, "case": "c", **fields}, arrays or {}))


def test_every_operation_of_a_case_is_passed_on_to_it():
    own = {"describe", "forget", "ping"}
    assert {*operations.OPERATIONS} - own == {*protocol.ASKED_OF_CASE}


def test_a_union_that_is_made_anew_is_told_with_its_triangles(joined):
    told = asked(joined, "describe")
    first = told.header["connectivity"]
    assert told.header["result"] == "all" and told.header["components"]
    same = shape_of(asked(joined, "points", connectivity=first, values={"shift": 0.01}))
    assert same.faces is None and not same.is_made_anew and same.connectivity == first
    anew = shape_of(asked(joined, "points", connectivity=first, values={"shift": 3.0}))
    assert anew.is_made_anew and anew.connectivity != first
    want = joined.case.pipeline({"shift": [3.0]})
    np.testing.assert_array_equal(anew.faces, want.faces)
    np.testing.assert_array_equal(anew.points, want.points)
    assert anew.components == list(want.components) and len(anew.tags) == len(want.faces)
    known = asked(joined, "points", connectivity=anew.connectivity, values={"shift": 3.0})
    assert shape_of(known).faces is None


class Near:
    """A case that answers here, a request behind."""

    def __init__(self, held):
        self._held = held
        told = asked(held, "describe")
        self.points_at_rest, faces, tags = (told.arrays[k] for k in ("points", "faces", "tags"))
        self.joining = faces, tags, told.header["components"]
        self.connectivity = told.header["connectivity"]
        self._asked = []

    def send(self, op, arrays=None, **fields):
        self._asked.append(asked(self._held, op, arrays, **fields))
        return len(self._asked) - 1

    def taken(self, number):
        return self._asked[number] if number < len(self._asked) - 1 or number % 3 == 0 else None

    def sleep(self, seconds):
        self._asked.append(self._asked[-1])


def test_a_drag_across_other_triangles_shows_those_of_its_points(joined):
    near = Near(joined)
    live, faces = Live(near, "", "<f8"), near.joining[0]
    for shift in (0.0, 0.01, 3.0, 3.01, 0.0, 3.0, 0.02, 0.0, 3.0):
        live.push({"shift": shift})
        shape = live.poll()
        if shape is not None:
            faces = faces if shape.faces is None else shape.faces
            assert faces.max() == len(shape.points) - 1
    shape = live.finish()
    faces = faces if shape.faces is None else shape.faces
    np.testing.assert_array_equal(faces, joined.case.pipeline({"shift": [3.0]}).faces)


def test_a_rider_and_another_geometry_are_asked_for_by_name(joined, tmp_path, ball):
    ml.write(tmp_path / "ball.tri", ball)
    rider = '\n[rider.flow]\nfile = "ball.tri"\non = "ball"\n'
    held = opened({"text": CASE + rider, "folder": str(tmp_path)})
    values, flow = {"lift": [0.2, 0.1]}, held.case.riders["flow"]
    assert asked(held, "describe").header["riders"]["flow"]["points"] == len(ball.points)
    moved = asked(held, "points", of="flow", values=values).arrays["points"]
    np.testing.assert_array_equal(moved, flow.points(values))
    rest = asked(held, "points", of="flow", values=values, rest=True).arrays["points"]
    np.testing.assert_array_equal(rest, flow.geometry.points)
    gradient = asked(held, "pullback", {"cotangent": rest}, of="flow", values=values).arrays
    np.testing.assert_array_equal(gradient["lift"], flow.pullback(values, rest)["lift"])
    wing = asked(joined, "points", of="wing", values={"shift": 1.0}).arrays["points"]
    np.testing.assert_array_equal(wing, joined.case.pipeline.of("wing").points({"shift": 1.0}))


def test_what_cannot_be_is_refused(tmp_path, ball):
    ml.write(tmp_path / "ball.tri", ball)
    held = opened({"text": CASE, "folder": str(tmp_path)})
    assert not list(tmp_path.glob(".moldline*"))
    for op, fields, arrays, told in (
        ("points", {"of": 5}, {}, "'of' is a text"),
        ("points", {"dtype": ">i2"}, {}, "'dtype' is '<f8' or '<f4'"),
        ("points", {"values": {"lift": "high"}}, {}, "expected numbers, got 'high'"),
        ("points", {"values": {"lift": [[1], [2, 3]]}}, {}, "expected numbers"),
        ("pullback", {}, {}, "this needs an array 'cotangent'"),
        ("embed", {"name": "ball"}, {"points": CUBE}, "names something in the case"),
        ("embed", {"name": "a b"}, {"points": CUBE}, "is no word"),
        ("embed", {"name": "a", "on": "b"}, {"points": CUBE}, "no geometry is called 'b'"),
        ("embed", {"name": "a"}, {"points": CUBE[:, :2]}, r"must have the shape \(any, 3\)"),
        ("save", {}, {}, "'path' is a text"),
    ):
        with pytest.raises(ServerError, match=told):
            asked(held, op, arrays, **fields)
    with pytest.raises(ml.errors.CaseError, match=r"^the case's text: moldline: format version 9"):
        opened({"text": "moldline = 9", "folder": str(tmp_path)})

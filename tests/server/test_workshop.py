"""What a server does without a case, and a hand's drag through it."""

import os
import signal
import tomllib
from pathlib import Path

import numpy as np
import pytest
from servers import CASE, serving, until

import moldline as ml
from moldline.server import protocol
from moldline.server.client import Client
from moldline.server.protocol import Message, ServerError
from moldline.server.workshop import WORKSHOP


def asked(op, arrays=None, **fields):
    """The answer of the workshop."""
    return WORKSHOP[op](Message({"id": 1, **fields}, arrays or {}))


@pytest.fixture(scope="module")
def folder(tmp_path_factory, ball):
    """A ball of two halves, with a number at each point."""
    place = tmp_path_factory.mktemp("w")
    tags = (np.asarray(ball.points)[np.asarray(ball.faces)].mean(axis=1)[:, 2] > 0).astype(int)
    data = {"Cp": np.asarray(ball.points)[:, 0], "move": np.asarray(ball.points)}
    named = ml.Surface(ball.points, ball.faces, tags, ("low", "high"), data)
    ml.write(place / "ball.vtp", named)
    ml.write(place / "ball.tri", ball)
    return place


@pytest.fixture(scope="module")
def server(folder):
    """A server that is running."""
    path = folder / "socket"
    with serving("--socket", str(path)) as process:
        until(path.exists)
        yield process


@pytest.fixture(scope="module")
def client(server, folder):
    """A client of it."""
    with Client.connect(folder / "socket") as one:
        yield one


def test_every_operation_of_the_workshop_is_passed_on_to_it():
    assert {*WORKSHOP} == {*protocol.ASKED_OF_WORKSHOP}


def test_a_surface_is_read_and_written_with_its_parts_and_data(client, folder, ball):
    told = client.read(folder / "ball.vtp", units="in")
    assert told.header["kind"] == "surface" and told.header["components"] == ["low", "high"]
    found = told.arrays
    np.testing.assert_array_equal(found["points"], 0.0254 * np.asarray(ball.points))
    np.testing.assert_array_equal(found["faces"], ball.faces)
    np.testing.assert_array_equal(found["data.Cp"], np.asarray(ball.points)[:, 0])
    assert found["data.move"].shape == found["points"].shape
    data = {"Cp": found["data.Cp"]}
    path = client.write(
        folder / "new.vtp", found["points"], found["faces"], found["tags"],
        ["low", "high"], data, units="in",
    )  # fmt: skip
    again = ml.read(path)
    np.testing.assert_allclose(again.points, ball.points, rtol=1e-15)
    assert again.components == ("low", "high") and [*again.point_data] == ["Cp"]
    np.testing.assert_array_equal(again.tags, found["tags"])


def test_quads_are_cut_and_keep_their_parts(folder):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]], float)
    faces = np.array([[0, 1, 2, 3], [1, 4, 5, 2]], np.int32)
    arrays = {"points": points, "faces": faces, "tags": np.array([0, 1])}
    asked("write", arrays, path=str(folder / "two.vtp"), components=["a", "b"])
    found = ml.read(folder / "two.vtp")
    assert found.faces.shape == (4, 3)
    assert [len(found.component(name)) for name in ("a", "b")] == [4, 4]


def test_sections_patches_clouds_and_boundaries_are_read(folder):
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    round_ = np.stack([0.5 + 0.5 * np.cos(angle), 0.1 * np.sin(angle), 0 * angle], axis=1)
    asked("write", {"points": round_}, path=str(folder / "round.dat"), components=["round"])
    told = asked("read", path=str(folder / "round.dat"))
    assert told.header["kind"] == "section" and told.arrays["lines"].shape[1] == 2
    patch = np.stack(np.meshgrid(np.arange(3.0), np.arange(2.0), [0.0]), axis=-1).reshape(-1, 3)
    asked("write", {"points": patch}, path=str(folder / "patch.xyz"), shapes=[[3, 2, 1]])
    told = asked("read", path=str(folder / "patch.xyz"))
    assert told.header["kind"] == "grid" and told.header["shapes"] == [[3, 2, 1]]
    assert told.header["components"] == ["block 1"] and told.arrays["tags"].tolist() == [0] * 4
    mesh = (
        "NDIME= 3\nNELEM= 1\n10 0 1 2 3 0\nNPOIN= 5\n0 0 0 0\n1 0 0 1\n0 1 0 2\n0 0 1 3\n5 5 5 4\n"
    )
    mesh += "NMARK= 2\nMARKER_TAG= floor\nMARKER_ELEMS= 1\n5 0 2 1\n"
    mesh += "MARKER_TAG= wall\nMARKER_ELEMS= 1\n5 0 1 3\n"
    (folder / "mesh.su2").write_text(mesh)
    told = asked("read", path=str(folder / "mesh.su2"))
    assert told.header["kind"] == "volumemesh" and told.header["components"] == ["floor", "wall"]
    assert told.arrays["faces"].tolist() == [[0, 2, 1], [0, 1, 3]]
    assert told.arrays["points"].shape == (4, 3)


def test_formats_are_told_with_their_endings(client):
    told = client.formats()
    assert {"ending": ".tri", "name": "Cart3D tri"} in told["read"]
    assert {one["name"] for one in told["write"]} - {one["name"] for one in told["read"]} == {"GLB"}
    assert "SU2" not in {one["name"] for one in told["write"]}


def test_a_case_is_drafted_amended_and_put_elsewhere(client, folder, tmp_path):
    made = client.draft("", folder, "lattice", "ball.tri", units="m", shape=(2, 2, 2))
    assert made["stage"] == 0 and made["variables"] == ["move_x", "move_y", "move_z"]
    spots = np.array([[0, 0, 1.0]])
    more = client.draft(made["text"], folder, "pilots", bounded=False, spots=spots, names=["top"])
    edit = {"set": ["variable", "move_top", "bounds"], "to": np.array([-0.5, np.inf])}
    text = client.amend(more["text"], folder, [edit])["text"]
    assert tomllib.loads(text)["variable"]["move_top"]["bounds"] == [-0.5, np.inf]
    client.relocate(text, folder, tmp_path / "case.toml")
    case = client.open(tmp_path / "case.toml")
    assert [handle.kind for handle in case.handles()] == ["net", "marks"]
    assert case.handles()[1].labels == ["top"]
    case.close()


def test_a_drag_of_a_hand_ends_where_the_hand_does(client, folder):
    case = client.open(text=CASE, folder=folder)
    (handle,) = case.handles()
    live = case.live(dtype="<f4", measures=True)
    moved = handle.moved.copy()
    for height in np.linspace(0, 0.3, 20):
        moved[:6] = handle.moved[:6] + [0, 0, height]
        live.pull(handle.stage, moved)
        live.poll()
    live.pull(handle.stage, moved)
    shape = live.finish()
    np.testing.assert_allclose(shape.values["lift"], [0.3, 0.0], atol=1e-12)
    assert shape.points.dtype == np.float32 and shape.miss["at_bounds"] == []
    np.testing.assert_array_equal(shape.measures["volume"], case.measures(shape.values)["volume"])
    assert shape.beyond == {}
    live.push({"lift": [-0.9, -0.9]})
    pushed = live.finish()
    assert pushed.values is None and pushed.miss is None and pushed.measures
    one = case.follow(0, moved)
    np.testing.assert_array_equal(one.points, case.points(one.values))
    colour = case.colour({}, "lift", 1, how="size")
    want = np.linalg.norm(case.sensitivity({}, "lift")[..., 1], axis=1)
    np.testing.assert_allclose(colour, want, atol=1e-15)
    assert case.check()["bad_faces"].dtype == np.int64
    case.close()


def test_the_workshop_comes_back_when_its_process_is_killed(client, server):
    client.formats()
    own = Path(f"/proc/{server.pid}/task/{server.pid}/children").read_text().split()
    workers = [n for n in own if b"spawn_main" in Path(f"/proc/{n}/cmdline").read_bytes()]
    before = client.generation
    for number in workers:
        os.kill(int(number), signal.SIGKILL)
    try:
        client.formats()
    except ServerError as error:  # unless the server has noticed by then
        assert error.code == "worker died"
    assert client.formats()["read"] and client.generation == before


@pytest.mark.parametrize(
    ("op", "fields", "arrays", "told"),
    [
        ("read", {"path": "ball.tri"}, {}, "give a full path, from the root"),
        ("read", {"path": "/a\0b"}, {}, "give a full path"),
        ("read", {"path": 5}, {}, "'path' is a text"),
        ("read", {"path": "/", "units": "m"}, {}, "/"),
        ("read", {"path": "/none.tri", "units": "mile"}, {}, "no unit named 'mile'"),
        ("read", {"path": "/none.tri", "units": 5}, {}, "'units' is a text"),
        ("write", {"path": "/none/a.tri"}, {}, "this needs an array 'points'"),
        ("write", {"path": "/none/a.tri"}, {"points": np.ones((3, 2))}, r"shape \(any, 3\)"),
        ("write", {"path": "/none/a.tri"}, {"points": np.full((3, 3), np.nan)}, "must be finite"),
        ("write", {"path": "/none/a.tri"}, {"points": np.ones((3, 3))}, "holds a Surface"),
        ("write", {"path": "/none/a.tri", "components": "x"}, {"points": np.ones((3, 3))}, "names"),
        ("write", {"path": "/a.xyz", "shapes": [[2, 2]]}, {"points": np.ones((4, 3))}, "three"),
        ("write", {"path": "/a.xyz", "shapes": [[2, -2, 1]]}, {"points": np.ones((4, 3))}, "three"),
        ("write", {"path": "/a.xyz", "shapes": [[2, 1], 3]}, {"points": np.ones((4, 3))}, "three"),
        ("draft", {"text": "", "folder": "/none", "kind": "cage"}, {}, "/none: is no folder"),
        ("draft", {"text": "", "folder": "/", "kind": "cage", "options": 5}, {}, "'options' are"),
        ("draft", {"text": 5, "folder": "/", "kind": "cage"}, {}, "'text' is a text"),
        ("amend", {"text": "", "edits": {}}, {}, "'edits' is a list"),
        ("amend", {"text": "", "edits": []}, {}, "moldline: it must be there"),
        ("relocate", {"text": "moldline = 1", "folder": "/", "path": "x"}, {}, "give a full path"),
        ("relocate", {"text": "moldline = 1", "folder": "/", "path": "/none/c"}, {}, "no folder"),
    ],
)  # fmt: skip
def test_what_the_workshop_cannot_do_is_said(op, fields, arrays, told):
    with pytest.raises((ServerError, ml.errors.MoldlineError), match=told):
        asked(op, arrays, **fields)


@pytest.mark.parametrize(
    ("faces", "told"),
    [
        (np.array([[0, 1, 9]]), "refers to 9, but there are only 3"),
        (np.array([[0, 1]]), "3 or 4 corners"),
        (np.array([0, 1, 2]), "whole numbers along 2 axes"),
        (np.array([[0.0, 1.0, 2.0]]), "whole numbers along 2 axes"),
    ],
)
def test_faces_that_are_none_are_refused_and_nothing_is_written(tmp_path, faces, told):
    arrays = {"points": np.eye(3), "faces": faces}
    with pytest.raises((ServerError, ml.errors.MoldlineError), match=told):
        asked("write", arrays, path=str(tmp_path / "a.tri"))
    assert not list(tmp_path.iterdir())

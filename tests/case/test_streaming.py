"""Cases deformed file to file."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.cli import main
from moldline.errors import FileError
from moldline.mesh.io import mapped

CASE = """
moldline = 1
[geometry.thing]
file = "{file}"
{units}
[variable.lift]
value = [0.2, -0.1, 0.3, 0.05]
[variable.turn]
value = 0.1
[[stage]]
deformer = "lattice"
shape = [4, 3, 3]
[[stage.link]]
variable = "lift"
link = "camber"
along = "x"
axis = "z"
[[stage]]
deformer = "lattice"
shape = [3, 2, 2]
outside = "extend"
carried = {carried}
[[stage.link]]
variable = "turn"
link = "group"
axis = "y"
index = [[0, 0, 0], [1, 1, 0]]
"""


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    """Many chunks from little data, the last of another size."""
    monkeypatch.setattr(mapped, "CHUNK", 100)


def case(folder, file, units="", carried="false"):
    text = CASE.format(file=file, units=units, carried=carried)
    (folder / "case.toml").write_text(text)
    return str(folder / "case.toml")


def grid(ball):
    points = np.asarray(ball.points)
    return ml.Grid(points[:1020], ((10, 17, 3), (51, 10, 1)))


FILES = {
    "little.tri": {"binary": "little"},
    "big.i.tri": {"binary": "big", "records": True},
    "single.tri": {"binary": "little", "precision": 4},
    "soup.stl": {"binary": True},
    "boxes.xyz": {"binary": "little", "records": True},
    "stream.xyz": {"binary": "big"},
}


@pytest.mark.parametrize("carried", ["false", "true"])
@pytest.mark.parametrize(("name", "options"), FILES.items())
def test_a_streamed_file_is_the_one_that_memory_gives(tmp_path, ball, name, options, carried):
    ml.write(tmp_path / name, grid(ball) if name.endswith("xyz") else ball, **options)
    file, suffix = case(tmp_path, name, carried=carried), name.partition(".")[2]
    assert main(["deform", file, "--stream", "-o", str(tmp_path / f"streamed.{suffix}")]) == 0
    streamed = ml.read(tmp_path / f"streamed.{suffix}")
    expected = ml.load(file).pipeline()
    small = "single" in name or "stl" in name
    rounding = 2e-7 if small else 4e-16
    if suffix == "stl":
        np.testing.assert_array_equal(streamed.faces, expected.faces)
    np.testing.assert_allclose(streamed.points, expected.points, rtol=rounding, atol=rounding)
    assert (tmp_path / name).stat().st_size == (tmp_path / f"streamed.{suffix}").stat().st_size


def test_all_but_the_coordinates_is_copied(tmp_path, ball):
    ml.write(tmp_path / "a.i.tri", ball, binary="little")
    before = (tmp_path / "a.i.tri").read_bytes()
    main(["deform", case(tmp_path, "a.i.tri"), "--stream", "-o", str(tmp_path / "b.i.tri")])
    after = (tmp_path / "b.i.tri").read_bytes()
    end = 8 + 24 * len(ball.points)
    assert before[:8] == after[:8]
    assert before[end:] == after[end:]
    assert before[8:end] != after[8:end]


def test_normals_follow(tmp_path, ball):
    ml.write(tmp_path / "a.stl", ball, binary=True)
    file = case(tmp_path, "a.stl")
    main(["deform", file, "--stream", "-o", str(tmp_path / "b.stl")])
    ml.write(tmp_path / "c.stl", ml.load(file).pipeline(), binary=True)
    streamed, whole = ((tmp_path / name).read_bytes() for name in ("b.stl", "c.stl"))
    type_ = np.dtype([("numbers", "<f4", 12), ("attribute", "<u2")])
    one, other = (np.frombuffer(data, type_, offset=84)["numbers"] for data in (streamed, whole))
    np.testing.assert_allclose(one, other, rtol=0, atol=2e-6)


def test_units_are_the_file_s(tmp_path, ball):
    ml.write(tmp_path / "a.tri", ball, binary="little")
    file = case(tmp_path, "a.tri", units='units = "in"')
    main(["deform", file, "--stream", "-o", str(tmp_path / "b.tri")])
    expected = ml.load(file).pipeline()
    np.testing.assert_allclose(
        np.asarray(ml.read(tmp_path / "b.tri").points) * 0.0254, expected.points, rtol=0, atol=1e-16
    )


def test_a_rider_is_streamed(tmp_path, ball, capsys):
    ml.write(tmp_path / "a.tri", ball, binary="little")
    ml.write(tmp_path / "flow.xyz", grid(ball), binary="little")
    file = case(tmp_path, "a.tri")
    with Path(file).open("a") as stream:
        stream.write('[rider.flow]\nfile = "flow.xyz"\n')
    command = ["deform", file, "--rider", "flow", "--stream", "-o", str(tmp_path / "b.xyz")]
    assert main([*command, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    expected = ml.load(file).riders["flow"]()
    assert told["points"] == len(expected.points)
    np.testing.assert_allclose(
        ml.read(tmp_path / "b.xyz").points, expected.points, rtol=0, atol=1e-15
    )


@pytest.mark.parametrize(
    ("name", "target", "options", "said"),
    [
        ("a.tri", "b.tri", {}, "only binary files can be streamed"),
        ("a.stl", "b.stl", {}, "only binary STL can be streamed"),
        ("a.obj", "b.obj", {}, "OBJ cannot be streamed; binary Cart3D tri"),
        ("a.tri", "b.stl", {"binary": "little"}, "a streamed Cart3D tri keeps its format"),
    ],
)
def test_what_cannot_be_streamed_is_said(tmp_path, ball, capsys, name, target, options, said):
    ml.write(tmp_path / name, ball, **options)
    file = case(tmp_path, name)
    assert main(["deform", file, "--stream", "-o", str(tmp_path / target)]) == 1
    assert said in capsys.readouterr().err
    assert not (tmp_path / target).exists()


def test_a_component_cannot_be_chosen_when_streamed(tmp_path, ball, capsys):
    ml.write(tmp_path / "a.tri", ball, binary="little")
    file = case(tmp_path, "a.tri")
    text = Path(file).read_text().replace("[4, 3, 3]", '[4, 3, 3]\ncomponent = "1"', 1)
    Path(file).write_text(text)
    assert main(["deform", file, "--stream", "-o", str(tmp_path / "b.tri")]) == 1
    assert "has no components (one that is streamed neither)" in capsys.readouterr().err


def test_coordinates_that_are_not_finite_are_refused(tmp_path, ball):
    ml.write(tmp_path / "a.tri", ball, binary="little")
    data = bytearray((tmp_path / "a.tri").read_bytes())
    data[8:16] = np.array(np.nan).tobytes()
    (tmp_path / "a.tri").write_bytes(bytes(data))
    with pytest.raises(ml.errors.CaseError, match="not finite"):
        ml.load(case(tmp_path, "a.tri"), sampled=True)


def test_an_old_file_stays_whole_when_streaming_fails(tmp_path, ball, monkeypatch):
    ml.write(tmp_path / "a.tri", ball, binary="little")
    (tmp_path / "b.tri").write_text("old")

    def fail(*_):
        raise FileError("no")

    monkeypatch.setattr(mapped, "narrowed", fail)
    assert main(["deform", case(tmp_path, "a.tri"), "--stream", "-o", str(tmp_path / "b.tri")]) == 1
    assert (tmp_path / "b.tri").read_text() == "old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.tri", "b.tri", "case.toml"]


MEASURE = """
import sys, threading, time
from moldline.cli import main

def own():
    lines = open("/proc/self/status").read().split("\\n")
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("RssAnon"))

peak, done = 0, False
def watch():
    global peak
    while not done:
        peak = max(peak, own())
        time.sleep(0.002)

main(["deform", sys.argv[1], "--stream", "-o", sys.argv[2]])
before = own()
thread = threading.Thread(target=watch)
thread.start()
main(["deform", sys.argv[3], "--stream", "-o", sys.argv[4]])
done = True
thread.join()
print(peak - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is measured in Linux's way")
def test_memory_does_not_grow_with_the_file(tmp_path):
    """After one million points twelve million, whose file and result are 576 MB."""
    rng = np.random.default_rng(0)
    names = []
    for name, count in (("small", 1_200_000), ("large", 12_000_000)):
        (tmp_path / name).mkdir()
        points = rng.uniform(0, 1, (count, 3))
        ml.write(
            tmp_path / name / "a.xyz", ml.Grid(points, ((count // 400, 400, 1),)), binary="little"
        )
        del points
        names += [case(tmp_path / name, "a.xyz"), str(tmp_path / name / "b.xyz")]
    command = [sys.executable, "-c", MEASURE, *names]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[-1]) < 250e6
    assert (tmp_path / "large/b.xyz").stat().st_size == (tmp_path / "large/a.xyz").stat().st_size

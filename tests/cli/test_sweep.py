"""`moldline sweep` as a user runs it: whole, interrupted, changed, with failures among them."""

import csv
import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.case import load
from moldline.case.samples import from_table, hypercube
from moldline.case.sweep import Sweep
from moldline.cli import main
from moldline.errors import CaseError, FileError, ParameterError
from moldline.workers import Serial

CASE = """
moldline = 1
[geometry.box]
file = "box.tri"
[variable.stretch]
size = 2
bounds = [-0.2, 0.3]
unit = "m"
[variable.shift]
value = 0.5
unit = "m"
[[stage]]
deformer = "lattice"
low = [0.0, 0.0, 0.0]
high = [1.0, 1.0, 1.0]
shape = [2, 2, 2]
outside = "extend"
[[stage.link]]
variable = "stretch"
link = "thickness"
along = "x"
axis = "z"
[[stage.link]]
variable = "shift"
link = "group"
axis = "x"
[measure.volume]
measure = "volume"
bounds = [0.9, 1.2]
[measure.centroid]
measure = "centroid"
"""


@pytest.fixture
def case(tmp_path, monkeypatch):
    """A unit cube between two planes that move; its volume is 1 + the mean of `stretch`."""
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    ml.write(tmp_path / "box.tri", ml.Surface(corners.astype(float), faces))
    (tmp_path / "case.toml").write_text(CASE)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "case.toml"


def rows(folder):
    with (folder / "sweep.csv").open() as file:
        return list(csv.DictReader(file))


def serial(case, *more):
    return main(["sweep", str(case), "-o", "study", "--executor", "serial", *map(str, more)])


def test_a_hypercube_takes_each_part_of_each_range_once(case):
    samples = hypercube(load(case), 20, seed=3)
    assert samples.labels == ("stretch[0]", "stretch[1]", "shift")
    for column in samples.numbers[:, :2].T:
        parts = np.floor((column + 0.2) / 0.5 * 20)
        np.testing.assert_array_equal(np.sort(parts), np.arange(20))
    assert set(samples.numbers[:, 2]) == {0.5}  # it has no bounds
    np.testing.assert_array_equal(samples.numbers, hypercube(load(case), 20, seed=3).numbers)
    assert not np.array_equal(samples.numbers, hypercube(load(case), 20, seed=4).numbers)


def test_tables_and_shapes_hold_what_each_sample_is(case, tmp_path, capsys):
    assert serial(case, "--samples", 5, "--shapes", "shapes", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["samples"], report["done"], report["failed"]) == (5, 5, [])
    arrays = np.load(tmp_path / "study/sweep.npz")
    expected = 1 + arrays["numbers"][:, :2].mean(axis=1)
    np.testing.assert_allclose(arrays["measure_volume"][:, 0], expected, atol=1e-12)
    assert arrays["measure_centroid"].shape == (5, 3)
    assert list(arrays["is_within"]) == [bool(0.9 <= v <= 1.2) for v in expected]
    for number, row in enumerate(rows(tmp_path / "study")):
        assert float(row["volume"]) == arrays["measure_volume"][number, 0]
        shape = ml.read(tmp_path / f"shapes/{number}.tri")
        assert ml.measures.Volume(shape.faces)(shape.points)[0] == pytest.approx(
            float(row["volume"])
        )


def test_workers_do_the_same_in_any_order(case, tmp_path):
    assert main(["sweep", str(case), "-o", "many", "--samples", "6", "--jobs", "2"]) == 0
    assert serial(case, "--samples", 6) == 0
    one, other = (np.load(tmp_path / name / "sweep.npz") for name in ("many", "study"))
    np.testing.assert_array_equal(one["measure_volume"], other["measure_volume"])


def test_a_table_may_name_some_numbers_and_failures_stop_no_other(case, tmp_path, capsys):
    (tmp_path / "t.csv").write_text("stretch[1],shift\n0.1,0\n0.9,0\n-0.1,2.5\n")
    assert serial(case, "--table", "t.csv", "--set", "stretch[0]=0.2") == 1
    told = capsys.readouterr().out
    assert "study: 2 of 3 samples done, 2 within their bounds" in told
    assert "sample 1:" in told and "stretch[1] = 0.9 is outside [-0.2, 0.3] m" in told
    found = rows(tmp_path / "study")
    assert [row["volume"] == "" for row in found] == [False, True, False]
    assert float(found[0]["volume"]) == pytest.approx(1.15)
    assert "is outside" in found[1]["error"]
    assert serial(case, "--table", "t.csv", "--set", "stretch[0]=0.2") == 1  # nothing left to do
    records = (tmp_path / "study/records.jsonl").read_text().splitlines()
    assert len(records) == 3
    assert serial(case, "--table", "t.csv", "--set", "stretch[0]=0.2", "--retry") == 1
    assert len((tmp_path / "study/records.jsonl").read_text().splitlines()) == 4


def test_an_interrupted_sweep_goes_on_and_ends_the_same(case, tmp_path):
    loaded = load(case)
    samples = hypercube(loaded, 6)
    first = Sweep(loaded, samples, tmp_path / "study").run(Serial())
    done = [next(first) for _ in range(3)]
    first.close()
    with (tmp_path / "study/records.jsonl").open("ab") as file:
        file.write(b'{"number": 4, "meas')  # a line cut short
    again = Sweep(loaded, samples, tmp_path / "study")
    assert again.waiting() == [3, 4, 5]
    assert again.records == {r.number: r for r in done}
    list(again.run(Serial()))
    arrays = np.load(tmp_path / "study/sweep.npz")
    assert arrays["is_done"].all()
    expected = 1 + samples.numbers[:, :2].mean(axis=1)
    np.testing.assert_allclose(arrays["measure_volume"][:, 0], expected, atol=1e-12)


def test_a_killed_sweep_goes_on_and_ends_the_same(case, tmp_path):
    words = [sys.executable, "-m", "moldline", "sweep", str(case), "--samples", "40", "--jobs", "2"]
    words += ["-o", "study", "--shapes", "shapes"]
    run = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.DEVNULL)
    records = tmp_path / "study/records.jsonl"
    for _ in range(3000):
        if records.exists() and records.read_bytes().count(b"\n") >= 3:
            break
        time.sleep(0.05)
    run.send_signal(signal.SIGKILL)
    run.wait()
    before = records.read_bytes().count(b"\n")
    assert 3 <= before < 40
    assert serial(case, "--samples", 40, "--shapes", "shapes") == 0
    arrays = np.load(tmp_path / "study/sweep.npz")
    expected = 1 + arrays["numbers"][:, :2].mean(axis=1)
    np.testing.assert_allclose(arrays["measure_volume"][:, 0], expected, atol=1e-12)
    numbers = [json.loads(line)["number"] for line in records.read_text().splitlines()]
    assert sorted(numbers) == list(range(40))
    for number in range(40):
        shape = ml.read(tmp_path / f"shapes/{number:02}.tri")
        volume = float(ml.measures.Volume(shape.faces)(shape.points)[0])
        assert volume == pytest.approx(expected[number])


def test_shapes_asked_for_later_are_made(case, tmp_path):
    assert serial(case, "--samples", 2) == 0
    assert serial(case, "--samples", 2, "--shapes", "shapes", "--format", "stl") == 0
    assert sorted(p.name for p in (tmp_path / "shapes").iterdir()) == ["0.stl", "1.stl"]


def test_pictures_are_drawn(case, tmp_path):
    assert serial(case, "--samples", 1, "--pictures", "seen") == 0
    assert (tmp_path / "seen/0.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: p.write_text(CASE.replace("0.9, 1.2", "0.9, 1.3")), "case.toml changed since"),
        (lambda p: shutil.copy(p.parent / "box.tri", p.parent / "b") and
         (p.parent / "box.tri").write_text((p.parent / "box.tri").read_text() + "\n"),
         "box.tri changed since"),
    ],
)  # fmt: skip
def test_a_changed_case_is_told(case, capsys, change, message):
    assert serial(case, "--samples", 2) == 0
    change(case)
    assert serial(case, "--samples", 2) == 1
    assert message in capsys.readouterr().err
    assert serial(case, "--samples", 2, "--restart") == 0


def test_changed_samples_are_told(case, capsys):
    assert serial(case, "--samples", 2) == 0
    assert serial(case, "--samples", 3) == 1
    assert "the samples (then 2, now 3) changed since" in capsys.readouterr().err


def test_two_sweeps_in_one_folder_are_refused(case, tmp_path):
    from moldline.errors import TaskError

    loaded = load(case)
    one, two = (Sweep(loaded, hypercube(loaded, 3), tmp_path / "study") for _ in range(2))
    first = one.run(Serial())
    next(first)
    with pytest.raises(TaskError, match="another process works here"):
        next(two.run(Serial()))
    first.close()


def test_what_makes_no_sense_is_told(case, tmp_path, capsys):
    loaded = load(case)
    with pytest.raises(ParameterError, match="no variable 'span' to vary"):
        hypercube(loaded, 3, names=["span"])
    with pytest.raises(ParameterError, match="shift has no bounds"):
        hypercube(loaded, 3, names=["shift"])
    table = tmp_path / "t.csv"
    for text, message in [
        ("span\n1\n", "names 'span', which is no number of a variable"),
        ("shift,shift\n1,2\n", "names 'shift', twice"),
        ("shift\n", "no line of numbers"),
        ("shift\n1,2\n", "row 1 has 2 numbers, expected 1"),
        ("shift\none\n", "row 1: could not convert"),
    ]:
        table.write_text(text)
        with pytest.raises(FileError, match=message):
            from_table(loaded, table)
    case.write_text(CASE[: CASE.index("[measure.volume]")])
    with pytest.raises(ParameterError, match="has no measures, so there is nothing to record"):
        Sweep(load(case), hypercube(loaded, 3), tmp_path / "study")
    assert serial(case, "--samples", 2, "--shapes", "s", "--format", "doc") == 1
    assert "the suffix tells no format" in capsys.readouterr().err
    assert serial(case, "--samples", 2, "--shapes", "s", "--executor", "dask") == 1
    assert "--scheduler ADDRESS go together" in capsys.readouterr().err


def test_a_case_that_changes_in_mid_run_is_found_out_by_workers(case, tmp_path):
    loaded = load(case)
    sweep = Sweep(loaded, hypercube(loaded, 2), tmp_path / "study")
    case.write_text(CASE.replace("0.9, 1.2", "0.9, 1.3"))
    records = list(sweep.run(Serial()))
    assert all("has changed since the sweep began" in record.error for record in records)
    with pytest.raises(CaseError, match="changed since"):
        Sweep(load(case), hypercube(loaded, 2), tmp_path / "study")


@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_does_the_same(case, tmp_path):
    distributed = pytest.importorskip(
        "distributed", reason='Dask comes with pip install "moldline[cluster]"'
    )
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, processes=True
    ) as cluster:
        words = ["--executor", "dask", "--scheduler", cluster.scheduler_address]
        assert main(["sweep", str(case), "-o", "far", "--samples", "3", *words]) == 0
    arrays = np.load(Path("far") / "sweep.npz")
    expected = 1 + arrays["numbers"][:, :2].mean(axis=1)
    np.testing.assert_allclose(arrays["measure_volume"][:, 0], expected, atol=1e-12)

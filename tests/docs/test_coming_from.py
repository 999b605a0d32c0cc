"""The pages for people who come from elsewhere do what they say."""

import re
from pathlib import Path

import numpy as np
import pytest

import moldline as ml
from moldline.case.su2_config import KINDS

HOWTO = Path(__file__).parent.parent.parent / "docs/howto"


def blocks(page, language):
    return re.findall(rf"```{language}\n(.*?)```", (HOWTO / page).read_text(), re.S)


@pytest.fixture
def folder(tmp_path, ball, monkeypatch):
    """A wing and a box with the names and sizes of the pyGeo page."""
    monkeypatch.chdir(tmp_path)
    ml.write(tmp_path / "wing.stl", ball)
    lines = [np.linspace(-1.5, 1.5, n) for n in (5, 3, 4)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    flat = grid.transpose(2, 1, 0, 3).reshape(-1, 3)
    ml.write(tmp_path / "ffd.xyz", ml.Grid(flat, ((5, 3, 4),)))
    (tmp_path / "case.toml").write_text(blocks("from_pygeo.md", "toml")[0])
    for name in ("aero.txt", "structure.txt"):
        np.savetxt(tmp_path / name, np.random.default_rng(len(name)).uniform(-1, 1, (7, 3)))
    return tmp_path


def test_the_pygeo_page_s_script_runs(folder):
    names = {}
    exec(blocks("from_pygeo.md", "python")[1], names)
    assert names["total"]["shape"].shape == (60,)
    np.testing.assert_allclose(np.sum(names["total"]["shape"]), 14, rtol=1e-12)


def test_the_pygeo_page_s_names_are_there(folder):
    case = ml.load("case.toml")
    values = {"shape": np.linspace(-0.05, 0.05, 60)}
    cfd = case.embed(np.loadtxt("aero.txt"))
    assert cfd.sensitivity(values, "shape").shape == (7, 3, 60)
    assert cfd.pushforward(values, values).shape == (7, 3)
    assert cfd.pullback(values, np.ones((7, 3)))["shape"].shape == (60,)


def test_the_su2_page_names_every_kind_that_is_converted():
    text = (HOWTO / "from_su2.md").read_text()
    for kind in KINDS.values():
        assert kind.removesuffix("_2D") in text

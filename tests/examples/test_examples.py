"""Every example runs and is exact, or as close to its reference as it says."""

import runpy
from pathlib import Path

import gmsh
import numpy as np
import pytest

import archord

FOLDER = Path(__file__).parents[2] / "examples"


@pytest.mark.mpi
def test_a_stack_of_squares_is_exact_and_short():
    """Its ``pressure`` is its ``exact`` one, on any number of ranks; at most 30 lines."""
    path = FOLDER / "three_stack.py"
    names = runpy.run_path(str(path))
    assert names["pressure"] == pytest.approx(names["exact"], rel=1e-10)
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 30


@pytest.mark.mpi
def test_the_force_of_a_lug_is_that_of_other_codes(comm, monkeypatch, tmp_path):
    """Within 0.1 % at every displacement of two codes, one of them CalculiX 2.20, refined until the
    digits stood; from gmsh calls to a picture in about 25 lines."""
    monkeypatch.chdir(comm.bcast(tmp_path))
    run = runpy.run_path(str(FOLDER / "lug.py"))["run"]
    gmsh.finalize()
    assert (run.folder / "picture.png").is_file()
    assert (
        len((FOLDER / "lug.py").read_text(encoding="utf-8").partition("initialize")[2].splitlines())
        <= 25
    )
    found = dict(
        zip(np.round(run.columns["pull displacement"], 9), run.columns["pull force"], strict=True)
    )
    for d, P in {0.02: 590.7, 0.1: 4001, 0.2: 9539, 0.3: 15451}.items():
        assert found[d] == pytest.approx(P, rel=1e-3)


def test_the_force_of_an_eyebar_is_that_of_other_codes(tmp_path):
    """Within 0.3 % of CalculiX 2.20 (CPE8, 5 300 dofs, 20 steps to 0.1 mm); the part of the scene
    that costs little."""
    changes = {"load.press.displacement": 0.1, "path.steps": 20}
    run = archord.solve(
        archord.load_scene(FOLDER / "eyebar" / "eyebar.toml", changes), tmp_path / "run"
    )
    assert run.columns["press force"][-1] == pytest.approx(1187.7, rel=3e-3)
    assert sum(run.columns["cutbacks"]) == 0


def test_a_loaded_pin_is_that_of_calculix(tmp_path):
    """The largest pressure to 1 % of CalculiX 2.20 on the same mesh (220.9 MPa, the largest at a
    node)."""
    scene = archord.load_scene(FOLDER / "loaded_pin.toml", {"load.steps": 1, "load.at": "diameter"})
    run = archord.solve(scene, tmp_path / "run")
    assert run.columns["pin in lug largest pressure"][-1] == pytest.approx(220.9, rel=0.01)
    assert run.columns["clamp x"][-1] == pytest.approx(-20000, rel=1e-6)


def test_every_example_is_tested():
    assert {path.stem for path in FOLDER.glob("*.py")} == {"three_stack", "lug", "slider_crank"}

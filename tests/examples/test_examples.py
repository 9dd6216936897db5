"""Every example runs and is exact, or as close to its reference as it says."""

import runpy
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples"


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["two_squares", "three_stack"])
def test_an_example_is_exact_and_short(name):
    """Its ``pressure`` is its ``exact`` one, on any number of ranks; at most 30 lines."""
    path = FOLDER / f"{name}.py"
    names = runpy.run_path(str(path))
    assert names["pressure"] == pytest.approx(names["exact"], rel=1e-10)
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 30


@pytest.mark.mpi
@pytest.mark.parametrize(("arguments", "tolerance"), [([], 0.001), (["yield"], 0.003)])
def test_the_force_of_a_lug_is_that_of_other_codes(monkeypatch, arguments, tolerance):
    """Within 0.1 % elastic and 0.3 % with hardening, at every displacement, on a mesh of a few thousand dofs."""
    monkeypatch.setattr(sys, "argv", ["lug.py", *arguments])
    names = runpy.run_path(str(FOLDER / "lug.py"))
    assert max(map(abs, names["differences"].values())) < tolerance
    assert names["system"].V.dofmap.index_map.size_global * 2 < 12_000


def test_every_example_is_tested():
    assert {path.stem for path in FOLDER.glob("*.py")} == {"two_squares", "three_stack", "lug"}

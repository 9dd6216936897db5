"""Every example runs and is exact."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))


@pytest.mark.mpi
@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_an_example_is_exact_and_short(path):
    """Its ``pressure`` is its ``exact`` one, on any number of ranks; at most 30 lines."""
    names = runpy.run_path(str(path))
    assert names["pressure"] == pytest.approx(names["exact"], rel=1e-10)
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 30

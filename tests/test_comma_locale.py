"""Numbers do not depend on the locale of the program that uses archord, such as one with a window:
there C reads and writes a decimal comma."""

import locale

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.cli import run
from archord.output.history import read_history
from tests.solver.linear.test_multigrid import elastic_cube, error, solver
from tests.test_law_commands import SCENE
from tests.test_own_parts import slab

# the file LC_NUMERIC of the C library of GNU: a head, where strings begin, and these
_FILE = np.array([0x20031114, 6, 32, 34, 36, 40, 44, 48], "<u4").tobytes()
_FILE += b",\0.\0\3\3\0\0,\0\0\0.\0\0\0UTF-8\0"


@pytest.fixture
def comma(tmp_path, monkeypatch):
    """A function after which C writes 0,5 for a half, until the test ends."""
    folder = tmp_path / "locales" / "comma"
    folder.mkdir(parents=True)
    (folder / "LC_NUMERIC").write_bytes(_FILE)
    before = locale.setlocale(locale.LC_NUMERIC)

    def speak():
        monkeypatch.setenv("LOCPATH", str(folder.parent))
        try:
            locale.setlocale(locale.LC_NUMERIC, "comma")
        except locale.Error:
            pytest.skip("the C library reads no such locale")
        assert locale.localeconv()["decimal_point"] == ","

    yield speak
    locale.setlocale(locale.LC_NUMERIC, before)


def test_multigrid_is_set_up(comma):
    """PETSc refused an option of 0.05, and a solve in space ended in a traceback."""
    comma()
    V, fixed, A = elastic_cube(4, comm=MPI.COMM_SELF)
    assert error(solver(A, V, fixed, rtol=1e-10), A) < 1e-7


def test_files_hold_the_same_numbers(comma, tmp_path):
    """Histories, decks and exported laws."""
    problem = slab()
    texts = []
    for name in ("point", "comma"):
        if name == "comma":
            comma()
        found = archord.solve(problem, tmp_path / name)
        assert read_history(tmp_path / name / "history.csv") == found.columns
        deck = archord.export_deck(problem, tmp_path / "slab.inp", force=True)
        law = tmp_path / "law.h"
        assert run(["law", "--scene", SCENE, "--export", str(law), "--force"]) == 0
        forces = found.columns["press force"], found.columns["elastic_energy"]
        told = [file.read_text(encoding="utf-8") for file in (deck, law)]
        texts.append((told, forces))
    assert texts[0] == texts[1]

"""What every test needs, on one rank or several."""

from __future__ import annotations

import gc
import os
import shutil

import pytest
from hypothesis import settings
from mpi4py import MPI

from archord.geometry.meshes import mesh_cache

gc.set_threshold(200_000, 20)  # imports and the rewriting of tests make no garbage
settings.register_profile("same", derandomize=True)  # the same examples in each run
settings.load_profile("same")

_PASSED = pytest.StashKey[bool]()


def pytest_addoption(parser):
    parser.addoption("--kills", type=int, default=8, help="how often a test kills runs (8)")
    parser.addoption("--cases", type=int, default=12, help="how many scenes tests/fuzz solves (12)")


def pytest_xdist_auto_num_workers(config):
    """One worker a core; none on several ranks, which run the same tests together."""
    return 0 if MPI.COMM_WORLD.size > 1 else os.cpu_count()


def pytest_collection_modifyitems(items):
    """On several ranks only tests that are made for them: the others would start processes or write
    the same files."""
    if MPI.COMM_WORLD.size > 1:
        items[:] = [item for item in items if item.get_closest_marker("mpi")]


def pytest_collection_finish():
    """Leave what the imports made out of the collections below, which take a tenth of a second
    otherwise, and collect more seldom."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Leave no folder of a test that passed: all of them together would fill a small /tmp."""
    report = yield
    if call.when == "call":
        item.stash[_PASSED] = report.passed
    elif call.when == "teardown" and item.stash.get(_PASSED, False):
        folder = (getattr(item, "funcargs", None) or {}).get("tmp_path")
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
    return report


@pytest.fixture(scope="session", autouse=True)
def _keep_all_meshes():
    """The suite has more meshes than a user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mesh_cache, "_MOST", 1000)
        yield


@pytest.fixture(autouse=True)
def _destroy_together():
    """Destructors of PETSc and dolfinx objects are collective: run them on all ranks at the same
    place."""
    yield
    if MPI.COMM_WORLD.size > 1:
        gc.collect()
        MPI.COMM_WORLD.barrier()


@pytest.fixture
def comm() -> MPI.Comm:
    return MPI.COMM_WORLD


@pytest.fixture
def refused(capsys):
    """``refused(arguments)`` is what the command line says when it refuses them: one sentence, exit
    code 2, and nothing on stdout."""

    def sentence(arguments) -> str:
        from archord.cli import run

        assert run(arguments) == 2
        out, err = capsys.readouterr()
        assert (out, err.count("\n"), err[-1:]) == ("", 1, "\n")
        return err

    return sentence


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """Folders of small runs, solved once, by name: an elastic joint on two meshes, one of plane
    stress that yields."""
    from archord.benchmarks.case import paper_joint
    from tests.output.run_files import solved

    scenes = {
        "elastic": paper_joint(0.1, 6),
        "coarse": paper_joint(0.15, 6),
        "plastic": paper_joint(0.1, 8, 0.002, analysis={"plane": "stress"}),
    }
    return solved(scenes, tmp_path_factory.mktemp("runs"))

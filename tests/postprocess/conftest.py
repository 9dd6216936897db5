"""Small runs on disk, solved once."""

import pytest
from mpi4py import MPI

from archord.benchmarks.paper_joint import paper_joint
from archord.solver.run import solve_scene
from archord.solver.run_folder import claim_folder


@pytest.fixture(scope="session")
def runs(tmp_path_factory):
    """Folders by name: an elastic joint on two meshes, one of plane stress that yields."""
    scenes = {
        "elastic": paper_joint(0.1, 6),
        "coarse": paper_joint(0.15, 6),
        "plastic": paper_joint(0.1, 8, 0.002, analysis={"plane": "stress"}),
    }
    folder = tmp_path_factory.mktemp("runs")
    for name, scene in scenes.items():
        claim_folder(folder / name, False)
        solve_scene(scene, folder / name, MPI.COMM_SELF)
    return {name: folder / name for name in scenes}

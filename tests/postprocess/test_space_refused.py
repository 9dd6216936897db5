"""What a run in space is not for is said in a sentence."""

import pytest
from mpi4py import MPI

import archord
from archord.report.errors import InputError

STEEL = {"E": 210e3, "nu": 0.3}
JOINT = {
    "joint": {"radius": 10.0, "clearance": 0.05, "relative_element_size": 0.5},
    "pin": STEEL,
    "block": STEEL,
    "space": {"thickness": 5.0, "rim_ratio": 1.0},
    "load": {"displacement": 1.0, "steps": 1},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run") / "joint"
    return archord.solve(JOINT, folder, comm=MPI.COMM_SELF)


def test_laws_of_planes_are_not_fitted(run):
    with pytest.raises(InputError, match="joint: is in space; this is for joints in a plane"):
        assert run.curve


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ({"edge": "hole"}, 'an edge is "A & B", where two of the surfaces meet'),
        ({"line": (0.0, 0.0, 1.0, 1.0)}, "a line here is x0, y0, z0, x1, y1, z1, not 4 numbers"),
    ],
)
def test_edges_and_lines_of_planes_are_not_probed(run, place, said):
    with pytest.raises(InputError, match=said):
        run.probe(**place)

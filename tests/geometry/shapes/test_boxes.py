"""Boxes in space: their volumes and sides, and a bar in tension."""

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord import Body, Elastic, Load, Problem, Support, System
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.quality import measures
from tests.geometry.meshes.test_read import content

E, NU = 210e3, 0.3
KINDS = pytest.mark.parametrize("kind", ["tetrahedra", "hexahedra"])


@pytest.mark.mpi
@KINDS
def test_boxes_have_their_volumes_and_sides(comm, kind):
    """Left to right along x, bottom to top along y, back to front along z."""
    x, y, z, lx, ly, lz = place = (1.0, 2.0, -1.0, 2.0, 0.5, 1.0)
    mesh = archord.boxes({"a": place, "b": (0, 0, 0, 1, 1, 1)}, 0.5, kind, comm)
    name, order, found = content(mesh)
    assert (name.replace("hedron", "hedra"), order) == (kind, 2)
    assert found["cells", "a"][1] == pytest.approx(lx * ly * lz)
    assert found["cells", "b"][1] == pytest.approx(1)
    sides = {"left": (0, x), "right": (0, x + lx), "bottom": (1, y), "top": (1, y + ly)}
    sides |= {"back": (2, z), "front": (2, z + lz)}
    whole = gathered(mesh)
    for side, (axis, at) in sides.items():
        area = lx * ly * lz / place[3 + axis]
        assert found["facets", f"a {side}"][1] == pytest.approx(area)
        if whole is not None:
            nodes = whole.x[np.unique(whole.facets_of(f"a {side}"))]
            np.testing.assert_allclose(nodes[:, axis], at, atol=1e-12)
    if whole is not None and kind == "hexahedra":
        np.testing.assert_allclose(measures(whole).sum(), lx * ly * lz + 1)
        assert len(whole.cells) == 4 * 1 * 2 + 2**3


@pytest.mark.mpi
@KINDS
def test_a_bar_in_tension(comm, kind):
    """Its force is E times strain times area, its sides move in by Poisson's ratio."""
    mesh = archord.boxes({"bar": (0, 0, 0, 3, 1, 2)}, 1.0, kind, comm)
    system = System(
        Problem(
            mesh,
            bodies=[Body("bar", Elastic(E, NU))],
            supports=[
                Support("bar left", fixed="x"),
                Support("bar bottom", fixed="y"),
                Support("bar back", fixed="z"),
            ],
            loads=[Load("pull", on="bar right", direction="x", displacement=0.03)],
            steps=1,
        )
    )
    system.solve([1.0])
    assert system.drive_force("pull") == pytest.approx(E * 0.01 * 2, rel=1e-12)
    u = system.equilibrium.displacement()
    x = system.V.tabulate_dof_coordinates()
    np.testing.assert_allclose(u, x * [0.01, -NU * 0.01, -NU * 0.01], rtol=0, atol=1e-13)


def test_another_kind_is_refused():
    with pytest.raises(archord.InputError, match='kind must be "tetrahedra" or "hexahedra", not'):
        archord.boxes({"a": (0, 0, 0, 1, 1, 1)}, 0.5, "prisms", MPI.COMM_SELF)

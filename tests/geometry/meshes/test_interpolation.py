"""Interpolation between meshes of curved cells."""

import basix
import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.basis import HEXAHEDRON, TETRAHEDRON, TRIANGLE, element_of
from archord.geometry.meshes.interpolation import Interpolation
from archord.geometry.shapes.pin_in_block import quarter_joint
from tests.geometry.shapes.measures import Cells


def nodes_of(mesh, cells):
    return mesh.geometry.x[:, :2], mesh.geometry.dofmap[cells]


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("body", list(Cells))
def test_linear_fields_are_kept_everywhere_and_curved_ones_to_the_order_of_the_mesh(degree, body):
    """Isoparametric cells hold linear fields exactly, beyond their edges too; others converge."""
    fine = quarter_joint(MPI.COMM_SELF, 1.0, 0.005, 10.0, 0.1, 0.3, degree=degree)
    x, cells = nodes_of(fine.mesh, fine.cells.find(body))
    to = x[np.unique(cells)]
    to = np.append(to, to[to[:, 0] < 1e-9] - [0.05, 0.0], axis=0)  # in no cell's bounding box
    errors = []
    for size in (0.3, 0.15):
        coarse = quarter_joint(MPI.COMM_SELF, 1.0, 0.005, 10.0, size, size, degree=degree)
        y, of = nodes_of(coarse.mesh, coarse.cells.find(body))
        f = Interpolation(TRIANGLE, y, of, to)
        linear = lambda z: np.stack([1 + 2 * z[:, 0] - z[:, 1], z[:, 1]], axis=1)  # noqa: E731
        assert f(linear(y)) == pytest.approx(linear(to), abs=1e-11)
        wave = lambda z: np.sin(z[:, :1]) * np.cos(z[:, 1:])  # noqa: E731
        near = (np.hypot(*to.T) < 1.5) & (to[:, 0] >= 0)
        errors.append(np.sqrt(np.mean((f(wave(y)) - wave(to))[near] ** 2)))
    assert errors[1] < errors[0] / 2**degree
    assert errors[1] < 0.01


@pytest.mark.parametrize(
    ("kind", "nodes"), [(TETRAHEDRON, 4), (TETRAHEDRON, 10), (HEXAHEDRON, 20), (HEXAHEDRON, 27)]
)
def test_linear_fields_are_kept_in_a_distorted_cell_in_space(kind, nodes):
    """Within it, and a little outside."""
    X = element_of(kind, nodes).points
    bent = X + 0.05 * X[:, [1, 2, 0]] * X[:, [2, 0, 1]]
    inside = basix.create_lattice(kind, 4, basix.LatticeType.equispaced, exterior=True)
    to = np.append(bent.mean(axis=0) + 0.9 * (inside - inside.mean(axis=0)), [[-0.1, 0.2, 0.1]], 0)
    interpolate = Interpolation(kind, bent, np.arange(nodes)[None], to)
    assert interpolate(bent) == pytest.approx(to, abs=1e-10)
    constant = np.ones((nodes, 1))
    assert interpolate(constant) == pytest.approx(1.0, abs=1e-12)

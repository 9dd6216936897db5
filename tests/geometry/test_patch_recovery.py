"""Nodal values from those at integration points: what is reproduced, and how fast the error falls,
also at edges."""

from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.meshes.second_order import SecondOrder
from archord.geometry.patch_recovery import PatchRecovery
from archord.materials.elasticity import Elastic, principal_stresses, von_mises
from archord.output.fields import FieldWriter, collect_fields, collect_mesh
from archord.postprocess.arrays.fields import read_fields
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Problem
from tests.solver.parts import quarter_annulus

A = 1.0
B = 2.0
E = 1.0
NU = 0.3


def ring(size, comm=MPI.COMM_SELF, **options):
    """A quarter of a thick-walled cylinder whose inner wall moves outward by 1."""
    supports = [Dirichlet("wall", "inner", k, lambda x, k=k: x[:, k] / A) for k in range(2)]
    supports += [Dirichlet("x", "x", 1), Dirichlet("y", "y", 0)]
    mesh = quarter_annulus(comm, A, B, size, **options)
    return System(Problem(mesh, [Body("ring", Elastic(E, NU, "strain"))], supports=supports))


@pytest.mark.parametrize("quads", [False, True])
@pytest.mark.parametrize(("degree", "size"), [(2, 0.3), (2, 0.9), (1, 0.3)])
def test_polynomials_of_the_degree_are_reproduced_at_every_node(degree, size, quads):
    """Also where walls are one cell thick and vertices have no neighbour inside, and where some
    cells have fewer points."""
    order = MeshOrder(ring(size, quads=quads))
    nodes = SecondOrder(order.kind, order.nodes_of_cell)
    x = nodes(order.coordinates)[:, :2]
    places = collect_mesh(order)["points/coordinates"]
    corners = nodes.cells[:, : nodes.corners]
    places[::3, 5:] = np.nan
    recovery = PatchRecovery(order.kind, x, corners, nodes.between, places, degree)

    def polynomial(x):
        powers = [
            x[..., 0] ** i * x[..., 1] ** j
            for i in range(degree + 1)
            for j in range(degree + 1 - i)
        ]
        return np.stack([sum((k + 1) * p for k, p in enumerate(powers)), powers[-1]], axis=-1)

    np.testing.assert_allclose(recovery(polynomial(places)), polynomial(x), rtol=1e-9, atol=1e-9)


def recovered(system, folder):
    """Coordinates and stress of the nodes, as a run writes and reads them."""
    order = MeshOrder(system)
    writer = FieldWriter(folder, order, collect_mesh(order))
    writer.write(1.0, collect_fields(order))
    return read_fields(folder, of_run(system), 1)


def of_run(system):
    """What readers ask of the scene of a run."""
    analysis = SimpleNamespace(plane=system.problem.kinematics.name)
    return SimpleNamespace(output=SimpleNamespace(fields=True), analysis=analysis)


@pytest.mark.parametrize("quads", [False, True])
def test_stress_of_lames_cylinder_converges_faster_than_that_of_its_cells(tmp_path, quads):
    """Hoop and radial stress at all nodes: the largest error of order 2, which within cells the
    mean one has, and the mean one of order 2.5. Errors are over the pressure; the last ones are
    those of the inner wall."""
    errors = []
    for size in (0.2, 0.1, 0.05):
        system = ring(size, quads=quads)
        system.solve([1.0])
        fields = recovered(system, tmp_path)
        pressure = E / (1 + NU) / (A**2 / (B**2 - A**2) * ((1 - 2 * NU) * A + B**2 / A))
        r = np.hypot(*fields.coordinates.T)
        (c, s) = fields.coordinates.T / r
        (xx, yy, zz, xy) = fields.stress.T
        hoop = xx * s**2 + yy * c**2 - 2 * xy * c * s
        radial = xx * c**2 + yy * s**2 + 2 * xy * c * s
        lame = pressure * A**2 / (B**2 - A**2) * (1 + np.outer([1, -1], B**2 / r**2))
        misfit = np.abs([hoop - lame[0], radial - lame[1]]) / pressure
        inner = fields.edges["inner"]
        np.testing.assert_allclose(r[inner], A, rtol=1e-6)
        errors.append(
            [
                misfit.max(),
                np.sqrt((misfit**2).mean()),
                *np.sqrt((misfit[:, inner] ** 2).mean(axis=(1, 2))),
            ]
        )
        np.testing.assert_allclose(zz, NU * (xx + yy), atol=1e-12)
    errors = np.array(errors)
    assert (np.log2(errors[0] / errors[-1]) / 2 > [1.9, 2.4, 2.2, 1.9]).all(), errors
    assert (errors[-1] < 2e-3).all()


def test_principal_stresses_are_eigenvalues_and_their_angle_an_eigenvector():
    """And von Mises' stress is theirs."""
    stress = np.random.default_rng(1).normal(size=(50, 4))
    values, angle = principal_stresses(stress)
    tensor = np.zeros((50, 3, 3))
    tensor[:, [0, 1, 2, 0, 1], [0, 1, 2, 1, 0]] = stress[:, [0, 1, 2, 3, 3]]
    np.testing.assert_allclose(values, np.linalg.eigvalsh(tensor)[:, ::-1], atol=1e-12)
    axis = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    along = np.einsum("ni,nij,nj->n", axis, tensor, axis)
    np.testing.assert_allclose(
        np.einsum("nij,nj->ni", tensor, axis), along[:, None] * axis, atol=1e-12
    )
    assert (along >= (stress[:, 0] + stress[:, 1]) / 2).all()
    p1, p2, p3 = values.T
    np.testing.assert_allclose(
        von_mises(stress) ** 2, ((p1 - p2) ** 2 + (p2 - p3) ** 2 + (p3 - p1) ** 2) / 2
    )


@pytest.mark.mpi
def test_all_ranks_together_write_what_one_writes(comm, tmp_path_factory):
    """Fields of nodes and points, and the named edges."""
    found = []
    for communicator in (comm, MPI.COMM_SELF):
        system = ring(0.3, communicator)
        system.solve([1.0])
        order = MeshOrder(system)
        found.append((collect_mesh(order), collect_fields(order), order))
    if comm.rank == 0:
        (mesh, fields, order), (alone, fields_alone, _) = found
        for name, values in (mesh | fields).items():
            np.testing.assert_allclose(
                values, (alone | fields_alone)[name], atol=1e-9, err_msg=name
            )
        assert {"edges/inner", "points/coordinates", "mesh/body"} <= set(mesh)
        folders = [tmp_path_factory.mktemp("run") for _ in found]
        read = []
        for folder, (m, f, o) in zip(folders, found, strict=True):
            writer = FieldWriter(folder, o, m, points=True)
            writer.write(1.0, f)
            read.append(read_fields(folder, of_run(system), 1))
        np.testing.assert_allclose(read[0].stress, read[1].stress, atol=1e-9)
        np.testing.assert_array_equal(read[0].edges["inner"], read[1].edges["inner"])


def test_at_corners_near_points_count_more():
    """At a corner, whose cell shows no vertex inside, the value is the value of a polynomial that
    is fitted to two layers of cells, with weights 1 / (0.05 + d^2) of the distances over the
    largest one."""
    order = MeshOrder(ring(0.2, quads=True))
    nodes = SecondOrder(order.kind, order.nodes_of_cell)
    x = nodes(order.coordinates)[:, :2]
    places = collect_mesh(order)["points/coordinates"]
    cells = nodes.cells[:, : nodes.corners]
    recovery = PatchRecovery(order.kind, x, cells, nodes.between, places, 2)
    found = recovery((places**3).sum(axis=-1)[..., None])[:, 0]
    for end in ((A, 0), (B, 0), (0, A), (0, B)):
        corner = np.linalg.norm(x - end, axis=1).argmin()
        own = cells[(cells == corner).any(axis=1)]
        patch = np.isin(cells, own).any(axis=1)
        assert len(own) == 1 < patch.sum()
        ray = places[patch].reshape(-1, 2) - x[corner]
        square = (ray**2).sum(axis=1)
        root = np.sqrt(1 / (0.05 + square / square.max()))
        a, b = ray.T
        basis = np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=1)
        values = ((ray + x[corner]) ** 3).sum(axis=1)
        fit, *_ = np.linalg.lstsq(basis * root[:, None], values * root)
        assert found[corner] == pytest.approx(fit[0], rel=1e-7)
        plain, *_ = np.linalg.lstsq(basis, values)
        assert abs(plain[0] - fit[0]) > 1e-5

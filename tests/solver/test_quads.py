"""Quadrilaterals, and geometries of another order than the displacements: the laws that triangles
obey."""

from __future__ import annotations

from itertools import product

import h5py
import meshio
import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.basis import (
    QUADRILATERAL,
    Array,
    CellBasis,
    bulk_quadrature,
    lagrange_element,
)
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.interpolation import Interpolation
from archord.geometry.meshes.second_order import SecondOrder
from archord.geometry.strain import PointStrain
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematics import PLANE_STRAIN
from archord.output.fields import FieldWriter, collect_fields, collect_mesh
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.problem import Body, Dirichlet, Interaction, Problem
from tests.solver.parts import ELASTIC, NU, PERFECT, E, blocks, coordinates, quarter_annulus, solve
from tests.solver.solving import SEVERAL

DEPTH = 0.01
PRESSED = [
    Dirichlet("base", "base", 1),
    Dirichlet("lid", "lid", 1, -1.0),
    Dirichlet("left", "left", 0),
]
every_order = pytest.mark.parametrize("order", [1, 2, 3])
every_degree = pytest.mark.parametrize("degree", [2, 3])
every_cell = pytest.mark.parametrize("quads", [False, True], ids=["triangles", "quads"])
ALL = list(product((2, 3), (1, 2, 3), (False, True)))
# one rank is compared with itself: what it writes is looked at
FEW = [(2, 2, True), (2, 3, False), (3, 1, True), (3, 3, False)]


def pressed(comm, order, degree, quads, upper=ELASTIC, loads=(DEPTH,), edges=(4, 6)):
    """Two blocks pressed onto each other."""
    bodies = [Body("lower", ELASTIC), Body("upper", upper)]
    joint = Interaction("joint", ("upper bottom", "lower top"))
    mesh = blocks(comm, *edges, order=order, quads=quads)
    return solve(Problem(mesh, bodies, [joint], PRESSED, degree=degree), loads)


@pytest.mark.mpi
@every_cell
@every_order
@every_degree
def test_contact_patch(order, degree, quads, comm):
    """Uniform pressure and linear displacement across lines whose nodes do not match, whatever the
    cells."""
    system = pressed(comm, order, degree, quads)
    pressure = E / (1 - NU**2) * DEPTH / 2
    x = coordinates(system.V)
    assert -system.reaction("lid")[1] == pytest.approx(pressure, rel=1e-9)
    for pair in system.contact.pairs:
        np.testing.assert_allclose(pair.pressure, pressure, rtol=1e-9)
    fields = collect_fields(MeshOrder(system), at_points=False)
    touching = fields["contact_state"] > 0
    np.testing.assert_allclose(fields["contact_pressure"][touching], pressure, rtol=1e-9)
    assert comm.bcast(int(touching.sum())) == 4 + 6
    u = system.equilibrium.displacement()
    expected = DEPTH / 2 * np.stack([NU / (1 - NU) * x[:, 0], -1 - x[:, 1]], axis=1)
    np.testing.assert_allclose(u, expected, rtol=0, atol=1e-9 * DEPTH)


@every_degree
def test_the_bulk_rule_has_full_rank_and_a_smaller_one_has_not(degree):
    """A free cell has three deformations without energy, its rigid motions; with p^2 points it has
    three more."""
    element = lagrange_element(QUADRILATERAL, degree)
    found = []
    for X in (
        bulk_quadrature(QUADRILATERAL, degree)[0],
        bulk_quadrature(QUADRILATERAL, degree - 1)[0],
    ):
        gradient = np.moveaxis(element.tabulate(1, X)[1:, ..., 0], 0, -1)
        nodes = np.arange(element.dim, dtype=np.int32)[None]
        basis = CellBasis(np.zeros(0), gradient[None], np.zeros(0), np.zeros(0), np.zeros(0))
        B = PointStrain(PLANE_STRAIN, basis, nodes).matrix().reshape(-1, 2 * element.dim)
        found.append(2 * element.dim - np.linalg.matrix_rank(B, tol=1e-9))
    assert found == [3, 6]


@every_degree
@every_cell
def test_lames_cylinder_converges(degree, quads):
    """Radial displacement under a given one of the inner wall: cells of an eighth take two powers
    of eight off, and more of third order."""
    errors = []
    for size in (0.5, 0.0625):
        mesh = quarter_annulus(MPI.COMM_SELF, 1.0, 2.0, size, quads=quads, order=degree)
        supports = [Dirichlet("wall", "inner", k, lambda x, k=k: x[:, k]) for k in range(2)]
        supports += [Dirichlet("x", "x", 1), Dirichlet("y", "y", 0)]
        system = solve(
            Problem(mesh, [Body("ring", ELASTIC)], supports=supports, degree=degree), [DEPTH]
        )
        x = coordinates(system.V)
        u = system.equilibrium.displacement()
        r = np.linalg.norm(x, axis=1)
        lame = ((1 - 2 * NU) * r + 4 / r) / ((1 - 2 * NU) + 4) * DEPTH
        errors.append(np.abs((u * x).sum(axis=1) / r - lame).max() / DEPTH)
    assert errors[1] < errors[0] / 8 ** (degree - 0.2)


def punch(gmsh):
    """A block of 5 by 3, of which the "punch" is the unit of its top at the plane of symmetry,
    "left"."""
    geo = gmsh.model.geo
    gap = 0.2
    points = [geo.addPoint(x, y, 0) for x, y in ((0, -3), (5, -3), (5, 0), (1, 0), (0, 0))]
    lines = [geo.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    face = geo.addPlaneSurface([geo.addCurveLoop(lines)])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(2, [face], name="ground")
    for tag, (line, name) in enumerate(
        zip(lines, ("base", "right", "top", "punch", "left"), strict=True), 1
    ):
        gmsh.model.addPhysicalGroup(1, [line], tag, name)
    size = gmsh.model.mesh.field.add("MathEval")
    gmsh.model.mesh.field.setString(size, "F", f"{gap} * (1 + 0.5 * Sqrt((x - 1)^2 + y^2))")
    gmsh.model.mesh.field.setAsBackgroundMesh(size)


@every_cell
def test_fully_plastic_cells_do_not_lock(quads):
    """A rough rigid punch on perfectly plastic ground: its force stands still, a tenth above
    Prandtl's (2 + pi) k."""
    ground = Body("ground", J2Material(1.0, 0.3, "strain", LinearHardening(0.001)))
    fixed = [("base", 0), ("base", 1), ("right", 0), ("left", 0), ("punch", 0)]
    supports = [
        *(Dirichlet(name, name, axis) for name, axis in fixed),
        Dirichlet("punch", "punch", 1, -1.0),
    ]
    system = solve(
        Problem(gmsh_to_mesh(MPI.COMM_SELF, punch, quads=quads), [ground], supports=supports),
        [1e-9],
    )
    force = []
    for loads in (np.linspace(0, 0.06, 13)[1:], [0.07]):
        system.solve(loads)
        force.append(-system.reaction("punch")[1] / ((2 + np.pi) * 0.001 / np.sqrt(3)))
    assert 1 < force[0] < 1.11
    assert force[1] < 1.002 * force[0]


@pytest.mark.mpi
@pytest.mark.parametrize(("degree", "order", "quads"), ALL if SEVERAL else FEW)
def test_fields_and_states_do_not_depend_on_the_ranks(degree, order, quads, comm, tmp_path):
    """Nodes and cells come in one order; what is spread is what was collected; meshio reads
    the file."""
    systems = [
        pressed(c, order, degree, quads, PERFECT, [DEPTH, 2 * DEPTH]) for c in (comm, MPI.COMM_SELF)
    ]
    whole, alone = (MeshOrder(system) for system in systems)
    u = systems[0].equilibrium.displacement()
    np.testing.assert_array_equal(whole.spread(whole.collect(u)), u)
    mesh = collect_mesh(whole)
    fields = collect_fields(whole)
    expected = collect_mesh(alone) | collect_fields(alone)
    if comm.rank == 0:
        assert whole.mesh_digest() == alone.mesh_digest()
        for name, values in expected.items():
            np.testing.assert_allclose(
                (mesh | fields)[name],
                values,
                rtol=0,
                atol=1e-7 * np.abs(values).max(),
                err_msg=name,
            )
        FieldWriter(tmp_path, whole, mesh).write(1.0, fields)
        with meshio.xdmf.TimeSeriesReader(tmp_path / "fields.xdmf") as file:
            x, (cells,) = file.read_points_cells()
            displacement = file.read_data(0)[1]["displacement"]
        k = 4 if quads else 3
        assert cells.type == ("quad9" if quads else "triangle6")
        middles = (x[cells.data[:, :k]] + x[np.roll(cells.data[:, :k], -1, axis=1)]) / 2
        np.testing.assert_allclose(x[cells.data[:, k : 2 * k]], middles, atol=1e-14)
        if quads:
            np.testing.assert_allclose(
                x[cells.data[:, 8]], x[cells.data[:, :4]].mean(axis=1), atol=0.02
            )
        assert np.ptp(displacement[:, 1]) == pytest.approx(
            np.ptp(fields["displacement"][:, 1]), rel=1e-9
        )
        with h5py.File(tmp_path / "fields.h5") as file:
            assert file["mesh/cells"].shape == cells.data.shape
            lid = x[file["edges/lid"][()]]
        np.testing.assert_allclose(lid[..., 1], 1, atol=1e-14)
        np.testing.assert_allclose(lid[:, 1], lid[:, ::2].mean(axis=1), atol=1e-14)
    comm.barrier()


@every_degree
def test_guesses_from_quads(degree):
    """Isoparametric quads hold linear fields exactly, beyond their edges too."""
    coarse, fine = (
        quarter_annulus(MPI.COMM_SELF, 1.0, 2.0, h, quads=True, order=degree).mesh
        for h in (0.5, 0.2)
    )
    x = coarse.geometry.x[:, :2]
    to = fine.geometry.x[:, :2]
    linear = lambda z: np.stack([1 + 2 * z[:, 0] - z[:, 1], z[:, 1]], axis=1)  # noqa: E731
    onto = Interpolation(QUADRILATERAL, x, coarse.geometry.dofmap, to)
    assert onto(linear(x)) == pytest.approx(linear(to), abs=1e-11)
    onto = Interpolation(QUADRILATERAL, x[:, :2], coarse.geometry.dofmap, to[:0])
    assert onto(linear(x)).shape == (0, 2)


def test_middles_of_third_order_quads_are_exact():
    """A product of cubics is found at the middles of edges and cells; vertices stay what they
    are."""
    x = lagrange_element(QUADRILATERAL, 3).points

    def f(p: Array) -> Array:
        return p[:, :1] ** 3 * (1 + p[:, 1:] ** 3) - 2 * p[:, 1:] ** 2 * p[:, :1]

    second = SecondOrder(QUADRILATERAL, np.arange(16)[None])
    at = second(x)[second.cells[0]]
    np.testing.assert_allclose(at, lagrange_element(QUADRILATERAL, 2).points, atol=1e-15)
    np.testing.assert_allclose(second(f(x))[second.cells[0]], f(at), rtol=0, atol=1e-14)

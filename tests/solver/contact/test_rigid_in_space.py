"""Rigid balls and cylinders that press bodies in space."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from dolfinx.mesh import CellType
from mpi4py import MPI

from archord import (
    Body,
    Elastic,
    Interaction,
    Load,
    Problem,
    RigidBall,
    RigidCircle,
    RigidCylinder,
    Support,
)
from archord.solver.path.system import System
from tests.materials.test_space import ASKEW
from tests.solver.space import box
from tests.solver.test_space import rectangle

E = 1000.0
STRAIGHT = np.eye(3)
RADIUS = 2.0
CELLS = (2, 4, 2)
SIZE = (1.0, 2.0, 1.0)
OVER = np.array([1.0 + RADIUS, 0.9, 0.45])  # the centre over the face x1
SLANTED = np.array([0.1, -0.3, 1.0])  # of an axis, which the face tilts under
MOVE = np.array([-0.04, 0.01, 0.015])
DISCS = {
    "ball": lambda centre, radius, turn: RigidBall(turn @ centre, radius),
    "cylinder": lambda centre, radius, turn: RigidCylinder(
        turn @ centre, radius, turn @ (SLANTED * [0.0, 1.0, 1.0])
    ),
}
every_disc = pytest.mark.parametrize("disc", DISCS.values(), ids=DISCS)


def problem(mesh, disc, move, held=(), friction=0.0, stress=1.0, **options):
    """A box on its side x0 under a disc, which goes down and then aside."""
    down = np.zeros(len(move))
    down[0] = move[0]
    loads = [
        Load(f"by {axis}", on="press", direction=axis, displacement=stages)
        for axis, *stages in zip("xyz", options.pop("down", down), move, strict=False)
    ]
    supports = [Support("x0"), *(Support(side, fixed="z") for side in held)]
    contact = Interaction("press", (disc, "x1"), friction=friction)
    body = Body("box", Elastic(E * stress, 0.3))
    return Problem(mesh, [body], [contact], supports, loads, tolerance=1e-12, steps=1, **options)


def solved(given):
    system = System(given)
    system.solve()
    return system


def pressed(comm, disc, turn=STRAIGHT, length=1.0, stress=1.0, friction=0.3, strain="small"):
    """Such a box in space, turned by ``turn``, in units whose length and stress are numbers as
    many times as large."""
    mesh = box(comm, CELLS, SIZE, CellType.hexahedron)
    mesh.mesh.geometry.x[:] = length * mesh.mesh.geometry.x @ turn.T
    move = length * turn @ MOVE
    down = length * turn @ (MOVE * [1.0, 0.0, 0.0])
    given = problem(
        mesh,
        disc(length * OVER, length * RADIUS, turn),
        move,
        friction=friction,
        stress=stress,
        down=down,
        strain=strain,
    )
    return solved(given)


def told(system, turn=STRAIGHT, length=1.0, stress=1.0):
    """Forces, moments, pressures and energies in the first units."""
    force = stress * length**2
    pair = system.equilibrium.contact.pairs[0]
    comm = pair.surface.comm
    shears = np.linalg.norm(pair.shears, axis=-1)
    energies = [*system.energies(), system.friction_dissipation()]
    return {
        "reaction": turn.T @ system.reaction("x0") / force,
        "contact": turn.T @ system.contact_force("press") / force,
        "moment": turn.T
        @ system.equilibrium.contact.moments("press", np.zeros(3), deformed=False)
        / (force * length),
        "pressure": comm.allreduce(pair.pressure.max(initial=0.0), MPI.MAX) / stress,
        "shear": comm.allreduce(shears.max(initial=0.0), MPI.MAX) / stress,
        "energies": np.array(energies) / (force * length),
        "drives": turn.T @ [system.drive_force(f"by {axis}") for axis in "xyz"] / force,
    }


def assert_alike(one, other, tolerance=1e-9):
    for name, value in one.items():
        size = np.abs(value).max()
        np.testing.assert_allclose(other[name], value, rtol=0, atol=tolerance * size, err_msg=name)


@pytest.mark.parametrize("strain", ["small", "large"])
@every_disc
def test_a_problem_may_be_turned(disc, strain):
    """By 37 degrees about (1, 2, 3), friction and history included."""
    one = told(pressed(MPI.COMM_SELF, disc, strain=strain))
    assert one["energies"][-1] > 0
    other = told(pressed(MPI.COMM_SELF, disc, ASKEW, strain=strain), ASKEW)
    assert_alike(one, other)


@every_disc
def test_units_do_not_matter(disc):
    """Metres and pascals instead of millimetres and megapascals."""
    units = {"length": 1e-3, "stress": 1e6}
    one = told(pressed(MPI.COMM_SELF, disc))
    assert_alike(one, told(pressed(MPI.COMM_SELF, disc, **units), **units))


@pytest.mark.mpi
@every_disc
def test_ranks_do_not_matter(disc, comm):
    assert_alike(told(pressed(MPI.COMM_SELF, disc)), told(pressed(comm, disc)))


@pytest.mark.parametrize("strain", ["small", "large"])
@every_disc
def test_forces_balance(disc, strain):
    """Of the disc, the contact and the support."""
    found = told(pressed(MPI.COMM_SELF, disc, strain=strain))
    size = np.abs(found["contact"]).max()
    np.testing.assert_allclose(found["contact"] + found["reaction"], 0, atol=1e-9 * size)
    np.testing.assert_allclose(found["contact"], found["drives"], atol=1e-9 * size)


@pytest.mark.parametrize(
    ("friction", "cells", "part"), [(0.0, (8, 24), 5e-4), (0.2, (4, 12), 2e-3)]
)
def test_a_layer_between_held_faces_is_plane_strain(friction, cells, part):
    """Under a cylinder along z, wherever on its axis the centre is, and under the same disc, up to
    a ``part`` as large as the errors of these meshes."""
    plane = problem(
        rectangle(MPI.COMM_SELF, cells, SIZE[:2]),
        RigidCircle(OVER[:2], RADIUS),
        MOVE[:2],
        friction=friction,
    )
    layer = problem(
        box(MPI.COMM_SELF, (*cells, 1), (*SIZE[:2], 0.05), CellType.hexahedron),
        RigidCylinder([*OVER[:2], 7.0], RADIUS, (0, 0, -3)),
        [*MOVE[:2], 0.0],
        held=("z0", "z1"),
        friction=friction,
    )
    systems = [solved(plane), solved(layer)]
    in_plane, in_space = (system.contact_force("press") for system in systems)
    size = np.linalg.norm(in_plane)
    np.testing.assert_allclose(in_space[:2] / 0.05, in_plane, rtol=0, atol=part * size)
    of_plane, of_space = (system.equilibrium.contact.pairs[0].pressure.max() for system in systems)
    assert of_space == pytest.approx(of_plane, rel=10 * part)


def test_a_cylinder_drags_along_its_axis():
    """Where it has slid far, every point that touches carries mu times its pressure along the
    axis, and no more anywhere before."""
    friction = 0.2
    mesh = box(MPI.COMM_SELF, CELLS, SIZE, CellType.hexahedron)
    disc = RigidCylinder(OVER, RADIUS)
    given = problem(mesh, disc, [-0.02, 0.0, 0.1], friction=friction)
    system = solved(given)
    pair = system.equilibrium.contact.pairs[0]
    pressure = pair.pressure
    touches = pressure > 0
    shears = np.linalg.norm(pair.shears, axis=-1)
    assert (shears <= friction * pressure * (1 + 1e-9) + 1e-12).all()
    np.testing.assert_allclose(shears[touches], friction * pressure[touches], rtol=1e-9)
    along, _, _ = system.contact_force("press")[::-1]
    assert along == pytest.approx(friction * pair.integral(pair.traction[:, 0]), rel=0.01)


def test_a_force_moves_a_cylinder_as_far_as_it_takes():
    """The displacement under the force of a displacement is that displacement."""
    mesh = box(MPI.COMM_SELF, CELLS, SIZE, CellType.hexahedron)
    disc = RigidCylinder(OVER, RADIUS)
    contact = Interaction("press", (disc, "x1"))
    body = Body("box", Elastic(E, 0.3))

    def under(**amount):
        load = Load("down", on="press", direction="x", **amount)
        return solved(Problem(mesh, [body], [contact], [Support("x0")], [load], steps=2))

    moved = under(displacement=-0.03)
    force = moved.drive_force("down")
    assert under(force=force).drive_displacement("down") == pytest.approx(-0.03, rel=1e-8)


@every_disc
@pytest.mark.parametrize("kinematics", ["current", "reference"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_tangent_is_the_derivative_of_the_forces(disc, kinematics, friction):
    """By central differences in random directions, of the disc, too."""
    mesh = box(MPI.COMM_SELF, CELLS, SIZE, CellType.tetrahedron)
    contact = Interaction(
        "press",
        (disc(OVER, RADIUS, STRAIGHT), "x1"),
        friction=friction,
        kinematics=kinematics,
    )
    loads = [Load(f"by {a}", on="press", direction=a, displacement=-0.02) for a in "xyz"]
    body = Body("box", Elastic(E, 0.3))
    system = System(Problem(mesh, [body], [contact], [Support("x0")], loads))
    contact = system.equilibrium.contact
    rng = np.random.default_rng(5)
    u = 2e-3 * rng.normal(size=(len(system.V.tabulate_dof_coordinates()), 3))
    levels = np.array([-0.03, 0.004, 0.003])

    def forces(u, levels):
        contact.move(levels)
        contact.evaluate(u)
        force = np.zeros_like(u)
        contact.add_force(force)
        return np.append(force, contact.resultant())

    forces(u, levels)
    contact.begin(u)
    u = u + 1e-3 * rng.normal(size=u.shape)
    levels = levels + np.array([-0.002, 0.003, 0.002])
    forces(u, levels)
    pair = contact.pairs[0]
    assert 0 < pair.active.sum() < pair.active.size
    n = u.size + 3
    rows, columns, blocks = contact.tangent.rows, contact.tangent.columns, contact.tangent.blocks()
    K = sp.csr_matrix((n, n))
    for i, j in np.ndindex(3, 3):
        K += sp.coo_matrix((blocks[:, i, j], (3 * rows + i, 3 * columns + j)), shape=(n, n)).tocsr()
    h = 1e-7
    for _ in range(3):
        du = rng.normal(size=u.shape)
        dl = rng.normal(size=3)
        ahead, behind = (forces(u + s * h * du, levels + s * h * dl) for s in (1, -1))
        difference = (ahead - behind) / (2 * h)
        error = K @ np.append(du, dl) - difference
        assert np.linalg.norm(error) < 1e-6 * np.linalg.norm(difference)


def test_no_pressure_acts_on_a_disc():
    mesh = box(MPI.COMM_SELF, (1, 1, 1))
    contact = Interaction("press", (RigidBall(OVER, RADIUS), "x1"))
    loads = [Load("blow", on="press", pressure=1.0)]
    given = Problem(mesh, [Body("box", Elastic(E, 0.3))], [contact], [Support("x0")], loads)
    with pytest.raises(ValueError, match="the load 'blow' is a pressure: 'press' has no facets"):
        System(given)


def test_points_that_face_away_carry_nothing():
    """All sides of a box may be of the contact surface: also the one below a cylinder whose
    normal points from it, and those across the axis."""
    disc = RigidCylinder((0.0, 0.0, 3.0), 1.0)
    x = np.array([[0.0, -2.0, 0.0], [0.0, -3.0, 0.0], [0.0, -2.5, 1.0], [0.0, 0.0, 0.0]])
    outward = np.array([[0.0, 1, 0], [0.0, -1, 0], [0.0, 0, 1], [0.0, 1, 0]])
    found = disc.closest_point(x, outward, np.zeros((1, 3)))
    assert found.found.tolist() == [True, False, False, False]
    assert all(np.isfinite(values).all() for values in vars(found).values())
    np.testing.assert_array_equal(found.point[0], [0, -1, 0])


def test_a_ball_presses_as_hertz_says():
    """Radius of contact and largest pressure under the force, on a quarter of a block 12 times as
    wide and deep as the contact, with about four elements along its radius."""
    radius = 10.0
    mesh = box(MPI.COMM_SELF, (8, 8, 8), kind=CellType.hexahedron)
    mesh.mesh.geometry.x[:] = 12.0 * mesh.mesh.geometry.x**2.2
    contact = Interaction("press", (RigidBall((0.0, 0.0, -radius), radius), "z0"))
    load = Load("down", on="press", direction="z", displacement=0.1)
    held = [Support("z1"), Support("x0", fixed="x"), Support("y0", fixed="y")]
    body = Body("box", Elastic(E, 0.3))
    system = solved(Problem(mesh, [body], [contact], held, [load], steps=1, symmetry=4))
    force = system.drive_force("down")
    pair = system.equilibrium.contact.pairs[0]
    area = 4 * pair.integral(pair.active)
    hertz = (3 * force * radius * (1 - 0.3**2) / (4 * E)) ** (1 / 3)
    assert np.sqrt(area / np.pi) == pytest.approx(hertz, rel=0.03)
    assert pair.pressure.max() == pytest.approx(1.5 * force / (np.pi * hertz**2), rel=0.03)

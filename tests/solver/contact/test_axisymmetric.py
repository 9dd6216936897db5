"""Contact around an axis: a patch test, tangents by finite differences, balances, and Hertz."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.curve import RigidCircle
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.materials.elasticity import Elastic
from archord.materials.finite import LargeStrain
from archord.materials.kinematics import AXISYMMETRIC
from archord.solver.conditions import Dirichlet
from archord.solver.contact.contact import Contact
from archord.solver.contact.interaction import Interface
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.path.system import System
from archord.solver.problem import Body, Interaction, Problem, Rigid
from tests.solver.contact.test_tangent import matrix
from tests.solver.parts import blocks, commit, contact_force, coordinates, nodes_of, solve, space

E = 1000.0
NU = 0.3

STEEL = Elastic(E, NU, "axisymmetric")
DEPTH = 0.01
AREA = np.pi  # of cylinders of radius 1


def cylinders(law="frictionless", kinematics="current", **options) -> Problem:
    """Two cylinders of radius and height 1 on top of each other, whose meshes do not match, the
    upper pressed down."""
    interaction = Interaction(
        "contact", ("upper bottom", "lower top"), law=law, kinematics=kinematics, **options
    )
    held = [
        Dirichlet("base", "base", 1),
        Dirichlet("lid", "lid", 1, -1.0),
        Dirichlet("axis", "left", 0),
    ]
    return Problem(
        blocks(MPI.COMM_WORLD, 3, 4),
        [Body("lower", STEEL), Body("upper", STEEL)],
        [interaction],
        held,
        kinematics=AXISYMMETRIC,
    )


@pytest.mark.mpi
@pytest.mark.parametrize("kinematics", ["current", "reference"])
@pytest.mark.parametrize("law", ["frictionless", "tied"])
def test_pressed_cylinders_carry_a_uniform_pressure(law, kinematics):
    """Uniaxial stress: the pressure E eps, the force of the whole face, and a radius that grows by
    nu eps."""
    system = solve(cylinders(law, kinematics), [DEPTH])
    strain = DEPTH / 2
    force = E * strain * AREA
    np.testing.assert_allclose(system.contact_force()[1], -force, rtol=1e-9)
    assert system.reaction("lid")[1] == pytest.approx(-force, rel=1e-9)
    assert system.reaction("base")[1] == pytest.approx(force, rel=1e-9)
    for pair in system.contact.pairs:
        np.testing.assert_allclose(pair.pressure, E * strain, rtol=1e-7)
    x = coordinates(system.V)
    u = system.equilibrium.displacement()
    np.testing.assert_allclose(u[:, 0], NU * strain * x[:, 0], atol=1e-8 * DEPTH)
    np.testing.assert_allclose(u[:, 1], -strain * (1 + x[:, 1]), atol=1e-8 * DEPTH)


@pytest.mark.parametrize("strain", ["small", "large"])
@pytest.mark.parametrize("opposite", ["cylinder", "sphere"])
@pytest.mark.parametrize("options", [{}, {"friction": 0.3}, {"law": "tied"}])
def test_the_tangent_is_the_derivative_of_the_forces(strain, opposite, options):
    """With hoop strains, of a body against a body and against a rigid sphere, which moves along
    the axis."""
    mesh = blocks(MPI.COMM_SELF, 3, 4)
    V = space(mesh.mesh)
    material = STEEL if strain == "small" else LargeStrain(STEEL)
    lower = Surface(V, mesh.facets_in("lower top"), material, "lower", AXISYMMETRIC)
    upper = Surface(V, mesh.facets_in("upper bottom"), material, "upper", AXISYMMETRIC)
    sphere = RigidSurface(RigidCircle(np.array([0.0, 4.0]), 4.0), (0.0, -1.0))
    sides = [sphere if opposite == "sphere" else upper, lower]
    contact = Contact(V, [Interface(Interaction("contact", ("0", "1"), **options), sides)])
    draw = np.random.default_rng(0)
    x = coordinates(V)

    def pressed(depth: float) -> np.ndarray:
        u = 1e-3 * draw.normal(size=x.shape)
        u[:, 1] -= depth * (x[:, 1] + 1) / 2 * np.cos(x[:, 0])
        u[nodes_of(V, mesh.cells, mesh.cell_tags("upper")[0]), 1] -= depth
        sphere.motion[:] = [0.0, -2 * depth]
        return u * (x[:, :1] > 0)  # the axis stays

    contact.evaluate(pressed(0.02))
    commit(contact)
    u = pressed(0.04)
    contact_force(contact, u)
    assert contact.n_active() > 0
    n = u.size
    K = matrix(contact, n)[:n, :n]
    h = 1e-7
    for _ in range(3):
        d = draw.normal(size=u.shape)
        before, after = (contact_force(contact, u + sign * h * d).ravel() for sign in (-1, 1))
        difference = (after - before) / (2 * h)
        assert np.linalg.norm(K @ d.ravel() - difference) < 2e-6 * np.linalg.norm(difference)


def test_weights_add_up_to_the_face():
    """The measure is that of the whole ring; gamma bounds the traction by the energy."""
    mesh = blocks(MPI.COMM_SELF, 3, 4)
    side = Surface(space(mesh.mesh), mesh.facets_in("lower top"), STEEL, "", AXISYMMETRIC)
    assert side.weight.sum() == pytest.approx(AREA, rel=1e-12)
    assert np.all(side.gamma > 0)
    assert side.gamma.max() < 10 * side.gamma.min()


RADIUS = 100.0  # so large that strains are small, as Hertz has them
SIZE = 40.0  # of the half space, in contact radii
CONTACT = 0.5  # radius of the contact


def half_space(comm: MPI.Comm):
    """A cylinder below z = 0, fine where a sphere touches it."""

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        far = SIZE * CONTACT
        corners = (0, -far), (far, -far), (far, 0), (2 * CONTACT, 0), (0, 0)
        points = [geo.addPoint(x, y, 0) for x, y in corners]
        ends = zip(points, [*points[1:], points[0]], strict=True)
        lines = [geo.addLine(a, b) for a, b in ends]
        face = geo.addPlaneSurface([geo.addCurveLoop(lines)])
        geo.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="half space")
        for name, k in (("base", [0]), ("wall", [1]), ("top", [2, 3]), ("axis", [4])):
            gmsh.model.addPhysicalGroup(1, [lines[i] for i in k], name=name)
        field = gmsh.model.mesh.field
        field.add("MathEval", 1)
        finest = CONTACT / 16
        field.setString(1, "F", f"{finest} + 0.25 * Max(0, Sqrt(x^2 + y^2) - {1.3 * CONTACT})")
        field.setAsBackgroundMesh(1)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)

    return gmsh_to_mesh(comm, build)


def far_field(x: np.ndarray, force: float) -> np.ndarray:
    """Displacements ``(n, 2)`` of a half space z < 0 under a force down at its origin
    (Boussinesq)."""
    mu = E / (2 * (1 + NU))
    r = x[:, 0]
    depth = -x[:, 1]
    R = np.hypot(r, depth)
    factor = force / (4 * np.pi * mu)
    radial = factor * (r * depth / R**3 - (1 - 2 * NU) * r / (R * (R + depth)))
    down = factor * (depth**2 / R**3 + 2 * (1 - NU) / R)
    return np.stack([radial, -down], axis=1)


@pytest.mark.mpi
@pytest.mark.parametrize("form", ["small", "reference"])
def test_a_rigid_sphere_on_a_half_space_presses_as_hertz_says(form):
    """Force, contact radius and largest pressure within 0.5 %, on at most 3000 nodes; the far
    boundary moves as the half space under a point force."""
    modulus = E / (1 - NU**2)
    approach = CONTACT**2 / RADIUS
    force = 4 / 3 * modulus * np.sqrt(RADIUS) * approach**1.5
    peak = 3 * force / (2 * np.pi * CONTACT**2)
    mesh = half_space(MPI.COMM_WORLD)
    sphere = Rigid(RigidCircle(np.array([0.0, RADIUS]), RADIUS), (0.0, -approach))
    kinematics = "current" if form == "small" else "reference"
    supports = [Dirichlet("axis", "axis", 0)]
    for name in ("base", "wall"):
        supports += [
            Dirichlet(name, name, axis, lambda x, axis=axis: far_field(x, force)[:, axis])
            for axis in (0, 1)
        ]
    interaction = Interaction("contact", (sphere, "top"), kinematics=kinematics)
    problem = Problem(
        mesh, [Body("half space", STEEL)], [interaction], supports, kinematics=AXISYMMETRIC
    )
    system = System(problem)
    system.solve([0.5, 1.0])
    assert system.V.dofmap.index_map.size_global < 3000
    found = -system.contact_force()[1]
    assert found == pytest.approx(force, rel=5e-3)
    (pair,) = system.contact.pairs
    comm = system.comm
    pressed_area = comm.allreduce(float((pair.surface.weight * (pair.pressure > 0)).sum()))
    assert np.sqrt(pressed_area / np.pi) == pytest.approx(CONTACT, rel=2e-2)
    r = pair.surface.point[..., 0]
    inside = r < 0.9 * CONTACT
    second = comm.allreduce(float((pair.surface.weight * pair.pressure * r**2).sum()))
    # the second moment of Hertz's pressure is 2/5 of force times square of the radius
    assert np.sqrt(second / found * 5 / 2) == pytest.approx(CONTACT, rel=5e-3)
    hertz = peak * np.sqrt(np.maximum(1 - (r / CONTACT) ** 2, 0))
    off = np.abs(pair.pressure - hertz)[inside].max(initial=0.0)
    assert comm.allreduce(float(off), op=MPI.MAX) < 0.02 * peak
    near = r < 0.3 * CONTACT
    weight = pair.surface.weight * near
    sums = comm.allreduce(np.array([(weight * pair.pressure).sum(), (weight * hertz).sum()]))
    assert sums[0] == pytest.approx(sums[1], rel=5e-3)


@pytest.mark.parametrize(
    ("centre", "rate", "said"),
    [((1.0, 2.0), (0.0, -1.0), "centre on the axis"), ((0.0, 2.0), (0.1, -1.0), "along the axis")],
)
def test_a_rigid_sphere_stays_on_the_axis(centre, rate, said):
    """Its centre lies there, and it moves along it."""
    mesh = blocks(MPI.COMM_SELF, 3, 4)
    disc = Rigid(RigidCircle(np.array(centre), 1.0), rate)
    contact = Interaction("contact", (disc, "upper top"))
    with pytest.raises(ValueError, match=said):
        System(
            Problem(
                mesh,
                [Body("upper", STEEL), Body("lower", STEEL)],
                [contact],
                [Dirichlet("base", "base", 1)],
                kinematics=AXISYMMETRIC,
            )
        )

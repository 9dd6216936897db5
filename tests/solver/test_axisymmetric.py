"""Bodies around an axis: thick cylinder and sphere under pressure, a bar in tension, energies."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.materials.elasticity import Elastic
from archord.materials.finite import LargeStrain
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematics import AXISYMMETRIC
from archord.solver.bulk import Bulk
from archord.solver.conditions import Dirichlet
from archord.solver.path.system import System
from archord.solver.problem import Body, Problem
from tests.solver.parts import coordinates, internal_force, quarter_annulus, solve, space
from tests.solver.test_bulk_terms import stiffness

A, B = 1.0, 2.0
E, SIGY = 1.0, 0.001
HEIGHT = 0.3


def rectangle(size: float, inner: float = A, outer: float = B, height: float = HEIGHT):
    """The section of a "ring" with edges "inner", "outer", "bottom" and "top"."""

    def build(gmsh) -> None:
        face = gmsh.model.occ.addRectangle(inner, 0, 0, outer - inner, height)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="ring")
        edges = [line for _, line in gmsh.model.getBoundary([(2, face)], oriented=False)]
        for line, name in zip(edges, ("bottom", "outer", "top", "inner"), strict=True):
            gmsh.model.addPhysicalGroup(1, [line], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)

    return gmsh_to_mesh(MPI.COMM_SELF, build)


def cylinder(material, size: float = 0.05) -> System:
    """Its inner wall moves outwards by the load; its ends keep their planes."""
    conditions = [Dirichlet("wall", "inner", 0, 1.0)]
    conditions += [Dirichlet(end, end, 1) for end in ("bottom", "top")]
    bodies = [Body("ring", material)]
    return System(Problem(rectangle(size), bodies, (), conditions, kinematics=AXISYMMETRIC))


def sphere(material, size: float = 0.06) -> System:
    """Half of it, whose inner wall moves outwards by the load."""
    mesh = quarter_annulus(MPI.COMM_SELF, A, B, size)
    conditions = [Dirichlet("wall", "inner", k, lambda x, k=k: x[:, k] / A) for k in range(2)]
    conditions += [Dirichlet("x", "x", 1), Dirichlet("y", "y", 0)]
    bodies = [Body("ring", material)]
    return System(Problem(mesh, bodies, (), conditions, kinematics=AXISYMMETRIC))


def outer_displacement(system: System) -> float:
    """Radial displacement of the outer wall."""
    x, u = coordinates(system.V), system.equilibrium.displacement()
    on_axis_plane = np.flatnonzero((np.abs(x[:, 0] - B) < 1e-9) & (np.abs(x[:, 1]) < 1e-9))
    return float(u[on_axis_plane[0], 0])


def plastic_volume(system: System) -> float:
    fields = next(system.bulk.at_points(system.equilibrium.displacement()))
    return float(fields.weight[fields.peeq > 0].sum())


@pytest.mark.parametrize("large", [False, True], ids=["small", "large"])
def test_an_elastic_cylinder_is_lames(large):
    """Pressure on the inner wall, displacement of the outer one, hoop and axial stress."""
    nu, wall = 0.3, 1e-7
    material = Elastic(E, nu)
    system = cylinder(LargeStrain(material) if large else material)
    system.solve([wall])
    lame = (1 + nu) / E * A**2 / (B**2 - A**2)
    pressure = wall / (lame * ((1 - 2 * nu) * A + B**2 / A))
    assert system.drive_force("") / (2 * np.pi * A * HEIGHT) == pytest.approx(pressure, rel=1e-5)
    expected = lame * pressure * ((1 - 2 * nu) * B + B)
    assert outer_displacement(system) == pytest.approx(expected, rel=1e-5)
    fields = next(system.bulk.at_points(system.equilibrium.displacement()))
    r = fields.coordinates[..., 0]
    ratio = pressure * A**2 / (B**2 - A**2)
    radial, axial, hoop, shear = np.moveaxis(fields.stress, -1, 0)
    np.testing.assert_allclose(radial, ratio * (1 - B**2 / r**2), atol=5e-3 * pressure)
    np.testing.assert_allclose(hoop, ratio * (1 + B**2 / r**2), atol=5e-3 * pressure)
    np.testing.assert_allclose(axial, 2 * nu * ratio, atol=5e-3 * pressure)
    np.testing.assert_allclose(shear, 0.0, atol=2e-3 * pressure)
    assert fields.weight.sum() == pytest.approx(np.pi * (B**2 - A**2) * HEIGHT, rel=1e-12)


def test_an_elastic_sphere_is_lames():
    nu, wall = 0.3, 1e-4
    system = sphere(Elastic(E, nu))
    system.solve([wall])
    compliance = A**3 / (E * (B**3 - A**3))
    pressure = wall / (compliance * ((1 - 2 * nu) * A + (1 + nu) * B**3 / (2 * A**2)))
    assert system.drive_force("") / (2 * np.pi * A**2) == pytest.approx(pressure, rel=1e-4)
    expected = compliance * pressure * 1.5 * (1 - nu) * B
    assert outer_displacement(system) == pytest.approx(expected, rel=1e-4)


def test_a_plastic_cylinder_is_hills():
    """p = 2 k (ln(c/a) + (1 - c^2/b^2) / 2); the radius c of the front from the displacement of
    the outer wall, (1 - nu^2) 2 k c^2 / (E b), and from the volume that has yielded. As in plane
    strain the material is elastically incompressible."""
    nu, k = 0.499, SIGY / np.sqrt(3)
    system = cylinder(J2Material(E, nu, hardening=LinearHardening(SIGY)))
    first_yield = (1 + nu) / E * k * ((1 - 2 * nu) * A**3 / B**2 + A)
    for wall in np.linspace(1.5, 3.5, 5) * first_yield:
        system.solve([wall])
        c = np.sqrt(outer_displacement(system) * E * B / (2 * k * (1 - nu**2)))
        assert A < c < B
        pressure = system.drive_force("") / (2 * np.pi * A * HEIGHT)
        assert pressure == pytest.approx(2 * k * (np.log(c / A) + (1 - c**2 / B**2) / 2), rel=1e-3)
        front = np.sqrt(A**2 + plastic_volume(system) / (np.pi * HEIGHT))
        assert front == pytest.approx(c, abs=0.02)


def test_a_plastic_sphere_is_hills():
    """p = 2 sigY (ln(c/a) + (1 - c^3/b^3) / 3), with (1 - nu) sigY c^3 / (E b^2) for the
    displacement of the outer wall (Hill 1950, chapter V)."""
    nu = 0.3
    system = sphere(J2Material(E, nu, hardening=LinearHardening(SIGY)))
    for wall in np.array([1.5, 2.5, 4.0]) * SIGY:
        system.solve([wall])
        c = np.cbrt(outer_displacement(system) * E * B**2 / (SIGY * (1 - nu)))
        assert A < c < B
        pressure = system.drive_force("") / (2 * np.pi * A**2)
        expected = 2 * SIGY * (np.log(c / A) + (1 - c**3 / B**3) / 3)
        assert pressure == pytest.approx(expected, rel=1e-3)
        front = np.cbrt(A**3 + plastic_volume(system) / (2 / 3 * np.pi))
        assert front == pytest.approx(c, abs=0.02)


@pytest.mark.parametrize("stretch", [0.7, 1.5])
def test_a_bar_in_tension_has_hencky_force(stretch):
    """Nominal stress E ln(stretch) / stretch over the undeformed section, to and on the axis."""
    mesh = rectangle(0.25, 0.0, 0.5, 1.0)
    conditions = [Dirichlet("base", "bottom", 1), Dirichlet("lid", "top", 1, 1.0)]
    conditions.append(Dirichlet("axis", "inner", 0))
    bodies = [Body("ring", LargeStrain(Elastic(E, 0.3)))]
    problem = Problem(mesh, bodies, (), conditions, kinematics=AXISYMMETRIC)
    system = solve(problem, np.linspace(0, stretch - 1, 17)[1:])
    section = np.pi * 0.5**2
    expected = E * np.log(stretch) / stretch * section
    assert system.drive_force("") == pytest.approx(expected, rel=1e-9)
    stored, _ = system.energies()
    assert stored == pytest.approx(E * np.log(stretch) ** 2 / 2 * section, rel=1e-9)
    assert system.distortion().inside_out == 0


MATERIALS = {
    "elastic": Elastic(E, 0.3),
    "plastic": J2Material(E, 0.3, hardening=LinearHardening(SIGY, 0.01)),
    "large": LargeStrain(J2Material(E, 0.3, hardening=LinearHardening(SIGY, 0.01))),
}


@pytest.mark.parametrize("inner", [0.0, 0.5])
@pytest.mark.parametrize("name", MATERIALS)
def test_the_tangent_is_the_derivative_of_the_force(name, inner):
    """Of a section that touches the axis, or not; a motion along the axis makes no force."""
    mesh = rectangle(0.4, inner, inner + 1.0, 0.7)
    V = space(mesh.mesh)
    material = MATERIALS[name].under(AXISYMMETRIC)
    bulk = Bulk(V, {1: mesh.cells_in("ring")}, {1: material}, AXISYMMETRIC)
    x, rng = coordinates(V), np.random.default_rng(0)
    along = np.tile([0.0, 0.1], (len(x), 1))
    assert np.abs(internal_force(bulk, along)).max() < 1e-13
    u = 5 * SIGY * np.stack([x[:, 0] * np.sin(x[:, 1]), x[:, 0] ** 2 + x[:, 1]], axis=1)
    bulk.update(u)
    K, h = stiffness(bulk), 1e-8
    d = rng.normal(size=u.shape)
    d[x[:, 0] < 1e-9, 0] = 0.0
    up, down = (internal_force(bulk, u + s * h * d) for s in (1, -1))
    difference = (up - down).ravel() / (2 * h)
    assert np.linalg.norm(K @ d.ravel() - difference) < 1e-5 * np.linalg.norm(difference)


def test_energy_balances_where_a_cylinder_flows():
    """Work is stored or dissipated, to the second order of the step."""
    system = cylinder(J2Material(E, 0.3, hardening=LinearHardening(SIGY, 0.01)), 0.1)
    work = last_force = last_wall = 0.0
    for wall in np.linspace(0, 4e-3, 41)[1:]:
        system.solve([wall])
        force = system.drive_force("")
        work += (wall - last_wall) * (force + last_force) / 2
        last_wall, last_force = wall, force
    stored, dissipated = system.energies()
    assert dissipated > 0.1 * stored
    assert stored + dissipated == pytest.approx(work, rel=2e-3)

"""Contact of bodies in space: its surfaces, forces and tangent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from dolfinx.mesh import CellType
from mpi4py import MPI

from archord.materials.finite import LargeStrain
from archord.solver.conditions import Dirichlet, Drive
from archord.solver.contact.interaction import Interaction
from archord.solver.contact.laws.coulomb import Coulomb, FrictionState
from archord.solver.contact.laws.law import SLIDE, STICK
from archord.solver.path.system import System
from archord.solver.problem import Body, Problem
from tests.materials.test_space import ASKEW
from tests.solver.contact.blocks_in_space import (
    IN_SPACE,
    LOWER,
    NU,
    UPPER,
    Box,
    E,
    bodies,
    flat,
    tagged,
)
from tests.solver.parts import commit

DEPTH = 0.02
STRAIGHT = np.eye(3)
every_kind = pytest.mark.parametrize(
    "kind", [CellType.tetrahedron, CellType.hexahedron], ids=lambda kind: kind.name
)
LAWS = {
    "frictionless": {},
    "reference": {"kinematics": "reference"},
    "tied": {"law": "tied"},
    "one side": {"integrated": "upper"},
    "rubbing": {"friction": 0.1},
    "rubbing, reference": {"friction": 0.1, "kinematics": "reference"},
}
every_way = pytest.mark.parametrize(
    "law", [LAWS["frictionless"], LAWS["tied"]], ids=["frictionless", "tied"]
)
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
INSET = Box((0.13, 0.08, 0.0), (0.87, 0.91, 1.0), (2, 2, 1))


def bump(x):
    """Bends the plane z = 0 into a saddle, and both blocks with it."""
    bent = x.copy()
    bent[:, 2] += 0.15 * (x[:, 0] - 0.4) ** 2 - 0.1 * (x[:, 1] - 0.6) ** 2
    return bent


def mirrored(x):
    return bump(x) * [-1.0, 1.0, 1.0]


def matrix(contact, n):
    """The tangent over all dofs."""
    rows = contact.tangent.rows
    columns = contact.tangent.columns
    values = contact.tangent.blocks()
    K = sp.csr_matrix((n, n))
    for i, j in np.ndindex(3, 3):
        K += sp.coo_matrix((values[:, i, j], (3 * rows + i, 3 * columns + j)), shape=(n, n)).tocsr()
    return K


def pressed(blocks, depth, seed=2, turn=STRAIGHT):
    """The upper block moved down, both bent a little, and noise at every node, of bodies that are
    turned."""
    x = blocks.V.tabulate_dof_coordinates() @ turn
    u = (
        0.2
        * depth
        * np.stack(
            [np.sin(2 * x[:, 0] + x[:, 1]), np.cos(x[:, 2] - x[:, 0]), np.sin(3 * x[:, 1])], axis=1
        )
    )
    u[blocks.nodes("upper"), 2] -= depth
    u += 0.005 * depth * np.random.default_rng(seed).normal(size=u.shape)
    return u @ turn.T


def contact_force(contact, u):
    contact.evaluate(u)
    force = np.zeros_like(u)
    contact.add_force(force)
    return force


def branches(contact):
    """What decides on the branch of every point."""
    flags = []
    for pair in contact.pairs:
        P = pair.projection
        flags += [pair.branch, P.found, P.facet, (P.along != 0).reshape(len(P.facet), -1).sum(1)]
    return np.concatenate(flags)


@every_kind
def test_points_lie_on_the_surface(kind):
    """Points, normals and areas of the surface z = bump, whichever way cells are oriented."""
    for bend, sign in ((flat, 1), (bump, 1), (mirrored, -1)):
        blocks = bodies(MPI.COMM_SELF, kind=kind, bend=bend)
        contact = blocks.contact()
        for surface, up in zip(contact.surfaces, (-1, 1), strict=True):
            x = surface.point.reshape(-1, 3) * [sign, 1, 1]
            z = 0 if bend is flat else bump(x * [1, 1, 0])[:, 2]
            np.testing.assert_allclose(x[:, 2], z, atol=1e-8)  # as nodes are rounded
            area = surface.weight.sum()
            assert area == pytest.approx(surface.curve.areas().sum(), rel=1e-6)
            outward = surface.outward.reshape(-1, 3)
            np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1.0, rtol=1e-14)
            assert (up * outward[:, 2] > 0.8).all()
            if bend is flat:
                assert area == pytest.approx(1.0, rel=1e-13)
                of_facet = 1 / surface.n_facets
                np.testing.assert_allclose(surface.facet_lengths() ** 2, of_facet, rtol=1e-8)


@every_kind
@every_law
@pytest.mark.parametrize("material", [IN_SPACE, LargeStrain(IN_SPACE)], ids=["small", "large"])
def test_tangent_is_the_derivative_of_the_force(kind, law, material):
    """Central differences in random directions, on curved surfaces that do not match, at small and
    large strain."""
    blocks = bodies(MPI.COMM_SELF, upper=INSET, kind=kind, bend=bump)
    contact = blocks.contact(material, **law)
    contact_force(contact, pressed(blocks, 0.7 * DEPTH, seed=1))
    commit(contact)
    contact.begin(pressed(blocks, 0.7 * DEPTH, seed=1))
    u = pressed(blocks, DEPTH)
    u[blocks.nodes("upper"), :2] += [0.2 * DEPTH, -0.1 * DEPTH]
    force = contact_force(contact, u)
    if "friction" in law:
        branch = np.concatenate([pair.branch for pair in contact.pairs])
        assert {STICK, SLIDE} <= set(branch)
    assert np.abs(force).max() > 1e-3 * DEPTH * E
    K = matrix(contact, u.size)
    at = branches(contact)
    rng = np.random.default_rng(7)
    h = 1e-6 * DEPTH
    for _ in range(3):
        d = rng.normal(size=u.shape)
        sides = []
        for sign in (1, -1):
            sides.append(contact_force(contact, u + sign * h * d).ravel())
            np.testing.assert_array_equal(branches(contact), at)
        difference = (sides[0] - sides[1]) / (2 * h)
        assert np.linalg.norm(K @ d.ravel() - difference) < 1e-6 * np.linalg.norm(difference)


@every_law
def test_forces_of_both_surfaces_balance(law):
    """Their sum is zero, and the resultant is what acts on the second surface."""
    blocks = bodies(MPI.COMM_SELF, upper=INSET, bend=bump)
    contact = blocks.contact(**law)
    force = contact_force(contact, pressed(blocks, DEPTH))
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-14)
    on_lower = -force[blocks.nodes("lower")].sum(axis=0)
    np.testing.assert_allclose(contact.resultant(), on_lower, atol=1e-14)
    assert on_lower[2] < -0.1 * DEPTH


@every_law
@pytest.mark.parametrize("Q", [ASKEW, np.diag([-1.0, 1.0, 1.0])], ids=["turned", "mirrored"])
def test_forces_turn_with_the_bodies(law, Q):
    """By 37 degrees about (1, 2, 3), and in a mirror; with a history of friction."""
    forces = []
    for turn in (STRAIGHT, Q):
        blocks = bodies(MPI.COMM_SELF, upper=INSET, bend=lambda x, Q=turn: bump(x) @ Q.T)
        u = [pressed(blocks, 0.7 * DEPTH, turn=turn), pressed(blocks, DEPTH, turn=turn)]
        contact = blocks.contact(**law)
        contact_force(contact, u[0])
        commit(contact)
        contact.begin(u[0])
        forces.append(contact_force(contact, u[1]))
    straight, turned = forces
    off = 1e-9 * np.abs(straight).max()
    np.testing.assert_allclose(turned, straight @ Q.T, rtol=0, atol=off)


def pressed_together(blocks, **interaction):
    """Two like blocks, free to widen, with the lid moved down by DEPTH."""
    rollers = [("base", 2), ("left", 0), ("front", 1)]
    supports = [Dirichlet(name, name, axis) for name, axis in rollers]
    joint = Interaction("joint", ("upper", "lower"), **interaction)
    bodies = [Body(name, IN_SPACE) for name in ("lower", "upper")]
    supports.append(Dirichlet("lid", "lid", 2, -DEPTH))
    problem = Problem(tagged(blocks), bodies, [joint], supports, kinematics="space")
    system = System(problem)
    system.solve([1.0])
    return system


@pytest.mark.mpi
@every_kind
@every_way
def test_blocks_that_match_carry_a_uniform_pressure(kind, law, comm):
    """Pressure, force and moments of the closed form, to round-off."""
    blocks = bodies(comm, upper=Box(UPPER.low, UPPER.high, LOWER.cubes), kind=kind)
    system = pressed_together(blocks, **law)
    pressure = E * DEPTH / 2
    for pair in system.contact.pairs:
        np.testing.assert_allclose(pair.pressure, pressure, rtol=1e-9)
    middle = 0.5  # undeformed, as at small strain
    off = 1e-9 * pressure
    np.testing.assert_allclose(system.contact_force("joint"), [0, 0, -pressure], atol=off)
    moments = system.contact_moments("joint", (0.0, 0.0, 0.0))
    np.testing.assert_allclose(moments, [-pressure * middle, pressure * middle, 0.0], atol=off)


@pytest.mark.mpi
@every_kind
@every_way
def test_blocks_that_do_not_match_carry_a_uniform_pressure(kind, law, comm):
    """Pressure and force of the closed form, to round-off: facets are broken at the opposite's."""
    system = pressed_together(bodies(comm, kind=kind), **law)
    pressure = E * DEPTH / 2
    for pair in system.contact.pairs:
        np.testing.assert_allclose(pair.pressure, pressure, rtol=1e-9)
    assert -system.reaction("lid")[2] == pytest.approx(pressure, rel=1e-9)


# of displacements that are linear all around
ASTRAY = np.array([[0.3, 0.8, 0.1], [-0.2, 1.0, 0.3], [0.4, -0.1, -0.7]])
STATES = {"tied": ({"law": "tied"}, ASTRAY), "frictionless": ({}, -STRAIGHT)}
every_state = pytest.mark.parametrize(("law", "gradient"), STATES.values(), ids=STATES)


def held_around(blocks, law, gradient):
    """The blocks in contact, displaced by the ``gradient`` all around, and how far off they are
    from this displacement everywhere."""
    supports = [
        Dirichlet(f"around {k}", "around", k, lambda x, k=k: DEPTH * x @ gradient[k])
        for k in range(3)
    ]
    joint = Interaction("joint", ("upper", "lower"), **law)
    bodies = [Body(name, IN_SPACE) for name in ("lower", "upper")]
    system = System(Problem(tagged(blocks), bodies, [joint], supports, kinematics="space"))
    system.solve([1.0])
    x = blocks.V.tabulate_dof_coordinates()
    off = system.equilibrium.displacement() - DEPTH * x @ gradient.T
    return system, np.abs(off).max() / DEPTH


@every_kind
@every_state
def test_a_saddle_between_meshes_that_do_not_match_is_not_seen(kind, law, gradient):
    """Both meshes have the same curved surface. A tie carries any uniform stress, frictionless
    contact a pressure from all sides, at points and facets."""
    blocks = bodies(MPI.COMM_SELF, kind=kind, bend=bump)
    system, off = held_around(blocks, law, gradient)
    assert off < 1e-10
    strain = DEPTH * (gradient + gradient.T) / 2
    stress = E / (1 + NU) * (strain + NU / (1 - 2 * NU) * np.trace(strain) * STRAIGHT)
    for pair in system.contact.pairs:
        n = pair.projection.normal
        expected = -np.einsum("mi,ij,mj->m", n, stress, n)
        np.testing.assert_allclose(pair.pressure.ravel(), expected, rtol=1e-9)


@every_state
@pytest.mark.parametrize("axes", [1, 2], ids=["cylinder", "sphere"])
def test_arcs_between_meshes_that_do_not_match_are_seen_by_their_sagitta(axes, law, gradient):
    """Facets of second order on a cylinder or sphere of radius 3 are not on each other if meshes
    differ: by less than a fifth as cells are halved, of the third order or better."""

    def dome(x):
        bent = x.copy()
        square = ((x - [0.4, 0.6, 0.0])[:, :axes] ** 2).sum(axis=1)
        bent[:, 2] += np.sqrt(9.0 - square) - 3.0
        return bent

    off = []
    for cells in (1, 2):
        boxes = [
            Box(box.low, box.high, (cells * box.cubes[0], cells * box.cubes[1], 2))
            for box in (LOWER, UPPER)
        ]
        blocks = bodies(MPI.COMM_SELF, *boxes, bend=dome)
        off.append(held_around(blocks, law, gradient)[1])
    assert off[0] < 1e-3
    assert off[1] < 0.2 * off[0]


def test_bodies_that_turn_together_at_large_strain_keep_their_pressure():
    """By 37 degrees about (1, 2, 3): the forces turn with them."""
    blocks = bodies(MPI.COMM_SELF, upper=INSET, bend=bump)
    contact = blocks.contact(LargeStrain(IN_SPACE))
    u = pressed(blocks, DEPTH)
    x = blocks.V.tabulate_dof_coordinates()
    straight = contact_force(contact, u)
    turned = contact_force(contact, (x + u) @ ASKEW.T - x)
    assert np.abs(straight).max() > 1e-3 * DEPTH * E
    off = 1e-9 * np.abs(straight).max()
    np.testing.assert_allclose(turned, straight @ ASKEW.T, rtol=0, atol=off)


@every_law
def test_bodies_in_touch_that_turn_together_at_large_strain_do_not_press(law):
    """By 37 degrees about (1, 2, 3)."""
    blocks = bodies(MPI.COMM_SELF, upper=INSET, bend=bump)
    contact = blocks.contact(LargeStrain(IN_SPACE), **law)
    x = blocks.V.tabulate_dof_coordinates()
    force = contact_force(contact, x @ ASKEW.T - x)
    np.testing.assert_allclose(force, 0.0, rtol=0, atol=1e-9 * E)


LAWS_OF_SLIP = {
    "cone": Coulomb(0.3),
    "held": Coulomb(0.3).elastic(),
    "secant": Coulomb(0.3).by_secants(),
    "none": Coulomb(0.3).frictionless(),
}


@pytest.mark.parametrize("law", LAWS_OF_SLIP.values(), ids=LAWS_OF_SLIP)
def test_friction_along_one_direction_is_friction_in_a_plane(law):
    """Of points open, sticking and sliding both ways, with a history, whatever the direction."""
    rng = np.random.default_rng(4)
    n = 200
    state = FrictionState(*rng.uniform(-1, 1, (2, n)), np.zeros(n))
    opening, trial = rng.uniform(-1, 1, (2, n, 2))
    gamma = np.tile([2.0, 3.0], (n, 1))
    wanted = law.respond(opening, trial, gamma, state, 1.0)
    angle = rng.uniform(0, 2 * np.pi, n)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def in_space(values):
        return np.column_stack([values[:, 0], values[:, 1:] * way])

    before = replace(state, elastic_slip=state.elastic_slip[:, None] * way)
    gamma = np.tile([2.0, 3.0, 3.0], (n, 1))
    found = law.in_space().respond(in_space(opening), in_space(trial), gamma, before, 1.0)
    np.testing.assert_allclose(found.traction, in_space(wanted.traction), atol=1e-15)
    elastic_slip = wanted.state.elastic_slip[:, None] * way
    np.testing.assert_allclose(found.state.elastic_slip, elastic_slip, atol=1e-15)
    np.testing.assert_allclose(found.state.dissipated, wanted.state.dissipated, atol=1e-15)
    np.testing.assert_array_equal(found.branch, np.minimum(wanted.branch, SLIDE))
    along = np.einsum("mi,mij,mj->m", way, found.by_trial[:, 1:, 1:], way)
    np.testing.assert_allclose(along, wanted.by_trial[:, 1, 1], atol=1e-15)
    by_pressure = wanted.by_trial[:, 1, :1] * way
    np.testing.assert_allclose(found.by_trial[:, 1:, 0], by_pressure, atol=1e-15)


@pytest.mark.parametrize("friction", [0.2, 0.0], ids=["friction", "none"])
def test_a_block_that_slides_carries_the_friction(friction):
    """Pressed down and then pushed askew, the shear is friction times the pressure at every point,
    and on the lower block along the push."""
    blocks = bodies(MPI.COMM_SELF, upper=Box(UPPER.low, UPPER.high, LOWER.cubes))
    joint = Interaction("joint", ("upper", "lower"), friction=friction, kinematics="reference")
    push = np.array([3.0, -4.0]) * DEPTH
    supports = [Dirichlet(f"base {axis}", "base", axis) for axis in range(3)]
    supports.append(Dirichlet("lid", "lid", 2, -DEPTH, "press"))
    supports += [Dirichlet(f"push {axis}", "lid", axis, push[axis], "push") for axis in (0, 1)]
    drives = [Drive("press", (0.0, 1.0)), Drive("push", (0.0, 0.0, 1.0))]
    problem = Problem(
        tagged(blocks),
        [Body(name, IN_SPACE) for name in ("lower", "upper")],
        [joint],
        supports,
        drives=drives,
        kinematics="space",
    )
    system = System(problem)
    system.solve([1.0, 1.5, 2.0])
    for pair in system.contact.pairs:
        np.testing.assert_allclose(pair.shear, friction * pair.pressure, atol=1e-12)
    force = system.contact_force("joint")
    expected = friction * -force[2] * np.array([0.6, -0.8])
    np.testing.assert_allclose(force[:2], expected, atol=(0.01 * friction + 1e-9) * -force[2])

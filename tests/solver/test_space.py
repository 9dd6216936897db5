"""Bodies in space: closed forms of a stretched box, plane strain, turned axes."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx.mesh import CellType, create_rectangle, locate_entities_boundary, meshtags
from scipy.optimize import brentq

import archord
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.stored import store_mesh
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.elasticity import von_mises
from archord.materials.j2 import J2Material
from archord.materials.material import Material
from archord.solver.conditions import Dirichlet
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from archord.solver.problem import Body, Interaction, Problem
from tests.materials.test_space import ASKEW
from tests.solver.space import (
    KINDS,
    LARGE,
    MATERIALS,
    NU,
    E,
    box,
    every_material,
    small_and_large,
)

SIZE = (1.0, 2.0, 1.5)


def held(*axes: int) -> list[Dirichlet]:
    """Sides at the beginning of these axes, which do not move along them."""
    return [Dirichlet(f"{'xyz'[axis]}0", f"{'xyz'[axis]}0", axis) for axis in axes]


def pulled(mesh: TaggedMesh, material: Material, supports, kinematics="space", degree=2) -> System:
    """The problem of the body "box" on these ``supports``, moved by the load factor in two
    steps."""
    bodies = [Body("box", material)]
    options = {"kinematics": kinematics, "degree": degree, "tolerance": 1e-12}
    system = System(Problem(mesh, bodies, supports=supports, **options))
    system.solve([0.3, 1.0], StepRules(minimum=1.0))
    return system


def strength(material: Material, peeq: float) -> float:
    """The stress in tension at a ``peeq``, with linear back stresses."""
    back = sum(modulus for modulus, _ in getattr(material, "back_stresses", ()))
    return float(material.hardening.stress(np.array(peeq)) + back * peeq)


@pytest.mark.mpi
@KINDS
@every_material
def test_tension_of_a_box(material, kind, comm):
    """Of a stress s at the PEEQ p the strain is s/E + p along it, and -nu s/E - p/2 across; the
    work is stored or dissipated."""
    strain = 0.01
    supports = [*held(0, 1, 2), Dirichlet("pull", "y1", 1, strain * SIZE[1])]
    system = pulled(box(comm, (2, 2, 1), SIZE, kind), material, supports)
    peeq = 0.0
    if material.yields:
        peeq = brentq(lambda p: strength(material, p) / E + p - strain, 0, strain, xtol=1e-16)
    stress = E * (strain - peeq)
    across = -NU * stress / E - peeq / 2
    area = SIZE[0] * SIZE[2]
    volume = area * SIZE[1]
    reaction = system.reaction("pull")
    np.testing.assert_allclose(reaction, [0, stress * area, 0], rtol=0, atol=1e-9 * stress)
    displacement, force = system.driven()
    assert displacement * force == pytest.approx(stress * area * strain * SIZE[1], rel=1e-9)
    u = system.equilibrium.displacement()
    x = system.V.tabulate_dof_coordinates()
    np.testing.assert_allclose(u, x * [across, strain, across], rtol=0, atol=1e-12)
    for part in system.bulk.at_points(u):
        expected = np.broadcast_to([0, stress, 0, 0, 0, 0], part.stress.shape)
        np.testing.assert_allclose(part.stress, expected, rtol=0, atol=1e-8 * stress)
        assert part.weight.sum() <= volume * (1 + 1e-12)
    assert system.peeq() == pytest.approx((peeq, peeq * volume), abs=1e-12)
    assert system.energies()[0] == pytest.approx(stress**2 / (2 * E) * volume, rel=1e-9)
    assert (system.energies()[1] > 0) == material.yields
    assert system.force_balance() < 1e-9
    assert system.distortion().strain == pytest.approx(strain)
    assert system.distortion().inside_out == 0


@pytest.mark.mpi
@KINDS
def test_a_box_is_stretched_to_double_length(kind, comm):
    """Hencky's solid: the force is the undeformed area times E ln(stretch) / stretch, the sides
    shrink by the stretch to the power -nu."""
    supports = [*held(0, 1, 2), Dirichlet("pull", "y1", 1, SIZE[1])]
    system = pulled(box(comm, (1, 1, 1), SIZE, kind), LARGE["elastic, large"], supports)
    force = E * np.log(2) / 2 * SIZE[0] * SIZE[2]
    np.testing.assert_allclose(system.reaction("pull"), [0, force, 0], rtol=0, atol=1e-9 * force)
    u = system.equilibrium.displacement()
    across = 2**-NU - 1
    x = system.V.tabulate_dof_coordinates()
    np.testing.assert_allclose(u, x * [across, 1.0, across], rtol=0, atol=1e-11)
    true = E * np.log(2) / (2 * (1 + across) ** 2)  # over the volume's change
    for part in system.bulk.at_points(u):
        np.testing.assert_allclose(part.stress[..., 1], true, rtol=1e-10)


def rectangle(comm, cells, size) -> TaggedMesh:
    """The body "box" of quadrilaterals from the origin, with its sides."""
    corners = [np.zeros(2), np.array(size)]
    mesh = create_rectangle(comm, corners, cells, CellType.quadrilateral)
    index_map = mesh.topology.index_map(2)
    every = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    sides = [
        locate_entities_boundary(mesh, 1, lambda x, at=at: np.isclose(x[0], at))
        for at in (0, size[0])
    ]
    facets = np.concatenate(sides)
    tags = np.repeat(np.array([1, 2], dtype=np.int32), [len(side) for side in sides])
    order = np.argsort(facets)
    of_facets = meshtags(mesh, 1, facets[order], tags[order])
    of_cells = meshtags(mesh, 2, every, np.ones_like(every))
    return TaggedMesh(mesh, of_cells, of_facets, {"box": (1,)}, {"x0": (1,), "x1": (2,)})


@pytest.mark.mpi
@small_and_large
def test_a_layer_between_held_faces_is_plane_strain(material, comm):
    """A cantilever of hexahedra and of quadrilaterals, whose bases are the same in a plane, has the
    same displacements, stresses and forces."""
    tip = 0.3 if material.finite else 0.02
    bent = [Dirichlet("tip", "x1", 1, tip), Dirichlet("tip", "x1", 0)]
    clamped = [Dirichlet("root", "x0", 0), Dirichlet("root", "x0", 1)]
    flat = [Dirichlet("faces", side, 2) for side in ("z0", "z1")]
    depth = 0.4
    flat_mesh = rectangle(comm, (2, 1), (2.0, 1.0))
    plane = pulled(flat_mesh, material, clamped + bent, "plane strain", degree=3)
    mesh = box(comm, (2, 1, 1), (2.0, 1.0, depth), CellType.hexahedron)
    layer = pulled(mesh, material, clamped + bent + flat, degree=3)
    expected = depth * plane.reaction("tip")
    found = layer.reaction("tip")
    size = np.abs(expected).max()
    np.testing.assert_allclose(found[:2], expected, rtol=0, atol=1e-10 * size)
    assert np.array(layer.peeq()) == pytest.approx(np.array(plane.peeq()) * [1, depth], rel=1e-9)
    u = layer.equilibrium.displacement()
    assert np.abs(u[:, 2]).max(initial=0) < 1e-12
    largest = [
        max(comm.allgather(max(float(von_mises(part.stress).max(initial=0.0)) for part in parts)))
        for parts in (
            list(layer.bulk.at_points(u)),
            list(plane.bulk.at_points(plane.equilibrium.displacement())),
        )
    ]
    assert largest[0] == pytest.approx(largest[1], rel=1e-10)


@pytest.mark.parametrize("name", ["elastic", "linear", "back stress"])
def test_tetrahedra_between_held_faces_have_the_stress_of_plane_strain(name, comm):
    """In tension beyond yield, with the stress out of the plane."""
    material = MATERIALS[name]
    strain = 0.01
    supports = [*held(0, 1, 2), Dirichlet("back", "z1", 2), Dirichlet("pull", "y1", 1, 2 * strain)]
    system = pulled(box(comm, (1, 2, 1), SIZE), material, supports)
    state = material.state(1)
    for at in (0.3 * strain, strain):

        def transverse(across, at=at, state=state):
            return material.update(np.array([[across, at, 0.0]]), state)

        across = brentq(lambda e: transverse(e)[0][0, 0], -strain, 0, xtol=1e-18)
        stress, _, state = transverse(across)
    for part in system.bulk.at_points(system.equilibrium.displacement()):
        found = part.stress.reshape(-1, 6)
        expected = np.broadcast_to([*stress[0], 0.0, 0.0], found.shape)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * stress.max())


@small_and_large
def test_a_turned_body_has_turned_forces(material, comm):
    """By 37 degrees about (1, 2, 3); PEEQ is the same."""
    move = np.array([0.004, 0.01, -0.006]) * (20 if material.finite else 1)
    systems = []
    for Q in (np.eye(3), ASKEW):
        mesh = box(comm, (2, 2, 1), SIZE)
        mesh.mesh.geometry.x[:] = mesh.mesh.geometry.x @ Q.T
        fixed = [Dirichlet("root", "y0", axis) for axis in range(3)]
        moved = [Dirichlet("end", "y1", axis, float((Q @ move)[axis])) for axis in range(3)]
        systems.append(pulled(mesh, material, fixed + moved))
    straight, askew = systems
    force = straight.reaction("end")
    largest = np.abs(force).max()
    np.testing.assert_allclose(askew.reaction("end"), ASKEW @ force, rtol=0, atol=1e-9 * largest)
    assert askew.peeq() == pytest.approx(straight.peeq(), rel=1e-9)
    assert askew.energies() == pytest.approx(straight.energies(), rel=1e-9)
    assert askew.distortion().strain == pytest.approx(straight.distortion().strain, rel=1e-9)
    assert askew.distortion().angle == pytest.approx(straight.distortion().angle, rel=1e-9)


class Spring(Material):
    """A material of one's own: every component of the stress is a modulus times its strain."""

    E = 10.0
    yields = True

    @property
    def elastic_tangent(self):
        return self.E * np.diag([1.0, 1.0, 1.0, 0.5, 0.5, 0.5])

    def update(self, strain, state):
        tangent = np.tile(self.elastic_tangent, (len(strain), 1, 1))
        return strain @ self.elastic_tangent, tangent, state

    def energy(self, stress):
        return (stress**2 @ [0.5, 0.5, 0.5, 1.0, 1.0, 1.0]) / self.E


@pytest.mark.parametrize("large", [False, True])
def test_a_material_of_ones_own_has_six_components(large, comm):
    """Without contraction across; at large strain of the logarithm of the stretch."""
    spring = archord.LargeStrain(Spring()) if large else Spring()
    supports = [*held(0, 1, 2), Dirichlet("pull", "z1", 2, 0.5 * SIZE[2])]
    system = pulled(box(comm, (1, 1, 1), SIZE), spring, supports)
    strain = np.log(1.5) if large else 0.5
    force = Spring.E * strain / (1.5 if large else 1.0) * SIZE[0] * SIZE[1]
    np.testing.assert_allclose(system.reaction("pull"), [0, 0, force], rtol=0, atol=1e-9 * force)
    energy = Spring.E * strain**2 / 2 * np.prod(SIZE)
    assert system.energies()[0] == pytest.approx(energy, rel=1e-9)
    plane = J2Material(E, NU, "stress")
    with pytest.raises(archord.InputError, match=r"'stress' does not fit .* are 'space'"):
        pulled(box(comm), plane, supports)


def test_kinematics_are_by_the_mesh(comm, tmp_path):
    """Also where the mesh is a file that is read later; what contradicts it is refused then."""
    bodies = [Body("box", MATERIALS["elastic"])]
    assert Problem(box(comm), bodies).kinematics.name == "space"
    assert Problem(rectangle(comm, (1, 1), (1.0, 1.0)), bodies).kinematics.name == "strain"
    path = tmp_path / "box.npz"
    with path.open("wb") as file:
        store_mesh(gathered(box(comm)), file)
    problem = Problem(path, bodies).on(comm)
    assert problem.kinematics.name == problem.bodies[0].material.plane == "space"
    stated = Problem(path, bodies, kinematics="plane stress")
    with pytest.raises(archord.InputError, match=r'"plane stress" do not fit .* kind tetrahedron'):
        stated.on(comm)


class OwnFriction(archord.ContactLaw):
    """A law that was made for a plane."""

    has_friction = True


def test_what_space_cannot_do_yet_is_said_in_a_sentence(comm):
    """Contact; and a mesh of another dimension, or a thickness, does not fit."""
    bodies = [Body("box", MATERIALS["elastic"])]
    with pytest.raises(archord.InputError, match=r'"plane strain" do not fit .* kind tetrahedron'):
        Problem(box(comm), bodies, kinematics="plane strain")
    with pytest.raises(archord.InputError, match=r'"space" do not fit .* kind quadrilateral'):
        Problem(rectangle(comm, (1, 1), (1.0, 1.0)), bodies, kinematics="space")
    rubbing = Interaction("joint", ("x0", "x1"), OwnFriction())
    on_disc = Interaction("joint", (archord.RigidCircle((0.0, 0.0), 1.0), "x1"))
    for interaction, lacking in ((rubbing, "a law of slip for planes"), (on_disc, "a rigid disc")):
        with pytest.raises(archord.InputError, match=f'interaction "joint" has {lacking}: .*space'):
            Problem(box(comm), bodies, [interaction], kinematics="space")
    on_ball = Interaction("joint", (archord.RigidBall((0.0, 0.0, 0.0), 1.0), "x1"))
    with pytest.raises(archord.InputError, match='"joint" has a RigidBall: in a plane there is'):
        Problem(rectangle(comm, (1, 1), (1.0, 1.0)), bodies, [on_ball])
    with pytest.raises(archord.InputError, match=r"thickness = 2: .* bodies in space are drawn"):
        Problem(box(comm), bodies, kinematics="space", thickness=2.0)

"""Round bars about their axis: forces are of the whole ring, nodes on the axis stay there."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematics import AXISYMMETRIC
from archord.measures.doubts import stiff_quadrilaterals
from archord.solver.parts import Coupling, Load, Support
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from archord.solver.problem import Body, DeadLoad, Dirichlet, Drive, Mean, Problem
from tests.solver.parts import ELASTIC, NU, E, blocks, coordinates

RADIUS = 2.0
AREA = np.pi * RADIUS**2
DOWN = 1e-3
FORCE = E * DOWN * AREA
FEET = [Dirichlet("feet", "base", 1), Dirichlet("feet", "upper bottom", 1)]
HEADS = [Dirichlet("heads", "lower top", 1, -DOWN), Dirichlet("heads", "lid", 1, -DOWN)]


def bars(**parts) -> System:
    """Two round bars of length 1 about x = 0, which do not know of each other."""
    mesh = blocks(MPI.COMM_WORLD, 3, 4, width=RADIUS)
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    given = {"supports": FEET, "kinematics": AXISYMMETRIC}
    return System(Problem(mesh, bodies, **(given | parts)))


def solved(**parts) -> System:
    system = bars(**parts)
    system.solve([1.0], StepRules(minimum=1.0))
    return system


def displacements(system: System) -> tuple[np.ndarray, np.ndarray]:
    """Places and displacements of this rank's own nodes."""
    n = system.equilibrium.unknowns.n_owned
    return coordinates(system.V)[:n], system.equilibrium.displacement()[:n]


@pytest.mark.mpi
def test_pushed_heads_take_the_force_of_whole_bars():
    """Uniaxial stress; the drive's work is stored."""
    system = solved(supports=[*FEET, *HEADS], drives=[Drive("")])
    assert system.drive_force("") == pytest.approx(2 * FORCE * DOWN, rel=1e-9)
    assert system.reaction("heads") == pytest.approx([0, -2 * FORCE], abs=1e-9 * FORCE)
    assert system.reaction("feet") == pytest.approx([0, 2 * FORCE], abs=1e-9 * FORCE)
    assert system.force_balance() < 1e-9
    assert system.energies()[0] == pytest.approx(FORCE * DOWN, rel=1e-9)
    x, u = displacements(system)
    assert u[:, 0] == pytest.approx(NU * DOWN * x[:, 0], abs=1e-9 * DOWN)


@pytest.mark.mpi
def test_loads_are_of_whole_rings():
    """A force on the heads, and the pressure that makes the same force."""
    forces = [DeadLoad(facets=head, force=(0.0, -FORCE)) for head in ("lower top", "lid")]
    pressures = [DeadLoad(facets=head, pressure=FORCE / AREA) for head in ("lower top", "lid")]
    of_forces = solved(loads=forces)
    of_pressures = solved(loads=pressures)
    assert of_forces.reaction("feet")[1] == pytest.approx(2 * FORCE, rel=1e-9)
    _, same = displacements(of_pressures)
    x, u = displacements(of_forces)
    assert same == pytest.approx(u, abs=1e-9 * DOWN)
    foot = np.where(x[:, 1] < 0, -1.0, 0.0)
    inside = np.abs(x[:, 1]) > 1e-9  # one bar ends where the other begins
    assert u[inside, 1] == pytest.approx((-DOWN * (x[:, 1] - foot))[inside], abs=1e-9 * DOWN)


@pytest.mark.mpi
def test_one_anchor_holds_a_ring_that_means_alone_hold():
    """The mean displacement of the heads takes the force that the feet take."""
    sets = {"head": "lid", "foot": "upper bottom"}
    system = solved(
        supports=[FEET[0]],
        means=[Mean(name, facets, 1, drive=name) for name, facets in sets.items()],
        drives=[Drive("head", (0.0, -DOWN)), Drive("foot", (0.0, 0.0))],
    )
    assert len(system.equilibrium.drives.rate) == 2 + 1
    assert system.drive_force("head") == pytest.approx(-FORCE, rel=1e-9)
    assert system.reaction("foot")[1] == pytest.approx(FORCE, rel=1e-9)


@pytest.mark.mpi
def test_springs_hold_rings_along_the_axis():
    """The upper bar floats, the lower one does not."""
    system = bars(supports=[FEET[0]], stabilise=True)
    assert [body.name for body in system.equilibrium.springs.rigid.loose] == ["upper"]
    assert len(system.equilibrium.springs.rigid.free) == 1


def test_the_axis_stays_where_it_is():
    """Its nodes are held without a support, which cannot move them away either; and there is
    nothing beyond it."""
    x, u = displacements(solved(supports=[*FEET, *HEADS]))
    on_axis = x[:, 0] < 1e-12
    assert on_axis.sum() > 5
    assert not u[on_axis, 0].any()
    with pytest.raises(ValueError, match="'left' moves nothing"):
        bars(supports=[*FEET, Dirichlet("left", "left", 0, 1.0)])
    mesh = blocks(MPI.COMM_SELF, 2, 2, width=-RADIUS)
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    with pytest.raises(ValueError, match="x is the radius"):
        System(Problem(mesh, bodies, supports=FEET, kinematics=AXISYMMETRIC))


def test_rings_have_no_rotation():
    assert not bars().reaction_moments("feet", (0.0, 0.0)).size
    with pytest.raises(ValueError, match="rotation"):
        bars(means=[Mean("lid", "lid", 2, drive="lid")], drives=[Drive("lid", control="force")])


@pytest.mark.mpi
def test_a_rigid_ring_moves_along_its_axis_alone():
    """A plate on the head of a short bar, whose feet are clamped, widens as little as the feet, and
    the bar is stiffer than under a plate that slides."""
    plate = [Coupling("plate", "lid", (RADIUS, 1.0))]
    feet = [Support("feet", "base"), Support("feet", "upper bottom")]
    press = [Load("press", "plate", "y", displacement=-DOWN)]
    pushed = [Load("press", "lid", "y", displacement=-DOWN)]
    held = Support("guide", "lid", "x")
    system = solved(supports=feet, couplings=plate, loads=press)
    same = solved(supports=[*feet, held], loads=pushed)
    sliding = solved(supports=feet, loads=pushed)
    force = system.drive_force("press")
    assert force == pytest.approx(same.drive_force("press"), rel=1e-9)
    assert force < 1.02 * sliding.drive_force("press") < 0
    x, u = displacements(system)
    assert not u[x[:, 1] > 1 - 1e-9, 0].any()


@pytest.mark.parametrize("direction", ["x", "rotation"])
def test_no_load_widens_or_turns_a_rigid_ring(direction):
    plate = [Coupling("plate", "lid", (RADIUS, 1.0))]
    load = Load("twist", "plate", direction, displacement=DOWN)
    feet = [Support("feet", "base"), Support("feet", "upper bottom")]
    with pytest.raises(ValueError, match="no rigid ring such as 'plate' moves"):
        bars(supports=feet, couplings=plate, loads=[load])


INNER, OUTER, YIELD_STRESS = 1.0, 2.0, 0.001
LIMIT = 2 * YIELD_STRESS / np.sqrt(3) * np.log(OUTER / INNER)  # Hill (1950)


def thick_cylinder(n: int, *, quads: bool, degree: int) -> System:
    """A slice of a perfectly plastic tube, ``n`` square cells across its wall, whose inner wall
    moves outward until it yields throughout, and twice as far."""

    def build(gmsh) -> None:
        face = gmsh.model.occ.addRectangle(INNER, 0, 0, OUTER - INNER, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="tube")
        sides = gmsh.model.getBoundary([(2, face)], oriented=False)
        for (_, side), name in zip(sides, ("bottom", "outside", "top", "wall"), strict=True):
            gmsh.model.addPhysicalGroup(1, [side], name=name)
            gmsh.model.mesh.setTransfiniteCurve(side, n + 1)
        gmsh.model.mesh.setTransfiniteSurface(face)

    mesh = gmsh_to_mesh(MPI.COMM_SELF, build, quads=quads)
    tube = Body("tube", J2Material(1.0, 0.499, "axisymmetric", LinearHardening(YIELD_STRESS)))
    held = [Dirichlet("bottom", "bottom", 1), Dirichlet("top", "top", 1)]
    supports = [Dirichlet("wall", "wall", 0, 1.0), *held]
    problem = Problem(mesh, [tube], supports=supports, degree=degree, kinematics=AXISYMMETRIC)
    system = System(problem)
    plastic = 2 * np.sqrt(3) * YIELD_STRESS * OUTER**2 / 2 / INNER  # wall's motion at full flow
    system.solve(plastic * np.array([0.5, 1.1, 2.0]))
    return system


@pytest.mark.parametrize(
    ("quads", "degree", "least", "most"),
    [(False, 2, 0.0, 1e-3), (True, 3, 0.0, 1e-3), (True, 2, 0.02, 0.09)],
    ids=["triangles", "cubic quads", "quads"],
)
def test_a_plastic_tube_carries_hills_pressure_or_a_warning_says_how_much_more(
    quads, degree, least, most
):
    """Two dofs along the radius do not keep the volume at three points: second-order
    quadrilaterals are too stiff, as the warning says."""
    system = thick_cylinder(4, quads=quads, degree=degree)
    pressure = system.reaction("wall")[0] / (2 * np.pi * INNER)
    assert least <= pressure / LIMIT - 1 < most
    warned = stiff_quadrilaterals(system)
    assert bool(warned) == (quads and degree == 2)
    if warned:
        assert "2 % to 9 % with four" in warned[0]

"""Problems in space as a user states them: supports, loads and couplings along and about three
axes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import archord
from archord import Body, Coupling, Interaction, Load, Problem, Support, boxes
from archord.materials.elasticity import Elastic
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from tests.materials.test_space import ASKEW
from tests.solver.contact.blocks_in_space import bodies, tagged
from tests.solver.space import E, box

SIZE = np.array([1.0, 2.0, 1.5])
AREA = SIZE[0] * SIZE[1]
MIDDLE = (0.5, 1.0, 1.5)
NO_NU = Elastic(E, 0.0)
ROLLERS = [Support(side, fixed=side[0]) for side in ("x0", "y0", "z0")]
WALL = [Support("wall", "z0")]


def solved(comm, loads, supports, couplings=(), loads_at=(1.0,), **options) -> System:
    """The body "box", without contraction across, under these ``loads``; no step is cut."""
    problem = Problem(
        box(comm, (2, 2, 2), SIZE),
        [Body("box", NO_NU)],
        supports=supports,
        loads=loads,
        couplings=couplings,
        **options,
    )
    system = System(problem)
    system.solve(loads_at, StepRules(minimum=1.0))
    return system


TENSION = 2e-4 * E
PULLS = {
    "displacement": 2e-4 * SIZE[2],
    "force": TENSION * AREA,
    "pressure": -TENSION,
}


@pytest.mark.mpi
@pytest.mark.parametrize("kind", PULLS)
def test_a_face_is_pulled(kind, comm):
    """By a displacement, a force and a pressure alike."""
    direction = None if kind == "pressure" else "z"
    load = Load("pull", on="z1", direction=direction, **{kind: PULLS[kind]})
    system = solved(comm, [load], ROLLERS)
    u = system.equilibrium.displacement()
    x = system.V.tabulate_dof_coordinates()
    np.testing.assert_allclose(u, x * [0, 0, 2e-4], rtol=0, atol=1e-11)
    np.testing.assert_allclose(system.reaction("z0"), [0, 0, -TENSION * AREA], atol=1e-7)


@pytest.mark.mpi
def test_a_weight_on_cells(comm):
    """Of the whole body, or in a ball, along y."""
    ball = ((0.5, 1.0, 0.7), 0.6)
    for core in (None, ball):
        system = solved(comm, [Load("weight", on="box", direction="y", force=3.0, core=core)], WALL)
        np.testing.assert_allclose(system.reaction("wall"), [0, -3.0, 0], rtol=0, atol=1e-8)


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["rigid", "distributing"])
@pytest.mark.parametrize(("axis", "other"), [("x", 1), ("y", 0)])
def test_a_moment_bends_a_box_as_beams_bend(axis, other, kind, comm):
    """M = E I kappa, exactly where nu = 0; the end goes aside by theta L / 2."""
    theta = 1e-4
    width = SIZE[other]
    moment = E * AREA * width**2 / 12 * theta / SIZE[2]
    end = Coupling("end", "z1", MIDDLE, kind)
    found = []
    for given in ({"force": moment}, {"displacement": theta}):
        load = Load("turn", on="end", direction=f"rotation {axis}", **given)
        system = solved(comm, [load], WALL, [end])
        found.append(system)
        assert system.drive_displacement("turn") == pytest.approx(theta, rel=1e-7)
        assert system.drive_force("turn") == pytest.approx(moment, rel=1e-7)
        moments = np.zeros(3)
        moments["xyz".index(axis)] = -moment
        at_wall = system.reaction_moments("wall", (7.0, 3.0, 1.0))
        np.testing.assert_allclose(at_wall, moments, atol=1e-7 * moment)
        u = system.equilibrium.displacement()
        z = system.V.tabulate_dof_coordinates()[:, 2]
        sign = 1 if axis == "y" else -1
        aside = sign * theta * z**2 / (2 * SIZE[2])
        np.testing.assert_allclose(u[:, other], aside, rtol=0, atol=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("kind", ["rigid", "distributing"])
def test_a_coupling_moves_a_free_body(kind, comm):
    """Along and about all axes, rigidly."""
    values = np.array([0.1, -0.2, 0.3, 1e-3, -2e-3, 3e-3])
    names = ("x", "y", "z", "rotation x", "rotation y", "rotation z")
    loads = [
        Load(f"by {name}", on="arm", direction=name, displacement=value)
        for name, value in zip(names, values, strict=True)
    ]
    point = np.array([0.3, -0.2, 2.0])
    system = solved(comm, loads, (), [Coupling("arm", "z1", tuple(point), kind)])
    arm = system.V.tabulate_dof_coordinates() - point
    expected = values[:3] + np.cross(values[3:], arm)
    np.testing.assert_allclose(system.equilibrium.displacement(), expected, atol=1e-8)
    np.testing.assert_allclose(system.driven()[1], 0, atol=1e-8 * E)


COLUMN = [Support(side, fixed=axis) for side, axis in (("left", "x"), ("front", "y"))]
COLUMN.append(Support("base", fixed="z"))


def column(comm, loads, supports, sunk=0.0, steps=(1.0,), **contact) -> System:
    """A block on another one, in which it is ``sunk``, without contraction across."""
    blocks = bodies(comm)
    mesh = tagged(blocks)
    upper = np.unique(mesh.mesh.geometry.dofmap[blocks.cells["upper"]])
    mesh.mesh.geometry.x[upper, 2] -= sunk
    interaction = Interaction("joint", ("upper", "lower"), **contact)
    solids = [Body(name, NO_NU) for name in ("lower", "upper")]
    problem = Problem(
        mesh, solids, [interaction], supports, loads, kinematics="space", tolerance=1e-12
    )
    system = System(problem)
    system.solve(steps)
    return system


@pytest.mark.parametrize("fit", ["interference", "overlap"])
def test_a_fit_presses_bodies_against_each_other(fit, comm):
    """By E times the fit over the length, in the stage before the loads; then a lid that is lifted
    takes some of it back."""
    sunk = 0.001 if fit == "overlap" else 0.0
    load = Load("lift", on="lid", direction="z", displacement=0.0004)
    system = column(comm, [load], COLUMN, sunk, **{fit: 0.001})
    assert system.reaction("lift")[2] == pytest.approx(-E * 0.001 / 2, rel=1e-3)
    system.solve([2.0])
    assert system.reaction("lift")[2] == pytest.approx(-E * 0.0006 / 2, rel=1e-3)


@pytest.mark.parametrize("law", [{}, {"law": "tied"}, {"friction": 0.3}], ids=str)
def test_a_force_presses_a_block_that_floats(law, comm):
    """Onto another one that is held; frictionless, springs keep it from sliding and turning."""
    force = -2e-4 * E
    base = [Support("base", fixed="xyz")]
    load = Load("press", on="lid", direction="z", force=force)
    system = column(comm, [load], base, **law)
    assert system.drive_displacement("press") == pytest.approx(-4e-4, rel=1e-3)
    np.testing.assert_allclose(system.reaction("base"), [0, 0, -force], atol=1e-5)
    assert system.stabilisation_energy < 1e-6 * system.energies()[0]


@pytest.mark.parametrize("steps", [2, [2]])
def test_a_coupling_is_at_the_origin_and_the_path_has_the_steps_unless_told(steps, comm):
    """The moment of an even pressure about the origin, at the end of every step."""
    load = Load("press", on="end", direction="z", displacement=-2e-4 * SIZE[2])
    problem = Problem(
        box(comm, (1, 1, 1), SIZE),
        [Body("box", NO_NU)],
        supports=WALL,
        loads=[load],
        couplings=[Coupling("end", "z1")],
        steps=steps,
    )
    system = System(problem)
    system.solve()
    assert problem.couplings[0].point == (0.0, 0.0, 0.0)
    assert problem.targets == [0.5, 1.0]
    assert system.drive_displacement("press") == pytest.approx(-2e-4 * SIZE[2])


def test_a_tie_pulls(comm):
    load = Load("pull", on="lid", direction="z", displacement=4e-4)
    system = column(comm, [load], COLUMN, law="tied")
    assert system.reaction("pull")[2] == pytest.approx(2e-4 * E, rel=1e-3)


REFUSED = {
    "the distributing coupling 'end' is of a half in space": {
        "couplings": [Coupling("end", "z1", MIDDLE, "distributing")],
        "symmetry": 2,
    },
    "'rotation' has the direction 'rotation', but here are x, y, z, rotation x": {
        "loads": [Load("rotation", on="end", direction="rotation", force=1.0)]
    },
    r"coupling 'end' does not fit: point = \(0.0, 1.0\) must be 3 numbers": {
        "couplings": [Coupling("end", "z1", (0.0, 1.0))]
    },
    "load 'core' does not fit: core.centre .* must be 3 numbers": {
        "loads": [Load("core", "box", "z", force=1.0, core=((0.0, 0.0), 1.0))]
    },
    'fixes the rotation z of .z0., which is no coupling: a set is held in "x" and "y" and "z"': {
        "supports": [Support("z0", fixed=["z", "rotation z"])]
    },
    "load 'turn' turns 'z1', which is no coupling": {
        "loads": [Load("turn", "z1", "rotation x", displacement=0.1)]
    },
    "moves 'z1' by 50, but the whole mesh is 2 large": {
        "loads": [Load("far", "z1", "z", displacement=50.0)]
    },
}


@pytest.mark.parametrize("said", REFUSED)
def test_what_does_not_fit_space_is_refused(said, comm):
    given = {
        "supports": WALL,
        "loads": [Load("press", "z1", "z", force=1.0)],
        "couplings": [Coupling("end", "z1", MIDDLE)],
    }
    problem = Problem(
        box(comm, (1, 1, 1), SIZE),
        [Body("box", NO_NU)],
        kinematics="space",
        **given | REFUSED[said],
    )
    with pytest.raises(ValueError, match=said):
        System(problem)


def test_what_does_not_fit_a_plane_is_refused():
    mesh = archord.rectangles({"block": (0.0, 0.0, 2.0, 1.0)}, size=0.5)
    load = Load("press", "block top", "z", force=1.0)
    problem = Problem(mesh, [Body("block", NO_NU)], loads=[load])
    with pytest.raises(ValueError, match="load 'press' has the direction 'z', but here are x, y"):
        System(problem)


ANGLE = np.radians(37.0)
ABOUT = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
TURNS = ("rotation x", "rotation y", "rotation z")


@pytest.mark.mpi
def test_a_finite_rotation_leaves_no_stress_at_large_strain(comm):
    """By 37 degrees about (1, 2, 3), of a side of a body that nothing else holds."""
    loads = [
        Load(name, on="arm", direction=name, displacement=float(angle))
        for name, angle in zip(TURNS, ANGLE * ABOUT, strict=True)
    ]
    point = np.array([0.3, -0.2, 2.0])
    held = [Support("arm held", on="arm", fixed="xyz")]
    coupling = [Coupling("arm", "z1", tuple(point))]
    system = solved(comm, loads, held, coupling, loads_at=np.arange(1, 9) / 8, strain="large")
    arm = system.V.tabulate_dof_coordinates() - point
    expected = arm @ (ASKEW - np.eye(3)).T
    np.testing.assert_allclose(system.equilibrium.displacement(), expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(system.driven()[0], ANGLE * ABOUT, rtol=1e-12)
    np.testing.assert_allclose(system.driven()[1], 0, atol=1e-8 * E)
    assert system.energies()[0] < 1e-12 * E


@pytest.mark.mpi
def test_the_moment_of_a_finite_rotation_does_its_work(comm):
    """The energy of a twisted box is the integral of the moment over the angle (Simpson's rule)."""
    load = Load("twist", on="end", direction="rotation z", displacement=0.5)
    held = [Support("guide", on="end", fixed=["x", "y", "z", "rotation x", "rotation y"])]
    end = [Coupling("end", "z1", MIDDLE)]
    problem = Problem(
        box(comm, (2, 2, 2), SIZE),
        [Body("box", NO_NU)],
        supports=[*WALL, *held],
        loads=[load],
        couplings=end,
        strain="large",
        tolerance=1e-11,
    )
    system = System(problem)
    moments = [0.0]
    for k in range(1, 9):
        system.solve([k / 8])
        moments.append(system.drive_force("twist"))
    weights = np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]) * 0.5 / 24
    assert system.energies()[0] == pytest.approx(weights @ moments, rel=1e-4)
    assert system.drive_displacement("twist") == 0.5


def test_a_rigid_coupling_turns_beyond_a_right_angle_at_large_strain(tmp_path):
    """Where all its rotations are prescribed: a block that turns with it is not strained."""
    angle = 4.0
    mesh = boxes({"block": (1, 0, 0, 1, 1, 1)}, size=1.0)
    problem = Problem(
        mesh,
        [Body("block", Elastic(210e3, 0.3))],
        supports=[Support("hinge", on="pin", fixed=["x", "y", "z", "rotation x", "rotation y"])],
        couplings=[Coupling("pin", "block left", (0, 0, 0))],
        loads=[Load("turn", on="pin", direction="rotation z", displacement=angle)],
        strain="large",
        steps=3,
    )
    run = archord.solve(problem, tmp_path, fields="cells")
    turned = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
    x = run.fields().coordinates
    np.testing.assert_allclose(run.fields().displacement, x @ (turned.T - np.eye(3)), atol=1e-9)
    assert run.history["elastic_energy"].max() < 1e-12

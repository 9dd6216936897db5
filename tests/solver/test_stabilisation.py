"""Bodies that float until they touch: sleeves with clearance, pins under a force, discs."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.geometry.curve import RigidCircle
from archord.geometry.shapes.bushing import bushing
from archord.geometry.shapes.lug import lug
from archord.geometry.shapes.rectangles import rectangles
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.solver.path.stepping import StepFailure, StepRules, march
from archord.solver.path.system import System
from archord.solver.problem import (
    Body,
    Coupling,
    DeadLoad,
    Dirichlet,
    Drive,
    Interaction,
    Load,
    Mean,
    Problem,
    Rigid,
    Support,
)
from tests.solver.contact.blocks_in_space import bodies, tagged
from tests.solver.parts import ELASTIC, E, blocks, solve

STEEL = Elastic(210000.0, 0.3, "strain")
YIELDING = J2Material(210000.0, 0.3, "strain", LinearHardening(400.0, 2000.0))


def steps_of(problem: Problem, loads) -> tuple[System, float]:
    """The system at the last of the ``loads``, none of which may be cut, and the work of its one
    drive."""
    system = System(problem)
    work = 0.0
    before = np.zeros(2)
    for load in loads:
        system.solve([load], StepRules(minimum=1.0))
        now = np.concatenate(system.driven())
        work += (now[0] - before[0]) * (now[1] + before[1]) / 2
        before = now
    return system, work


def sleeves(comm=MPI.COMM_SELF, material=STEEL) -> Problem:
    """A pin that is pushed through the clearances of two sleeves, which nothing else holds along
    the push."""
    mesh = bushing(comm, 10.0, [(10.05, 12.0), (12.03, 14.0), (14.04, 30.0)], 1.5, 0.4)
    between = {"a": ("pin", "sleeve 1 inside"), "b": ("sleeve 1 outside", "sleeve 2 inside")}
    between["c"] = ("sleeve 2 outside", "bore")
    supports = [Dirichlet("axis", "axis", 1), Dirichlet("flat", "flat", 0, 1.0)]
    supports += [Dirichlet("edge", "outer edge", axis) for axis in (0, 1)]
    bodies = [
        Body(name, STEEL if name == "pin" else material)
        for name in ("pin", "sleeve 1", "sleeve 2", "housing")
    ]
    interactions = [Interaction(name, surfaces) for name, surfaces in between.items()]
    return Problem(mesh, bodies, interactions, supports, symmetry=2.0, stabilise=True)


@pytest.mark.parametrize("away", [0.0, 1e5])
def test_what_is_held_is_not_loose_however_far_from_the_origin(away):
    """Else weak springs never rest, and the slip of what touches newly counts from elsewhere."""
    mesh = archord.rectangles({"lower": (away, -away, 4, 1), "upper": (away, 1 - away, 4, 1)}, 1.0)
    problem = Problem(
        mesh,
        bodies=[Body("lower", STEEL), Body("upper", STEEL)],
        interactions=[Interaction("rub", ("upper bottom", "lower top"), friction=0.3)],
        supports=[Support("lower bottom"), Support("upper top", fixed="x")],
        loads=[Load("press", on="upper top", direction="y", force=-100.0)],
        steps=1,
    )
    system = System(problem)
    springs = system.equilibrium.springs
    assert [body.name for body in springs.rigid.loose] == ["upper"]
    system.solve([1.0])
    assert springs.idle


def test_forces_on_what_is_held_push_nothing():
    """Round-off of theirs was the least push, beside which springs carried too much: the run
    stopped, as if nothing held the foot that is glued to a bar."""
    mesh = archord.rectangles({"bar": (0, 0, 6, 2), "foot": (0.5, -0.5, 1, 0.5)}, 0.5)
    problem = Problem(
        mesh,
        bodies=[Body("bar", STEEL), Body("foot", STEEL)],
        interactions=[Interaction("glue", ("foot top", "bar bottom"), law="tied")],
        couplings=[Coupling("end", "bar right", point=(6.5, 1.0))],
        supports=[Support("bar left"), Support("foot bottom", fixed="y")],
        loads=[
            Load("shear", on="end", direction="y", force=2.0),
            Load("bend", on="end", direction="rotation", force=3.0),
            Load("pull", on="end", direction="x", force=6.0),
        ],
        steps=1,
    )
    system = System(problem)
    assert system.equilibrium.springs.rigid.least_push(1.0) == 0.0
    system.solve([1.0], StepRules(minimum=1.0))
    assert system.reaction("bar left")[0] == pytest.approx(-6.0, rel=1e-6)


def test_shear_does_not_depend_on_how_loose_bodies_came_to_rest():
    """Slip counts from where they touch down, which is found to round-off: a thousandth of the
    force off, the shear would be so, too."""

    def shear(away: float) -> float:
        boxes = {
            "lower": (0.0, 0.0, 4.0, 1.0),
            "middle": (0.4, 1.01, 2.7, 1.0),
            "upper": (0.8, 2.03, 2.1, 1.0),
        }
        mesh = rectangles(boxes, 0.5, MPI.COMM_SELF)
        mesh.mesh.geometry.x[:, 0] += away
        between = {"below": ("middle bottom", "lower top"), "above": ("upper bottom", "middle top")}
        problem = Problem(
            mesh,
            bodies=[Body(name, Elastic(1000.0, 0.3)) for name in boxes],
            interactions=[Interaction(name, both, friction=0.3) for name, both in between.items()],
            couplings=[
                Coupling("top", "upper top", (away + 1.7, 3.2), "distributing"),
                Coupling("side", "middle left", (away + 0.4, 1.5), "distributing"),
            ],
            supports=[
                Support("lower bottom"),
                Support("side", fixed="x"),
                Support("top", fixed="x"),
            ],
            loads=[Load("push", on="top", direction="y", force=-10.0)],
            steps=1,
        )
        system = System(problem)
        system.solve([1.0])
        return float(system.contact_force("above")[0])

    assert shear(200.0) == pytest.approx(shear(0.0), rel=1e-6)


@pytest.mark.mpi
@pytest.mark.parametrize("material", [STEEL, YIELDING], ids=["elastic", "yielding"])
def test_floating_sleeves_hand_the_whole_force_on(comm, material):
    """From no contact at all, in steps of which some close a part of the clearance of 0.12: the
    springs' share of force and work is below 1e-6, and the result does not depend on the steps that
    it took, if all is elastic."""
    system, work = steps_of(sleeves(comm, material), [0.03, 0.09, 0.15, 0.2])
    P = system.drive_force("")
    for name in "abc":
        np.testing.assert_allclose(
            system.contact_force(name), [P, system.contact_force(name)[1]], rtol=1e-6
        )
    assert system.reaction("edge")[0] == pytest.approx(-P, rel=1e-6)
    assert 0 < system.stabilisation_energy < 1e-6 * work
    if material is STEEL:
        at_once, _ = steps_of(sleeves(comm, material), [0.2])
        assert at_once.drive_force("") == pytest.approx(P, rel=1e-6)


@pytest.mark.parametrize(("times", "nu"), [(1e6, 0.3), (1.0, 0.4999)])
def test_springs_stay_weak_beside_a_far_softer_body(times, nu):
    """The springs of sleeves a million times as stiff as the rest, also of nearly incompressible
    ones, do less than a millionth of the work."""
    system, work = steps_of(
        sleeves(material=Elastic(times * 210000.0, nu, "strain")), [0.1, 0.15, 0.2]
    )
    assert 0 < system.stabilisation_energy < 1e-6 * work
    np.testing.assert_allclose(system.reaction("edge")[0], -system.drive_force(""), rtol=1e-5)


@pytest.mark.parametrize("half", [True, False], ids=["half", "whole"])
def test_a_pin_under_a_force_finds_its_hole(half):
    """Concentric with clearance at first: nothing resists the force but springs. The whole pin may
    turn, too."""
    mesh = lug(MPI.COMM_SELF, 10.0, 0.1, 40.0, 20.0, 60.0, 1.5, 0.4, half=half, pin="whole")
    supports = [Dirichlet("clamp", "clamp", axis) for axis in (0, 1)] + [
        Dirichlet("axis", "axis", 1)
    ] * half
    bodies = [Body("pin", STEEL), Body("lug", STEEL)]
    contact = Interaction("contact", ("pin", "hole"))
    loads = [DeadLoad("pin", (-1.0, 0.0), drive="pull")]
    drives = [Drive("pull", (0, 4000.0))]
    problem = Problem(
        mesh, bodies, [contact], supports, loads, drives=drives, symmetry=1.0 + half, stabilise=True
    )
    system, work = steps_of(problem, [0.25, 0.5, 1.0])
    assert system.driven()[0][0] > 0.2  # through the whole clearance, and beyond
    np.testing.assert_allclose(system.reaction("clamp")[0], 4000, rtol=1e-6)
    np.testing.assert_allclose(system.contact_force("contact")[0], -4000, rtol=1e-6)
    assert 0 < system.stabilisation_energy < 1e-6 * work


def test_a_disc_under_a_force_finds_its_body():
    """Half its radius away from it at first."""
    disc = Rigid(RigidCircle(np.array([0.5, 4.0]), 2.0), {"down": (0.0, -1.0), "aside": (1.0, 0.0)})
    paths = [Drive("down", (0, 0.1), "force"), Drive("aside", (0, 0.0))]
    supports = [
        Dirichlet("base", facets, axis) for facets in ("base", "upper bottom") for axis in (0, 1)
    ]
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    contact = [Interaction("contact", (disc, "lid"))]
    problem = Problem(
        blocks(MPI.COMM_SELF, 3, 6), bodies, contact, supports, drives=paths, stabilise=True
    )
    system = solve(problem, [1.0])
    assert system.drive_displacement("down") > 1.0
    assert system.contact_force("contact")[1] == pytest.approx(-0.1, rel=1e-6)
    assert system.stabilisation_energy < 1e-6 * 0.1 * E


def test_bodies_that_supports_hold_get_no_springs():
    """Also not those that a coupling holds; a rigid reference point that a force moves does not
    hold."""

    def springs(mesh=None, **parts):
        problem = Problem(blocks(MPI.COMM_SELF, 2, 3), bodies, (), stabilise=True, **parts)
        return System(problem).equilibrium.springs

    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    held = [Dirichlet("base", facets, axis) for facets in ("base", "lid") for axis in (0, 1)]
    assert springs(supports=held) is None
    assert springs(supports=held[:3]) is not None
    pushed = [*held[:2], Dirichlet("lid", "lid", 0), Dirichlet("lid", "lid", 1, 1.0, "push")]
    assert springs(supports=pushed, drives=[Drive("push", (0, 1.0))]) is None
    assert springs(supports=pushed, drives=[Drive("push", (0, 1.0), "force")]) is not None


def test_a_mean_motion_of_half_an_edge_is_that_of_the_whole():
    """A pin's flat face moved in the mean: half of it on the axis of symmetry, and all of it."""
    found = []
    for half in (True, False):
        mesh = lug(MPI.COMM_SELF, 10.0, 0.1, 40.0, 20.0, 60.0, 1.5, 0.4, half=half)
        supports = [Dirichlet("clamp", "clamp", axis) for axis in (0, 1)] + [
            Dirichlet("axis", "axis", 1)
        ] * half
        bodies = [Body("pin", STEEL), Body("lug", STEEL)]
        contact = Interaction("contact", ("pin", "hole"))
        means = [Mean("flat", "flat", 0, None if half else (0.1, 0.0), "pull")]
        drives = [Drive("pull", (0, 0.1))]
        parts = {"means": means, "drives": drives, "symmetry": 1.0 + half, "stabilise": True}
        found.append(
            steps_of(Problem(mesh, bodies, [contact], supports, **parts), [0.5, 1.0])[
                0
            ].drive_force("pull")
        )
    assert found[0] == pytest.approx(found[1], rel=1e-4)


def ball(unloading: int) -> Problem:
    """A rigid ball that a force presses into steel, which yields, and that is let go."""
    return Problem(
        rectangles({"block": (0.0, -4.0, 4.0, 4.0)}, size=0.5),
        [Body("block", material="S355")],
        [Interaction("contact", (RigidCircle(np.array([0.0, 5.0]), 5.0), "block top"))],
        [Support("block bottom", fixed="y")],
        [Load("ball", on="contact", direction="y", force=[-3000.0, 0.0])],
        steps=[4, unloading],
        kinematics="axisymmetric",
        strain="large",
    )


def test_a_ball_that_is_let_go_stays_on_its_body():
    """Newton's method may find the ball on its springs alone, far below the block. This state does
    not count: the ball rises by elastic unloading, in steps of any length, until no force is
    left."""
    depths = []
    for unloading in (1, 4):
        system = System(ball(unloading))
        path = np.concatenate([np.linspace(0.25, 1, 4), 1 + np.linspace(0, 1, unloading + 1)[1:]])
        moved = []
        march(
            system.load_path(),
            list(path),
            substep_done=lambda load, s=system, m=moved: m.append(s.drive_displacement("ball")),
        )
        assert min(moved) > -0.1
        deepest = int(np.argmin(moved))
        assert (np.diff(moved[deepest:]) > 0).all()
        assert moved[-1] < 0.8 * moved[deepest]
        assert abs(system.contact_force("contact")[1]) < 1e-4 * 3000
        depths.append(moved[-1])
    assert depths[0] == pytest.approx(depths[1], rel=1e-3)


def pulled_off(kinematics: str) -> Problem:
    """A block that a force presses onto another, lets go, and pulls off."""
    if kinematics == "space":
        mesh = tagged(bodies(MPI.COMM_SELF))
        base, lid, faces, walls = "lower", "upper", ("upper", "lower"), ("left", "front")
    else:
        mesh = rectangles({"base": (0.0, 0.0, 2.0, 1.0), "lid": (0.0, 1.0, 2.0, 1.0)}, size=0.5)
        base, lid, faces, walls = "base", "lid", ("base top", "lid bottom"), ("lid left",)
    floor, up = ("base", "z") if kinematics == "space" else ("base bottom", "y")
    supports = [Support(floor, fixed="xyz" if kinematics == "space" else "xy")]
    supports += [Support(wall, fixed=axis) for wall, axis in zip(walls, "xy", strict=False)]
    return Problem(
        mesh,
        [Body(name, Elastic(210e3, 0.3)) for name in (base, lid)],
        [Interaction("contact", faces)],
        supports,
        [Load("load", on=lid, direction=up, force=[-10.0, 0.0, 10.0])],
        kinematics=kinematics,
        steps=1,
    )


@pytest.mark.parametrize("kinematics", ["plane strain", "plane stress", "axisymmetric", "space"])
def test_a_step_in_which_springs_alone_hold_a_body_is_not_accepted(kinematics):
    """A block that is pulled off another: no force is so small that it would be accepted. The body
    is named, and the accepted state is left."""
    problem = pulled_off(kinematics)
    system = System(problem)
    system.solve([1.0, 2.0])
    settled = system.equilibrium.state()
    said = f"no contact carries {problem.bodies[1].name!r}; hold it by a support"
    with pytest.raises(StepFailure, match=said):
        system.solve([3.0], StepRules(minimum=0.05, cutback=0.05))  # a large step and a small one
    np.testing.assert_array_equal(system.equilibrium.state(), settled)
    assert np.abs(settled).max() < 1e-3


@pytest.mark.parametrize("in_space", [False, True])
@pytest.mark.parametrize(
    ("direction", "force", "floor", "most"),
    [("y", -1.0, False, 0), ("y", 1.0, True, 1), ("x", 1.0, True, 1)],
    ids=["both float", "lifted", "pushed along"],
)
def test_what_no_contact_can_hold_is_refused_at_once(in_space, direction, force, floor, most):
    """A force that no contact of whatever pressure balances, without smaller and smaller steps."""
    if in_space:
        mesh = archord.boxes({"base": (0, 0, 0, 2, 1, 2), "lid": (0.5, 1, 0.5, 1, 1, 1)}, 1.0)
    else:
        mesh = rectangles({"base": (0.0, 0.0, 2.0, 1.0), "lid": (0.5, 1.0, 1.0, 1.0)}, size=0.5)
    problem = Problem(
        mesh,
        [Body(name, Elastic(210e3, 0.3)) for name in ("base", "lid")],
        [Interaction("contact", ("lid bottom", "base top"))],
        [Support("base bottom")] if floor else [],
        [Load("load", on="lid top", direction=direction, force=force)],
    )
    with pytest.raises(
        StepFailure, match=r"no contact carries '(lid|base)'.*no smaller step helps"
    ) as raised:
        System(problem).solve([1.0])
    assert raised.value.attempt.cutbacks <= most


def test_forces_that_balance_push_nothing_away():
    """Their resultant is round-off, which has a direction, too."""
    loads = [
        Load(f"from {side}", on=f"lid {side}", direction="x", force=force)
        for side, force in {"left": 1e3, "right": -1e3}.items()
    ]
    problem = Problem(
        rectangles({"base": (0.0, 0.0, 3.0, 1.0), "lid": (0.5, 1.0, 1.0, 1.0)}, size=0.5),
        [Body(name, Elastic(210e3, 0.3)) for name in ("base", "lid")],
        [Interaction("contact", ("lid bottom", "base top"))],
        [Support("base bottom")],
        loads,
    )
    springs = System(problem).equilibrium.springs
    assert springs is not None
    assert springs.rigid.unheld(1.0) == ""


def test_a_disc_that_is_pulled_away_is_named():
    problem = Problem(
        rectangles({"base": (0.0, 0.0, 3.0, 1.0)}, size=0.5),
        [Body("base", Elastic(210e3, 0.3))],
        [Interaction("roller", (RigidCircle((1.5, 2.0), 1.0), "base top"))],
        [Support("base bottom")],
        [Load("lift", on="roller", direction="y", force=1.0)],
    )
    with pytest.raises(StepFailure, match="no contact carries 'roller'"):
        System(problem).solve([1.0])


def test_a_force_across_a_smooth_contact_may_be_held_by_a_wall():
    """Where another contact is in the way, or friction, nothing is refused before it is tried."""
    boxes = {
        "base": (0.0, 0.0, 3.0, 1.0),
        "lid": (0.5, 1.0, 1.0, 1.0),
        "wall": (1.6, 1.0, 1.0, 1.0),
    }
    contacts = [
        Interaction("contact", ("lid bottom", "base top")),
        Interaction("stop", ("lid right", "wall left")),
    ]
    problem = Problem(
        rectangles(boxes, size=0.5),
        [Body(name, Elastic(210e3, 0.3)) for name in boxes],
        contacts,
        [Support("base bottom"), Support("wall right"), Support("lid left", fixed="y")],
        [Load("load", on="lid left", direction="x", force=1.0)],
    )
    system = System(problem)
    system.solve([1.0])
    assert system.contact.resultant("stop")[0] == pytest.approx(1.0, rel=1e-6)


def carried_by_base(kinematics: str, length: float) -> tuple[float, float]:
    """What the base lacks of the force on a block that nothing but contact holds, over this force;
    and how far the block goes, over the ``length`` of its edges."""
    if kinematics == "space":
        mesh = tagged(bodies(MPI.COMM_SELF))
        base, faces, lid, down = "base", ("upper", "lower"), "upper", "z"
        names = ("lower", "upper")
    else:
        boxes = {"base": (0.0, 0.0, 1.0, 1.0), "lid": (0.0, 1.0, 1.0, 1.0)}
        mesh = rectangles(boxes, size=0.5)
        base, faces, lid, down = "base bottom", ("base top", "lid bottom"), "lid", "y"
        names = ("base", "lid")
    mesh.mesh.geometry.x[:] *= length
    force = 20.0 * length ** (2 if kinematics in ("axisymmetric", "space") else 1)
    problem = Problem(
        mesh,
        [Body(name, Elastic(210e3, 0.3)) for name in names],
        [Interaction("contact", faces)],
        [Support(base)],
        [Load("press", on=lid, direction=down, force=-force)],
        kinematics=kinematics,
    )
    system = System(problem)
    system.solve([1.0])
    lacking = system.reaction(base)[-1] / force - 1
    return float(lacking), system.drive_displacement("press") / length


@pytest.mark.parametrize("gamma_factor", [0.5, 2.0])
@pytest.mark.parametrize(
    ("on", "integrated"), [("upper", "lower"), ("lid", ""), ("lid", "upper"), ("lid", "lower")]
)
def test_springs_carry_nothing_of_a_tiny_force_through_a_gap(on, integrated, gamma_factor):
    """A block falls through a gap of a tenth of its height under 1e-7 of E times its face. Springs
    that begin where it has come from carry 1.3 % of the force."""
    mesh = tagged(bodies(MPI.COMM_SELF))
    x = mesh.mesh.geometry.x
    upper = mesh.mesh.geometry.dofmap[mesh.cells_in("upper")]
    x[np.unique(upper), 2] += 0.1
    force = 210e3 * 1e-7
    problem = Problem(
        mesh,
        [Body(name, Elastic(210e3, 0.3)) for name in ("lower", "upper")],
        [
            Interaction(
                "contact", ("upper", "lower"), integrated=integrated, gamma_factor=gamma_factor
            )
        ],
        [Support("base")],
        [Load("press", on=on, direction="z", force=-force)],
    )
    system = System(problem)
    system.solve([1.0])
    assert system.reaction("base")[-1] == pytest.approx(force, rel=1e-6)


@pytest.mark.parametrize("length", [1e-6, 1e3])
@pytest.mark.parametrize("kinematics", ["plane strain", "plane stress", "axisymmetric", "space"])
def test_springs_do_not_depend_on_the_unit_of_length(kinematics, length):
    """Millimetres, and units that are a million times as large or a thousandth as large: the base
    takes the same part of the force, all but what springs carry."""
    lacking, moved = carried_by_base(kinematics, 1.0)
    lacking_there, moved_there = carried_by_base(kinematics, length)
    assert abs(lacking) < 1e-6
    assert lacking_there == pytest.approx(lacking, abs=1e-8)
    assert moved_there == pytest.approx(moved, rel=1e-6)

"""A contact law of one file from outside: wear (Archard 1953), against closed forms, by finite
differences, on a pin that turns back and forth, and on any number of ranks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.materials.elasticity import Elastic
from archord.solver.contact.laws.law import (
    OPEN,
    SLIDE,
    SLIDE_BACK,
    Branches,
    ContactLaw,
    Quantity,
    Response,
)
from archord.solver.path.load_path import Position
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.path.stepping import march
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Drive, Interaction, Problem
from tests.solver.contact.test_tangent import assert_tangent_is_derivative
from tests.solver.parts import DR, blocks, commit, joint_parts
from tests.solver.test_friction import rings


@dataclass(frozen=True)
class WearState:
    """History of ``m`` points."""

    depth: np.ndarray  # (m,) worn away on both sides together


@dataclass(frozen=True)
class Wear(ContactLaw):
    """Contact without friction that wears by ``k p`` per slip, which opens the gap (in time
    backward Euler)."""

    k: float
    unit: str = "mm2"
    counts_slip = True
    unilateral = True

    def state(self, n):
        return WearState(np.zeros(n))

    def respond(self, opening, trial, gamma, state, dt):
        slip = opening[:, 1]
        stiffness = gamma[:, 0]
        unworn = trial[:, 0] - stiffness * state.depth
        touches = ~(unworn <= 0)
        softer = 1 + stiffness * self.k * np.abs(slip)
        pressure = np.where(touches, unworn / softer, 0.0)

        traction = np.zeros_like(trial)
        traction[:, 0] = pressure
        by_trial = np.zeros((len(trial), 2, 2))
        by_trial[:, 0, 0] = touches / softer
        by_opening = np.zeros((len(trial), 2, 2))
        by_opening[:, 0, 1] = -pressure * stiffness * self.k * np.sign(slip) / softer
        branch: Branches = np.where(touches, np.where(slip < 0, SLIDE_BACK, SLIDE), OPEN)
        depth = state.depth + self.k * pressure * np.abs(slip)
        return Response(traction, by_trial, by_opening, branch, WearState(depth))

    def quantities(self, state):
        return {"worn volume": Quantity(state.depth, self.unit)}


def test_the_derivatives_are_those_of_the_traction():
    """Of random points, by central differences."""
    draw = np.random.default_rng(0)
    law = Wear(0.3)
    m = 50
    h = 1e-6
    opening, trial = draw.normal(size=(2, m, 2))
    gamma = np.full((m, 2), 2.0)
    state = WearState(draw.uniform(0, 0.2, m))

    def traction(opening, trial):
        return law.respond(opening, trial, gamma, state, 1.0).traction

    given = law.respond(opening, trial, gamma, state, 1.0)
    assert 0 < (given.branch == OPEN).sum() < m
    for axis, step in enumerate(h * np.eye(2)):
        by_trial = (traction(opening, trial + step) - traction(opening, trial - step)) / (2 * h)
        by_opening = (traction(opening + step, trial) - traction(opening - step, trial)) / (2 * h)
        np.testing.assert_allclose(given.by_trial[:, :, axis], by_trial, atol=1e-8)
        np.testing.assert_allclose(given.by_opening[:, :, axis], by_opening, atol=1e-8)


@pytest.mark.parametrize("kinematics", ["current", "reference"])
@pytest.mark.parametrize("pin", ["elastic", "rigid"])
def test_the_tangent_follows_wear(kinematics, pin):
    """The derivative of the forces where the traction depends on the opening, too; worn before,
    and slipping by so much that wear halves the pressure."""
    material = Elastic(1.0, 0.3, "strain")
    parts = joint_parts(
        pin=material if pin == "elastic" else None,
        block=material,
        kinematics=kinematics,
        law=Wear(20.0),
    )
    contact = parts.contact
    for surface in contact.rigid:
        surface.motion = np.array([[DR / 2, -1.5 * DR]])
    before = parts.pressed(DR, noise=1e-4, seed=1)
    contact.evaluate(before)
    commit(contact)
    contact.begin(before)
    active = assert_tangent_is_derivative(parts, parts.pressed(2 * DR, noise=1e-4, seed=2))
    assert 0 < active < sum(pair.branch.size for pair in contact.pairs)
    assert max(np.abs(pair.by_opening).max() for pair in contact.pairs) > 0.1


STROKE = [0, 0, 0.02, -0.01]  # of the lid, at load factors 0, 1, 2, 3


def rubbed(comm: MPI.Comm, law: ContactLaw) -> System:
    """A block, pressed on another by a force of 1 and slid forth and back, without Poisson's
    effect."""
    steel = Elastic(1000.0, 0.0, "strain")
    contact = Interaction(
        "rub", ("upper bottom", "lower top"), law=law, kinematics="reference", gamma_factor=2.0
    )
    supports = [
        *(Dirichlet("base", "base", axis) for axis in (0, 1)),
        Dirichlet("lid x", "lid", 0, 1.0, "slide"),
        Dirichlet("lid y", "lid", 1, 1.0, "press"),
    ]
    drives = [Drive("slide", STROKE), Drive("press", [0, -1, -1, -1], "force")]
    bodies = [Body(name, steel) for name in ("lower", "upper")]
    return System(Problem(blocks(comm, 3, 4), bodies, [contact], supports, drives=drives))


@pytest.mark.mpi
def test_wear_under_a_constant_pressure_grows_with_slip(comm):
    """By Archard's law: a depth of k p times the path, by which the lid sinks; nothing before it
    slides, and as much on the way back."""
    k = 0.05
    system = rubbed(comm, Wear(k))
    system.solve([1.0])
    lid = system.drive_displacement("press")
    assert lid == pytest.approx(-2 / 1000.0, rel=1e-6)
    assert system.contact.interface("rub").quantities()["worn volume"][0] < 1e-15
    slid = np.abs(np.diff(STROKE)).cumsum()
    for load in (1.25, 2.0, 2.5, 3.0):
        system.solve([load])
        depth = k * np.interp(load, range(4), [0, *slid])
        volume, unit = system.contact.interface("rub").quantities()["worn volume"]
        assert unit == "mm2"
        assert volume == pytest.approx(depth, rel=1e-8)
        assert system.drive_displacement("press") == pytest.approx(lid - depth, rel=1e-8)
        for pair in system.contact.pairs:
            np.testing.assert_allclose(pair.pressure, 1.0, rtol=1e-7)


TURNS = [0, 0, 1e-4, -1e-4, 0.0]


def turned(comm: MPI.Comm, k: float, steps: int) -> tuple[list[float], list[float]]:
    """A ring pressed into another, turned back and forth: its force on the other one and the worn
    volume, from before the first turn on."""
    steel = Elastic(210e3, 0.3, "strain")
    turn = [
        Dirichlet("bore", "inside", 0, lambda x: -x[:, 1], "turn"),
        Dirichlet("bore", "inside", 1, lambda x: x[:, 0], "turn"),
    ]
    held = [Dirichlet("outside", "outside", axis) for axis in (0, 1)]
    fit = Interaction("fit", ("pin", "hole"), law=Wear(k), interference=0.01)
    bodies = [Body("inner", steel), Body("outer", steel)]
    problem = Problem(
        rings(comm, (6.0, 10.0, 18.0), 2.0),
        bodies,
        [fit],
        [*turn, *held],
        drives=[Drive("turn", TURNS)],
        fit=True,
    )
    system = System(problem)
    pressed = []
    worn = []
    for load in np.linspace(1, 4, 3 * steps + 1):
        system.solve([load])
        interface = system.contact.interface("fit")
        pressed.append(interface.pressed())
        worn.append(interface.quantities()["worn volume"][0])
    return pressed, worn


@pytest.mark.mpi
def test_a_pin_that_turns_back_and_forth_wears_its_fit_away(comm):
    """The pressure of a fit falls as it wears, by the factor 1 / (1 + k K ds) in each step, where K
    is pressure over interference: to exp(-k K s) in small steps; what is worn is the interference
    that was lost. On any number of ranks."""
    r = 10.0
    steps = 2
    k = 5e-3
    pressed, worn = turned(comm, k, steps)
    around = 2 * np.pi * r
    stiffness = pressed[0] / around / 0.01
    slip = r * np.abs(np.diff(np.interp(np.linspace(1, 4, 3 * steps + 1), range(5), TURNS)))
    left = np.cumprod(1 / (1 + k * stiffness * slip))
    assert left[-1] < 0.7
    np.testing.assert_allclose(np.array(pressed[1:]) / pressed[0], left, rtol=2e-3)
    np.testing.assert_allclose(worn[1:], around * 0.01 * (1 - left), rtol=2e-3)
    if comm.size > 1:
        alone, _ = turned(MPI.COMM_SELF, k, steps)
        np.testing.assert_allclose(pressed, alone, rtol=1e-9)


class Smooth(ContactLaw):
    """Regularised contact with regularised friction: smooth in gap and slip, and never open."""

    counts_slip = True
    has_friction = True
    width = 0.2  # pressure over which contact sets in
    friction = 0.3
    stick = 1e-4  # slip over which friction sets in

    def respond(self, opening, trial, gamma, state, dt):
        scaled = trial[:, 0] / self.width
        pressure = self.width * np.logaddexp(0.0, scaled)
        by_pressure = 1 / (1 + np.exp(-scaled))
        held = np.tanh(opening[:, 1] / self.stick)
        traction = np.stack([pressure, -self.friction * pressure * held], axis=1)
        by_trial = np.zeros((len(trial), 2, 2))
        by_trial[:, 0, 0] = by_pressure
        by_trial[:, 1, 0] = -self.friction * by_pressure * held
        by_opening = np.zeros((len(trial), 2, 2))
        by_opening[:, 1, 1] = -self.friction * pressure * (1 - held**2) / self.stick
        return Response(traction, by_trial, by_opening, np.full(len(trial), SLIDE), state)


@pytest.mark.mpi
def test_a_smooth_law_converges_quadratically_without_active_set_changes(comm):
    """Its one branch is counted as such, where derivatives change everywhere; the friction of the
    whole face is that of the force."""
    system = rubbed(comm, Smooth())
    solves = []
    newton = system.solver.newton
    newton.watch = lambda load, result: solves.append(result)
    for load in (1.0, 1.5, 2.0):
        system.solve([load])
    first, *_, last = solves
    assert not any(first.active_set_changes[1:])
    assert sum(last.active_set_changes) == 0
    before, after = last.residuals[-2:]
    assert before < 1e-3
    assert after < max(100 * before**2, 1e-12)
    assert system.drive_force("slide") == pytest.approx(Smooth.friction, rel=1e-6)


class Viscous(ContactLaw):
    """A film under pressure whose shear is ``eta`` times the rate of slip."""

    eta = 0.02
    counts_slip = True
    has_friction = True
    unilateral = True

    def respond(self, opening, trial, gamma, state, dt):
        touches = ~(trial[:, 0] <= 0)
        per_slip = np.where(touches, self.eta / dt if dt else 0.0, 0.0)
        traction = np.stack([np.where(touches, trial[:, 0], 0.0), -per_slip * opening[:, 1]], 1)
        by_trial = np.zeros((len(trial), 2, 2))
        by_trial[:, 0, 0] = touches
        by_opening = np.zeros((len(trial), 2, 2))
        by_opening[:, 1, 1] = -per_slip
        return Response(traction, by_trial, by_opening, np.where(touches, SLIDE, OPEN), state)


def test_a_law_knows_the_length_of_the_step():
    """A viscous film resists by the rate of slip, whatever the steps."""
    system = rubbed(MPI.COMM_SELF, Viscous())
    system.solve([1.0])
    for load, rate in ((1.5, 0.02), (1.75, 0.02), (2.0, 0.02), (2.1, -0.03), (3.0, -0.03)):
        system.solve([load])
        found = system.drive_force("slide")
        assert found == pytest.approx(Viscous.eta * rate, rel=1e-2), load


@pytest.mark.mpi
def test_wear_goes_on_from_a_checkpoint(comm):
    """The depth of every point comes back, and the path goes on as if it had not been left."""
    before = rubbed(comm, Wear(0.05))
    before.solve([1.0, 1.5])
    after = gone_on(before, rubbed(comm, Wear(0.05)))
    assert worn(after) == pytest.approx(worn(before), rel=1e-12)
    march(after.load_path(Position(load=1.5, stride=0.5)), [2.0, 3.0])
    before.solve([2.0, 3.0])
    assert worn(after) == pytest.approx(worn(before), rel=1e-9)


def test_a_law_knows_the_length_of_the_step_after_a_halt():
    """It counts from the load at which the path was left."""
    before = rubbed(MPI.COMM_SELF, Viscous())
    before.solve([1.0, 1.5])
    after = gone_on(before, rubbed(MPI.COMM_SELF, Viscous()))
    march(after.load_path(Position(load=1.5, stride=0.5)), [1.75])
    assert after.drive_force("slide") == pytest.approx(Viscous.eta * 0.02, rel=1e-2)


def gone_on(before: System, after: System) -> System:
    """``after`` in the state that ``before`` was halted in at the load 1.5."""
    at = before.equilibrium
    MeshOrder(after).spread_history(MeshOrder(before).collect_history())
    after.equilibrium.resume(1.5, at.state(), at.largest_reaction)
    return after


def worn(system: System) -> float:
    """The worn volume."""
    return system.contact.interface().quantities()["worn volume"][0]


@dataclass(frozen=True)
class Spring(Wear):
    """A stiff layer that keeps its largest pressure, and wears where it slips."""

    counts_slip = False
    stiffness = 3e3

    def respond(self, opening, trial, gamma, state, dt):
        touches = (opening[:, 0] < 0).astype(int)
        traction = np.zeros_like(trial)
        traction[:, 0] = -self.stiffness * opening[:, 0] * touches
        by_opening = np.zeros((len(trial), 2, 2))
        by_opening[:, 0, 0] = -self.stiffness * touches
        worn = state.depth + self.k * traction[:, 0] * np.abs(opening[:, 1])
        depth = worn if self.counts_slip else np.maximum(state.depth, traction[:, 0])
        by_trial = np.zeros_like(by_opening)
        return Response(traction, by_trial, by_opening, touches, WearState(depth))


class Wearing(Spring):
    counts_slip = True


@dataclass(frozen=True)
class Softened(Wear):
    """Pressure that sets in smoothly, over a width."""

    width: float = 5.0
    unilateral = False

    def respond(self, opening, trial, gamma, state, dt):
        scaled = trial[:, 0] / self.width
        traction = np.zeros_like(trial)
        traction[:, 0] = self.width * np.logaddexp(0.0, scaled)
        by_trial = np.zeros((len(trial), 2, 2))
        by_trial[:, 0, 0] = np.exp(-np.logaddexp(0.0, -scaled))
        depth = state.depth + self.k * traction[:, 0] * np.abs(opening[:, 1])
        return Response(traction, by_trial, None, np.full(len(trial), SLIDE), WearState(depth))


def punched(law, folder, strain="small", stress=1.0):
    """What is worn where a punch, pressed into a wider foot by 0.1, slides by 0.1 in two steps;
    moduli are 1e7 times the unit of ``stress``."""
    mesh = archord.rectangles({"foot": (-3, -2, 6, 2), "punch": (-1, 0, 2, 1)}, size=0.5)
    steel = archord.Elastic(1e7 * stress, 0.0)
    bodies = [archord.Body(name, steel) for name in ("foot", "punch")]
    contact = archord.Interaction("rub", ("punch bottom", "foot top"), law=law)
    press = archord.Load("press", on="punch top", direction="y", displacement=[-0.1, -0.1])
    slide = archord.Load("slide", on="punch top", direction="x", displacement=[0.0, 0.1])
    held = [archord.Support("foot bottom")]
    loads = [press, slide]
    problem = archord.Problem(mesh, bodies, [contact], held, loads, strain=strain, steps=[1, 2])
    return np.array(archord.solve(problem, folder).columns["rub worn volume"])


@pytest.mark.parametrize("strain", ["small", "large"])
@pytest.mark.parametrize("law", [Spring(1.0), Wearing(1e-4)])
def test_points_without_a_partner_have_no_history(law, strain, tmp_path):
    """The largest pressures make up the force, on the foot over all that the punch has met, and k
    times force times slip is worn off: what lies beside the punch faces nothing. It had as much
    again."""
    force = 3e3 * 0.1 * 2.0
    slid = np.array([0.0, 0.05, 0.1])
    expected = 1e-4 * force * slid if law.counts_slip else force * (1 + slid / 2 / 2)
    worn = punched(law, tmp_path / "run", strain)
    np.testing.assert_allclose(worn, expected, rtol=3e-3, atol=1e-7 * force)


def test_points_without_a_partner_are_open_in_any_unit(tmp_path):
    """A law whose pressure is never zero wears the same in MPa and in Pa."""
    mega = punched(Softened(1e-9), tmp_path / "MPa")
    whole = punched(Softened(1e-15, width=5e6), tmp_path / "Pa", stress=1e6)
    np.testing.assert_allclose(whole, mega, rtol=1e-7)

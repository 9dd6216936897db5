"""Loose bodies that come to rest with friction: an eye with a pressed-in bushing and two pins."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.benchmarks.stability.cases import cases
from archord.benchmarks.stability.eye import drawn_eye
from archord.output.history import read_history
from archord.presets.account import account_of
from archord.scene.file import AnyScene
from archord.solver.contact.laws.coulomb import Coulomb, FrictionState
from archord.solver.path.stepping import StepRules, march
from archord.solver.path.system import System
from tests.output.test_restart import go_on, run


def scene_of(friction: float, force: list[float], steps: list[int], edges: int = 20) -> AnyScene:
    """The eye of the stability benchmark with this friction everywhere, and this number of edges
    around each bore."""
    scene = cases()["eye, pulled and let go"].scene
    mesh = scene.mesh.model_copy(update={"file": str(drawn_eye(edges))})
    rubbing = [
        interaction.model_copy(update={"friction": friction}) for interaction in scene.interaction
    ]
    pull = scene.load[0].model_copy(update={"force": force})
    path = scene.path.model_copy(update={"steps": steps})
    return scene.model_copy(
        update={"mesh": mesh, "interaction": rubbing, "load": [pull], "path": path}
    )


def eye(
    friction: float,
    force: list[float],
    steps: list[int],
    comm: MPI.Comm = MPI.COMM_SELF,
    edges: int = 20,
) -> System:
    """The same, not yet solved."""
    return account_of(scene_of(friction, force, steps, edges), comm).system


def follow(system: System, targets: list[float]) -> dict[str, list]:
    """What was found at the ``targets``: iterations of the step, which must not be cut, the pin's
    displacement, and the reaction of the pin that is held."""
    found: dict[str, list] = {"iterations": [], "moved": [], "reaction": []}

    def done(step, position) -> None:
        found["iterations"].append(step.iterations)
        found["moved"].append(float(system.driven()[0][0]))
        found["reaction"].append(system.reaction("B"))
        assert system.force_balance() < 1e-8

    march(system.load_path(), targets, target_done=done, rules=StepRules(minimum=1.0))
    return found


@pytest.mark.mpi
def test_an_eye_is_pulled_and_let_go_without_a_cutback(comm):
    """The held pin carries the pull, but for the little that springs take, and nothing once it is
    let go."""
    found = follow(eye(0.15, [3000.0, 0.0], [2, 1], comm, edges=24), [1.0, 1.5, 2.0, 3.0])
    pull = np.array([0.0, 1500.0, 3000.0, 0.0])
    reactions = np.stack([-pull, np.zeros(4)], axis=1)
    np.testing.assert_allclose(found["reaction"], reactions, atol=0.03)
    assert sum(found["iterations"]) < 120


def test_friction_hardly_moves_where_the_pin_first_touches():
    """What brings a loose body to its first contact is no slip: nothing then keeps the pin from
    where it rests without friction, but what friction holds while it is pressed."""
    smooth, rough = (follow(eye(mu, [350.0], [1]), [1.0, 2.0])["moved"][-1] for mu in (0.0, 0.15))
    assert rough == pytest.approx(smooth, rel=0.02)


def test_a_run_goes_on_from_where_it_was_halted(tmp_path):
    """Slip counts from touch-down at points that did not touch before, which the accepted state
    tells once more."""
    scene = scene_of(0.15, [3000.0], [4])
    run(scene, tmp_path / "whole", copies={2: tmp_path / "halted"})
    go_on(scene, tmp_path / "halted")
    whole, halted = (read_history(tmp_path / name / "history.csv") for name in ("whole", "halted"))
    assert halted["iterations"] == whole["iterations"]
    for name in ("pull displacement", "friction_dissipation"):
        assert halted[name] == pytest.approx(whole[name], rel=1e-6)


def points(n: int = 200) -> tuple[np.ndarray, ...]:
    """Openings, trial tractions and gammas ``(n, 2)`` and states of points that touch, or do not,
    in a step of length 1."""
    draw = np.random.default_rng(1)
    state = FrictionState(draw.normal(0, 0.01, n), np.maximum(draw.normal(0, 1, n), 0), np.zeros(n))
    opening = np.stack([np.zeros(n), draw.normal(0, 0.01, n)], axis=1)
    return opening, draw.normal(0, 1, (n, 2)), np.full((n, 2), 100.0), state, 1.0


def test_secants_change_the_derivative_alone():
    """They leave every point that touches a stiffness along the surface."""
    law = Coulomb(0.3)
    given = law.respond(*points())
    other = law.by_secants().respond(*points())
    traction = given.traction
    state = given.state
    secant = other.by_trial
    also = other.state
    np.testing.assert_array_equal(other.traction, traction)
    np.testing.assert_array_equal(other.branch, given.branch)
    for name in ("elastic_slip", "pressure", "dissipated"):
        np.testing.assert_array_equal(getattr(also, name), getattr(state, name))
    touches = traction[:, 0] > 0
    slides = touches & (given.by_trial[:, 1, 1] == 0)
    assert slides.any()
    assert (secant[touches, 1, 1] > 0).all()
    assert (secant[slides, 1, 1] < 1).all()


def test_the_elastic_law_holds_what_touched():
    """Points that touched stick with whatever shear; others slide without friction and lose no
    work."""
    opening, trial, gamma, before, dt = points()
    response = Coulomb(0.3).elastic().respond(opening, trial, gamma, before, dt)
    traction = response.traction
    after = response.state
    touches = trial[:, 0] > 0
    touched = before.pressure > 0
    sticks = trial[:, 1] - gamma[:, 1] * before.elastic_slip
    np.testing.assert_allclose(traction[:, 1], np.where(touches & touched, sticks, 0.0))
    np.testing.assert_array_equal(traction[:, 0], np.maximum(trial[:, 0], 0))
    assert not after.dissipated.any()

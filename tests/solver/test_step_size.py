"""Step control by itself: lengths, growth, cuts, and targets hit exactly."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from archord.report.errors import InputError
from archord.scene.sections.analysis import Stepping
from archord.solver.path.load_path import LoadPath
from archord.solver.path.newton import Newton
from archord.solver.path.stepping import StepFailure, StepRules, march


class Spring:
    """Equilibrium and solver in one, which converges in ``cost(load, stride)`` iterations;
    infinite: it fails."""

    problem = SimpleNamespace(load_name="delta", by_force=False, from_rest=True)
    springs = None
    drives = SimpleNamespace(course=lambda load: np.array([load]))
    bulk = SimpleNamespace(plastic=True)

    def __init__(self, cost):
        self.cost = cost
        self.load = 0.0
        self.at = 0.0
        self.solved = []
        self.equilibrium = self

    def state(self):
        return np.array([self.at])

    def solve(self, load, guesses):
        next(iter(guesses))
        iterations = self.cost(load, load - self.load)
        self.solved.append(load)
        self.at = load
        failed = math.isinf(iterations)
        if not failed:
            self.load = load
        return Newton(
            not failed,
            "too hard" if failed else "converged",
            7 if failed else iterations,
            [1.0, 1e-12],
        )

    def restore(self, load, state):
        self.load = load
        self.at = state[0]

    def commit(self):
        pass


def follow(targets, cost=lambda load, stride: 3, spring=None, **rules):
    spring = spring or Spring(cost)
    done = []
    accepted = []
    march(
        LoadPath(spring, lambda load: np.zeros(1), None, None),
        targets,
        rules=StepRules(**rules),
        substep_done=accepted.append,
        target_done=lambda step, position: done.append(
            SimpleNamespace(step=step, at=position.load)
        ),
    )
    return spring, accepted, done


class Kinked(Spring):
    """An elastic joint for which no extrapolated guess is good enough."""

    bulk = SimpleNamespace(plastic=False)

    def __init__(self):
        super().__init__(lambda load, stride: 3)
        self.guesses = []

    def solve(self, load, guesses):
        failed = 0
        for guess, afar in guesses:
            self.guesses.append((load, guess[0], afar))
            if guess[0] == self.load:
                break
            failed += 5
        result = super().solve(load, [(guess, afar)])
        result.iterations += failed
        return result


def test_an_elastic_step_that_fails_starts_from_the_last_state_before_it_is_cut():
    """No cutback, and the iterations of both solves count."""
    spring, _, done = follow([1.0, 2.0, 3.0], spring=Kinked())
    assert [(d.step.cutbacks, d.step.substeps, d.step.iterations) for d in done] == [
        (0, 1, 3),
        (0, 1, 8),
        (0, 1, 8),
    ]
    assert spring.guesses == [
        (1.0, 0, True),
        (2.0, 2.0, False),
        (2.0, 1.0, True),
        (3.0, 3.0, False),
        (3.0, 2.0, True),
    ]


PATH = [0.1 * k for k in range(1, 8)] + [0.3, -0.2, 0.0, 0.0, 1 / 3]


@pytest.mark.parametrize(
    "rules", [{}, {"initial": 0.3}, {"initial": 0.07, "maximum": 0.4, "growth": 1.3}]
)
def test_every_target_is_hit_to_the_last_digit(rules):
    """Up, down, through zero and standing still, whatever the lengths of the steps between."""
    _, accepted, done = follow(PATH, **rules)
    assert [d.at for d in done] == PATH
    assert set(PATH) <= set(accepted)


def test_no_step_is_longer_than_allowed_nor_grows_faster():
    """With growth 1.3 from 0.1 to at most 0.4: lengths 0.1, 0.13, 0.169, ..."""
    _, accepted, _ = follow([1.0, 2.0], initial=0.1, maximum=0.4, growth=1.3)
    lengths = np.diff([0.0, *accepted])
    assert lengths[:4] == pytest.approx([0.1, 0.13, 0.169, 0.2197])
    assert lengths.max() <= 0.4 + 1e-12


def test_steps_that_were_hard_do_not_grow():
    """Newton iterations above the target keep the length."""
    _, accepted, _ = follow([1.0], lambda load, stride: 9, initial=0.25, target_iterations=8)
    assert accepted == pytest.approx([0.25, 0.5, 0.75, 1.0])


def test_a_failed_step_is_cut_and_the_length_recovers():
    """Steps beyond 0.3 fail on the way from 0.4 to 0.6: cut there, long again after."""
    _, accepted, done = follow(
        [1.0], lambda x, dx: math.inf if 0.4 < x < 0.7 and dx > 0.15 else 3, initial=0.5
    )
    assert done[0].step.cutbacks > 0
    assert accepted[-1] == 1.0
    assert np.diff([0.0, *accepted]).max() > 0.15


def test_a_step_that_was_just_cut_does_not_grow():
    """Its length has failed before; the step after it may be longer again."""
    spring, _, _ = follow([1.0], lambda load, stride: math.inf if stride > 0.3 else 3)
    assert spring.solved[:4] == pytest.approx([1.0, 0.5, 0.25, 0.5])


def test_the_smallest_step_is_tried_before_giving_up():
    """The last solve that fails is one of the minimum's length, and the state is that of the last
    load that held."""
    cost = lambda load, stride: math.inf if load > 0.55 else 3  # noqa: E731
    with pytest.raises(
        StepFailure, match=r"too hard.*cut to 0\.05 .*last load that held is delta = 0\.5"
    ) as failure:
        follow([1.0], cost, minimum=0.05)
    assert failure.value.attempt.cutbacks >= 4


@pytest.mark.parametrize(
    "rules",
    [
        {"initial": 0.0},
        {"initial": 0.5, "minimum": 0.6},
        {"initial": 0.5, "maximum": 0.4},
        {"cutback": 1.0},
        {"growth": 0.9},
        {"maximum": 2.0},
        {"target_iterations": 0},
        {"minimum": math.nan},
    ],
)
def test_rules_that_contradict_themselves_are_refused(rules):
    """Each alone."""
    with pytest.raises(InputError):
        Stepping(**rules)


def test_a_length_never_leaves_its_bounds():
    """Whatever the order of successes and failures."""
    rng = np.random.default_rng(0)
    bounds = {"minimum": 0.01, "maximum": 0.5}
    hard = lambda load, stride: math.inf if stride > 0.2 and rng.random() < 0.5 else 3  # noqa: E731
    _, accepted, _ = follow(
        [10.0, 20.0, 30.0], hard, initial=0.2, growth=1.7, cutback=0.3, **bounds
    )
    lengths = np.diff([0.0, *accepted]) / 10
    assert len(lengths) > 20
    assert lengths.max() <= bounds["maximum"] + 1e-9
    assert (
        min(length for load, length in zip(accepted, lengths, strict=True) if load % 10)
        >= bounds["minimum"] - 1e-9
    )

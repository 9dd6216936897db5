"""What is tried where Newton's method does not converge, before a step is cut."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from archord.geometry.basis import Array
from archord.materials.material import Points
from archord.solver.contact.interaction import GAMMA_FACTOR
from archord.solver.path.newton import CIRCLING, Newton, NewtonSolver
from archord.solver.stabilisation import RigidMotions

_STIFF_CONTACT = 5.0  # gamma factor above which it is raised in stages where a solve fails
_GAMMA_RATIO = 10.0  # and the largest ratio of one gamma to the next
_ROUGH = 1e-3  # residual over reaction at which a solution is good enough for a guess


class Recovery:
    """Solves by ``newton``, with all that is known to help. ``continues_gamma``: a large gamma is
    raised in stages."""

    def __init__(self, newton: NewtonSolver) -> None:
        self.newton, self.equilibrium = newton, newton.equilibrium
        self.continues_gamma = False
        self._rough = max(_ROUGH, newton.tolerance)

    def solve(self, load: float, guesses: Iterable[tuple[Array, bool]]) -> Newton:
        """Solve at ``load`` from one of the ``guesses`` after the other, each with whether it comes
        from afar; where springs may have to hold bodies, these come to rest there first as if
        rigid; so do bodies under forces of which no guess has found the contact, as it may be if
        forces are tiny. Collective."""
        self.equilibrium.load = load
        self._solves: list[Newton] = []
        springs = self.equilibrium.springs
        for guess, afar in guesses:
            if springs is not None and (afar or not springs.idle):
                guess, afar = self._at_rest(load, guess), True
            if self._solve_in_stages(guess, afar):
                return Newton.together(self._solves)
        at = self.equilibrium
        if springs is None and at.problem.by_force and not at.contact.n_active():
            rigid = RigidMotions(at.drives, at.contact)
            self._solve_in_stages(rigid.at_rest(load, guess), True)
        return Newton.together(self._solves)

    def _at_rest(self, load: float, guess: Array) -> Array:
        """The ``guess`` with loose bodies where they come to rest as if rigid. What brought them
        there was no slip."""
        at = self.equilibrium
        assert at.springs is not None
        with at.timer("contact"):
            guess = at.springs.rigid.at_rest(load, guess)
            if not at.springs.idle:
                n = 2 * at.n_local
                at.contact.touch_down(guess[:n].reshape(-1, 2), guess[n:])
        return guess

    def _solve_in_stages(self, guess: Array, afar: bool) -> bool:
        """Solve from ``guess``; where a large gamma makes that fail, on which the solution hardly
        depends, but with which points open and close for many iterations, gamma is raised in
        stages."""
        contact = self.equilibrium.contact
        wanted, stiff = contact.gamma_factor, contact.gamma_factor > _STIFF_CONTACT
        converged = not (stiff and self.continues_gamma) and self._solve_at_once(guess, afar)
        if converged or not stiff:
            return converged
        stages = math.ceil(math.log(wanted / GAMMA_FACTOR, _GAMMA_RATIO))
        for factor in np.geomspace(GAMMA_FACTOR, wanted, stages + 1):
            contact.use_gamma_factor(float(factor))
            converged = self._solve_at_once(guess, afar)
            guess, afar = self.equilibrium.state(), False
            if not converged:
                break
        contact.use_gamma_factor(wanted)
        self.continues_gamma |= converged
        return converged

    def _solve_at_once(self, guess: Array, afar: bool) -> bool:
        """Solve from ``guess``; one from ``afar`` is too stiff for a line search, which creeps
        there, and may yield far too much: points come first that cannot yield (further). Elastic
        bodies at large strain are too stiff for it everywhere."""
        yielding = self.equilibrium.plastic_points()
        rubbing = [pair.points for pair in self.equilibrium.contact.pairs if pair.law.has_friction]
        yields = self.equilibrium.comm.allreduce(len(yielding)) > 0
        full_steps = (afar or self.equilibrium.bulk.finite) and not yields
        near = self._simplified(guess, yielding, "elastic") if yields and afar else guess
        if self._solve_either_way(near, full_steps=full_steps):
            return True
        # from the guess itself: where friction has failed already, bodies may have come apart
        return bool(rubbing) and self._solve_friction_in_stages(
            guess, rubbing, yielding if afar else []
        )

    def _solve_friction_in_stages(
        self, guess: Array, rubbing: list[Points], yielding: list[Points]
    ) -> bool:
        """Solve from ``guess`` where friction makes Newton's method fail.

        First no point slides or yields (any further), and secants find what slides then. Where that
        fails because points have to slide, all of them slide first, without friction.
        """
        with _acting(rubbing, "elastic"), _acting(yielding, "elastic"):
            holds = self._solve_holding(guess, False, self._rough)
        if holds:
            guess = self.equilibrium.state()
        else:
            guess = self._simplified(guess, rubbing, "frictionless", yielding)
            if self._solve_either_way(guess):
                return True
        with _acting(rubbing, "by_secants"):
            if self._solve_holding(guess, True, 0.0):
                return True
        return holds and self._solve_either_way(guess)

    def _simplified(
        self, guess: Array, points: list[Points], answer: str, yielding: Sequence[Points] = ()
    ) -> Array:
        """A rough equilibrium by full steps where ``points`` have this ``answer`` and those
        ``yielding`` are elastic; the ``guess`` without one."""
        with _acting(points, answer), _acting(yielding, "elastic"):
            found = self._solve_either_way(guess, full_steps=True, goal=self._rough)
        return self.equilibrium.state() if found else guess

    def _solve_either_way(
        self, guess: Array, *, full_steps: bool = False, goal: float = 0.0
    ) -> bool:
        """With a line search, then without, or the other way round with ``full_steps``, which find
        the right piece of a problem that is nearly linear by pieces where the line search creeps:
        first touch, large gamma."""
        for line_search in (not full_steps, full_steps):
            if self._solve_holding(guess, line_search, goal):
                return True
            if (border := self.equilibrium.border) and border.singular is not None:
                break
        return False

    def _solve_holding(self, guess: Array, line_search: bool, goal: float) -> bool:
        """Solve from ``guess``; where that circles though no point opens or closes, points jump
        between two facets that meet at an angle: they are held on theirs then, each facet continued
        beyond its ends."""
        result, contact = (
            self.newton.solve(guess, line_search=line_search, goal=goal),
            self.equilibrium.contact,
        )
        self._solves.append(result)
        changes = result.active_set_changes
        circles = len(changes) > CIRCLING and not any(changes[-CIRCLING:])
        if result.converged or not circles or not any(pair.moves for pair in contact.pairs):
            return result.converged
        for pair in contact.pairs:
            pair.start = "held"
        result = self.newton.solve(None, line_search=line_search, goal=goal)
        result.held = True
        self._solves.append(result)
        return result.converged


@contextmanager
def _acting(points: Sequence[Points], answer: str) -> Iterator[None]:
    """Let these ``points`` answer as their material says by the method ``answer``, for the time
    being."""
    for p in points:
        p.acting = getattr(p.material, answer)()
    try:
        yield
    finally:
        for p in points:
            p.acting = p.material

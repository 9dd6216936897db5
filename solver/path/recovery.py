"""What is tried where Newton's method does not converge, before a step is cut."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from archord.geometry.basis import Array
from archord.materials.material import Points
from archord.solver.contact.interaction import GAMMA_FACTOR
from archord.solver.equilibrium.rigid_motions import RigidMotions
from archord.solver.path.newton import CIRCLING, Newton, NewtonSolver

_STIFF_CONTACT = 5.0  # gamma factor above which it is raised in stages where a solve fails
_GAMMA_RATIO = 10.0  # and the largest ratio of one gamma to the next
# times as stiff are springs where forces let go: what nothing pushes leaps where they are weaker
_HOLDING = 16.0
_ROUGH = 1e-3  # residual over reaction at which a solution is good enough for a guess


class Recovery:
    """Solves by ``newton``, with all that is known to help. ``continues_gamma``: a large gamma is
    raised in stages."""

    def __init__(self, newton: NewtonSolver) -> None:
        self.newton = newton
        self.equilibrium = newton.equilibrium
        self.continues_gamma = False
        self._rough = max(_ROUGH, newton.tolerance)
        self._solves: list[Newton] = []

    def solve(self, load: float, guesses: Iterable[tuple[Array, bool]]) -> Newton:
        """Solve at ``load`` from one of the ``guesses`` after the other, each with whether it comes
        from afar.

        Where springs may have to hold bodies, these come to rest first as if rigid. So do bodies
        under forces where no guess has led to equilibrium, as it may be if forces are tiny.
        Collective.
        """
        at = self.equilibrium
        at.load = load
        if at.springs is not None:
            at.springs.hold(_HOLDING if at.lets_go else 1.0)
        self._solves = []
        for guess, afar in guesses:
            if at.springs is not None and (afar or not at.springs.idle):
                guess = self._at_rest(load, guess)
                afar = True
            if self._solve_in_stages(guess, afar):
                return Newton.together(self._solves)
        touches_in_vain = self._is_singular() and at.contact.n_active() > 0
        if at.springs is None and at.problem.by_force and not touches_in_vain:
            rigid = RigidMotions(at.drives, at.contact)
            before = self._solves
            self._solves = []
            rested, _ = rigid.at_rest(load, guess)
            found = self._solve_in_stages(rested, afar=True)
            # the last one tells why there is none
            self._solves = before + self._solves if found else self._solves + before
        return Newton.together(self._solves)

    def _at_rest(self, load: float, guess: Array) -> Array:
        """The ``guess`` with loose bodies where they come to rest as if rigid. What brought them
        there was no slip, and where contact stops them springs do not pull them back."""
        at = self.equilibrium
        assert at.springs is not None
        with at.timer("contact"):
            guess, is_stopped = at.springs.rigid.at_rest(load, guess)
            if is_stopped:
                at.springs.rest_at(guess)
            if not at.springs.idle:
                at.contact.touch_down(*at.unknowns.split(guess))
        return guess

    def _solve_in_stages(self, guess: Array, afar: bool) -> bool:
        """Solve from ``guess``; where that fails with a large gamma, raise gamma in stages: the
        solution hardly depends on it, but points open and close for many iterations."""
        contact = self.equilibrium.contact
        wanted = contact.gamma_factor
        is_stiff = wanted > _STIFF_CONTACT
        if not (is_stiff and self.continues_gamma) and self._solve_at_once(guess, afar):
            return True
        if not is_stiff:
            return False
        stages = math.ceil(math.log(wanted / GAMMA_FACTOR, _GAMMA_RATIO))
        for factor in np.geomspace(GAMMA_FACTOR, wanted, stages + 1):
            contact.use_gamma_factor(float(factor))
            converged = self._solve_at_once(guess, afar)
            if not converged:
                break
            guess = self.equilibrium.state()
            afar = False
        contact.use_gamma_factor(wanted)
        self.continues_gamma |= converged
        return converged

    def _solve_at_once(self, guess: Array, afar: bool) -> bool:
        """Solve from ``guess``.

        A problem is too stiff for a line search, which creeps there, from ``afar``, and everywhere
        if elastic bodies are at large strain. Bodies may yield far too much from afar: the first
        solve lets no point yield.
        """
        at = self.equilibrium
        yielding = at.evaluation.plastic_points()
        rubbing = [pair.points for pair in at.contact.pairs if pair.law.has_friction]
        yields = at.comm.allreduce(len(yielding)) > 0
        full_steps = (afar or at.bulk.finite) and not yields
        near = guess
        if yields and afar:
            near = self._simplified(guess, yielding, "elastic")
        if self._solve_either_way(near, full_steps=full_steps):
            return True
        if not rubbing:
            return False
        # from the guess itself: where friction has failed already, bodies may have come apart
        return self._solve_friction_in_stages(guess, rubbing, yielding if afar else [])

    def _solve_friction_in_stages(
        self, guess: Array, rubbing: list[Points], yielding: list[Points]
    ) -> bool:
        """Solve from ``guess`` where friction makes Newton's method fail.

        First no point slides or yields (any further), and secants find what slides then. Where that
        fails because points have to slide, all of them slide first, without friction.
        """
        with _acting(rubbing, "elastic"), _acting(yielding, "elastic"):
            holds = self._solve_holding(guess, line_search=False, goal=self._rough)
        if holds:
            guess = self.equilibrium.state()
        else:
            guess = self._simplified(guess, rubbing, "frictionless", yielding)
            if self._solve_either_way(guess):
                return True
        with _acting(rubbing, "by_secants"):
            if self._solve_holding(guess, line_search=True):
                return True
        near = self.equilibrium.state()
        return self._solve_holding(near, line_search=True) or (
            holds and self._solve_either_way(guess)
        )

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
        """With a line search, then without; the other way round with ``full_steps``.

        Full steps find the right piece of a problem that is nearly linear by pieces, where the line
        search creeps: first touch, large gamma.
        """
        for line_search in (not full_steps, full_steps):
            if self._solve_holding(guess, line_search=line_search, goal=goal):
                return True
            if self._is_singular():
                return False
        return False

    def _is_singular(self) -> bool:
        """Whether nothing resisted a drive in the last solve."""
        border = self.equilibrium.linear.border
        return border is not None and border.singular is not None

    def _solve_holding(self, guess: Array, *, line_search: bool, goal: float = 0.0) -> bool:
        """Solve from ``guess``; where that circles, hold points on their facets.

        Where the residual circles though hardly any point opens or closes, points jump between two
        facets that meet at an angle, or lose the end of a surface and find it again. Each facet is
        continued beyond its ends then, and points without a partner get none.
        """
        result = self._solve_carried(guess, line_search=line_search, goal=goal)
        pairs = self.equilibrium.contact.pairs
        can_jump = any(pair.moves for pair in pairs)
        if result.converged or result.floating or not can_jump or not self._circles(result):
            return result.converged
        for pair in pairs:
            pair.start = "held"
        result = self._solve_carried(None, line_search=line_search, goal=goal)
        result.held = True
        return result.converged

    def _circles(self, result: Newton) -> bool:
        """Whether the active set stood still in the last iterations, but for a few points, or for
        as many as have just passed the end of a surface."""
        at = self.equilibrium
        n_passing = at.comm.allreduce(sum(pair.n_passing for pair in at.contact.pairs))
        few = max(self.newton.few, n_passing)
        changes = result.active_set_changes
        return len(changes) > CIRCLING and max(changes[-CIRCLING:]) <= few

    def _solve_carried(self, guess: Array | None, *, line_search: bool, goal: float) -> Newton:
        """Solve from ``guess``. What is found does not count if springs carry what pushes a body:
        they would let it go far away."""
        result = self.newton.solve(guess, line_search=line_search, goal=goal)
        self._solves.append(result)
        springs = self.equilibrium.springs
        if result.converged and springs is not None:
            result.floating = springs.held(self.equilibrium.load)
            result.converged = not result.floating
        return result


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

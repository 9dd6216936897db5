"""What is tried where Newton's method does not converge, before a step is cut.

With a line search and without, points held on their facets, elastic points first, continuation in gamma.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from archord.geometry.basis import Array
from archord.solver.contact.interaction import GAMMA_FACTOR
from archord.solver.newton import CIRCLING, Newton, NewtonSolver

_STIFF_CONTACT = 5.0  # gamma factor above which it is raised in stages where a solve fails
_GAMMA_RATIO = 10.0  # and the largest ratio of one gamma to the next
_ROUGH = 1e-3  # residual over reaction at which a solution is good enough for a guess


class Recovery:
    """Solves by ``newton``, with all that is known to help. ``continues_gamma``: a large gamma is raised in stages."""

    def __init__(self, newton: NewtonSolver) -> None:
        self.newton, self.equilibrium = newton, newton.equilibrium
        self.continues_gamma = False

    @property
    def elastic(self) -> bool:
        """Whether no body can yield, so that nothing but the contact is nonlinear."""
        return not self.equilibrium.bulk.plastic

    def solve(self, load: float, guess: Array, *, afar: bool = False) -> Newton:
        """Solve at ``load`` from ``guess``, which may come from ``afar`` (see `_solve_at_once`).

        Where a large gamma makes that fail, gamma is raised in stages: the solution hardly depends on it, but points
        open and close for many iterations where it is large.
        """
        self.equilibrium.load = load
        contact, result = self.equilibrium.contact, None
        wanted = contact.gamma_factor
        if wanted <= _STIFF_CONTACT:
            return self._solve_at_once(guess, afar)
        if not self.continues_gamma:
            result = self._solve_at_once(guess, afar)
            if result.converged:
                return result
        stages = math.ceil(math.log(wanted / GAMMA_FACTOR, _GAMMA_RATIO))
        for factor in np.geomspace(GAMMA_FACTOR, wanted, stages + 1):
            contact.use_gamma_factor(float(factor))
            result = self._solve_at_once(guess, afar).after(result)
            guess, afar = self.equilibrium.state(), False
            if not result.converged:
                break
        contact.use_gamma_factor(wanted)
        assert result is not None
        self.continues_gamma |= result.converged
        return result

    def _solve_at_once(self, guess: Array, afar: bool) -> Newton:
        """Solve from ``guess``.

        A guess from ``afar`` is too stiff for a line search, which creeps there, and may yield far too much: full steps
        come first, and a rough equilibrium of points that cannot yield (further) comes before the one asked for; if
        that fails, the solve starts from the guess.
        """
        points = self.equilibrium.plastic_points()
        if not self.equilibrium.comm.allreduce(len(points)):
            return self._solve_either_way(guess, full_steps=afar)
        before = None
        if afar:
            for p in points:
                p.elastic_only = True
            before = self._solve_either_way(guess, full_steps=True, goal=max(_ROUGH, self.newton.tolerance))
            for p in points:
                p.elastic_only = False
            if before.converged:
                guess = self.equilibrium.state()
        return self._solve_either_way(guess).after(before)

    def _solve_either_way(self, guess: Array, *, full_steps: bool = False, goal: float = 0.0) -> Newton:
        """With a line search, then without, or the other way round with ``full_steps``.

        The problem is nearly linear by pieces, where it is smooth, and full steps find the right ones where the line
        search, which wants a smaller residual in every step, creeps: first touch, large gamma, nearly incompressible
        bodies.
        """
        result = None
        for kind in ("basic", "bt") if full_steps else ("bt", "basic"):
            result = self._solve_holding(guess, kind, goal).after(result)
            if result.converged or self.equilibrium.control.singular:
                break
        assert result is not None
        return result

    def _solve_holding(self, guess: Array, line_search: str, goal: float) -> Newton:
        """Solve from ``guess``; where that circles though no point opens or closes, points jump between two facets that
        meet at an angle: they are held on theirs then, each facet continued beyond its ends."""
        result, contact = self.newton.solve(guess, line_search=line_search, goal=goal), self.equilibrium.contact
        changes = result.active_set_changes
        circles = len(changes) > CIRCLING and not any(changes[-CIRCLING:])
        if result.converged or not contact.pairs_move or not circles:
            return result
        iterate = self.newton.last_iterate()
        contact.hold()
        held = self.newton.solve(iterate, line_search=line_search, goal=goal, search=False)
        return replace(held.after(result), held=True)

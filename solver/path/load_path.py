"""A path of loads and the equilibria on it: the state reached last, and the guesses for the next
step."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from archord.geometry.basis import Array
from archord.solver.path.newton import Newton
from archord.solver.path.recovery import Recovery

_STRAIGHT = 1e-6  # part of a step that may lie beside the line of the last one
# residual of an extrapolated guess over that of a coarse start, below which it serves as well
_AS_GOOD = 2.0
_PREDICTOR_LIMIT = 4.0  # an increment is not extrapolated to more than this many times its length


@dataclass
class Position:
    """The place on a path between two steps: what is needed besides the state of the equilibrium to
    go on from it.

    ``targets_done`` output targets were reached, the last step being of length ``stride`` in the
    load; ``increment`` is what it changed in the state, None before the first step. ``size`` is the
    length of the next, in output steps.
    """

    targets_done: int = 0
    load: float = 0.0
    stride: float = 0.0
    increment: Array | None = None
    size: float | None = None


class Companion(Protocol):
    """What goes ahead of a load path and finds guesses for it: the same problem on a coarser mesh.

    ``iterations`` are those of its last step, on all coarser meshes.
    """

    iterations: int

    def increment(self, load: float) -> Array | None:
        """What a step to ``load`` adds to the state; None where none is found."""

    def follow(self) -> bool:
        """Accept the step that the path has accepted; returns whether it can."""

    def take_back(self) -> None:
        """Undo the last step."""


class LoadPath:
    """The path that ``solver``'s equilibrium follows from the position ``at``, from the beginning
    if absent.

    The guess for a step extrapolates the last increment; where that fails elastic bodies start from
    the last state itself. Where the path starts or turns, or another drive takes over, the guess
    comes from the elastic solution, at the start from ``first_guess(load)``. The increment from a
    state without equilibrium (a press fit), or of loose bodies, says nothing about the next. Where
    there is a ``coarse`` start, what a coarser mesh found comes first, unless bodies yield and
    extrapolation leaves a residual of the same size or less.
    """

    def __init__(
        self,
        solver: Recovery,
        first_guess: Callable[[float], Array],
        at: Position | None,
        coarse: Companion | None,
    ) -> None:
        self.solver, self._first_guess, self.at, self.coarse = (
            solver,
            first_guess,
            at or Position(),
            coarse,
        )
        self.state = solver.equilibrium.state()
        self.coarse_iterations = 0  # of the last attempt

    def attempt(self, load: float) -> Newton:
        """Solve for equilibrium at ``load``, from one guess after the other. Collective."""
        return self.solver.solve(load, self._guesses(load))

    def _guesses(self, load: float) -> Iterator[tuple[Array, bool]]:
        """Guesses for a step to ``load``, and whether to find the elastic solution from there
        first."""
        self.coarse_iterations = 0
        ahead = None
        if self.coarse is not None:
            ahead = self.coarse.increment(load)
            self.coarse_iterations = self.coarse.iterations
        guesses = list(self._own_guesses(load))
        if ahead is not None:
            of_coarse, own = self.state + ahead, guesses[0]
            off, plastic = self.solver.newton.residual_norm, self.solver.equilibrium.bulk.plastic
            later = plastic and not own[1] and off(own[0]) < _AS_GOOD * off(of_coarse)
            guesses.insert(1 if later else 0, (of_coarse, False))
        yield from guesses

    def _own_guesses(self, load: float) -> Iterator[tuple[Array, bool]]:
        """Those without a coarse start."""
        if self.at.increment is None:
            yield self._first_guess(load), True
            return
        ratio = self._ratio(load)
        if ratio is None:
            yield self.state, True
            return
        near = abs(ratio) <= _PREDICTOR_LIMIT
        # where the path turns, it first goes back elastically
        afar = ratio < 0
        yield self.state + self.at.increment * ratio if near else self.state, afar
        if near and not afar and not self.solver.equilibrium.bulk.plastic:
            # an extrapolated state has a kink where the contact ended, which fine meshes resolve
            yield self.state, True

    def _ratio(self, load: float) -> float | None:
        """How far the step to ``load`` goes on the line of the last one, over that one's length;
        None if off it."""
        at, course = self.at, self.solver.equilibrium.drives.course
        before, last, now = course(at.load - at.stride), course(at.load), course(load)
        step, length = last - before, float(np.linalg.norm(last - before))
        ratio = float(step @ (now - last)) / length**2 if length else 0.0
        return (
            ratio
            if np.linalg.norm(now - last - ratio * step) <= _STRAIGHT * np.linalg.norm(now - last)
            else None
        )

    def accept(self, load: float) -> None:
        """Go to ``load``, where the last attempt has found equilibrium, and keep its history."""
        at, new = self.at, self.solver.equilibrium.state()
        if load != at.load:
            problem, springs = self.solver.equilibrium.problem, self.solver.equilibrium.springs
            placed = springs is not None and not springs.idle
            known = (problem.from_rest or at.increment is not None) and not placed
            at.increment = new - self.state if known else np.zeros_like(new)
            at.stride = 0.0 if placed else load - at.load
        at.load, self.state = load, new
        self.solver.equilibrium.commit()
        if self.coarse is not None and not self.coarse.follow():
            self.coarse = None

    def take_back(self) -> None:
        """Undo the last attempt."""
        self.solver.equilibrium.restore(self.at.load, self.state)
        if self.coarse is not None:
            self.coarse.take_back()

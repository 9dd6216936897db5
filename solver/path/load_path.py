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
# residual of an extrapolated guess over a coarse start's, below which it serves as well
_AS_GOOD = 2.0
_PREDICTOR_LIMIT = 4.0  # an increment is not extrapolated to more than this many times its length


@dataclass
class Position:
    """The place on a path between two steps: what is needed besides the state of the equilibrium to
    go on from it.

    ``targets_done`` output targets were reached, the last step being of length ``stride`` in the
    load; ``increment`` is what it changed in the state, None before the first step. ``size`` is the
    length of the next, in output steps. A path ``unloads`` from where it turns to where it turns
    again.
    """

    targets_done: int = 0
    load: float = 0.0
    stride: float = 0.0
    increment: Array | None = None
    size: float | None = None
    unloads: bool = False


class Companion(Protocol):
    """What goes ahead of a load path and finds guesses for it: the same problem on a coarser mesh.

    ``iterations`` are the iterations of its last step, on all coarser meshes.
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
        self.solver = solver
        self.equilibrium = solver.equilibrium
        self.at = at or Position()
        self.coarse = coarse
        self.state = self.equilibrium.state()
        self.coarse_iterations = 0  # of the last attempt
        self._first_guess = first_guess

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
            of_coarse = self.state + ahead
            place = 1 if self._is_as_good(*guesses[0], of_coarse) else 0
            guesses.insert(place, (of_coarse, False))
        yield from guesses

    def _is_as_good(self, own: Array, afar: bool, of_coarse: Array) -> bool:
        """Whether the ``own`` guess of bodies that yield serves as well as the coarse start's."""
        if afar or not self.equilibrium.bulk.plastic:
            return False
        residual = self.solver.newton.residual_norm
        return residual(own) < _AS_GOOD * residual(of_coarse)

    def _own_guesses(self, load: float) -> Iterator[tuple[Array, bool]]:
        """Guesses without a coarse start."""
        if self.at.increment is None:
            yield self._first_guess(load), True
            return
        ratio = self._ratio(load)
        if ratio is None:
            yield self.state, True
            return
        # bodies that can yield unload elastically, or nearly so
        goes_back = ratio < 0 or (self.at.unloads and self.equilibrium.bulk.plastic)
        if abs(ratio) > _PREDICTOR_LIMIT:
            yield self.state, goes_back
            return
        yield self.state + self.at.increment * ratio, goes_back
        if not goes_back and not self.equilibrium.bulk.plastic:
            # an extrapolated state has a kink where the contact ended, which fine meshes resolve
            yield self.state, True

    def _ratio(self, load: float) -> float | None:
        """How far the step to ``load`` goes on the line of the last one, over the last one's
        length; None if off it."""
        at = self.at
        course = self.equilibrium.drives.course
        last = course(at.load)
        before = last - course(at.load - at.stride)
        step = course(load) - last
        length = float(np.linalg.norm(before))
        ratio = float(before @ step) / length**2 if length else 0.0
        aside = np.linalg.norm(step - ratio * before)
        return ratio if aside <= _STRAIGHT * np.linalg.norm(step) else None

    def accept(self, load: float) -> None:
        """Go to ``load``, where the last attempt has found equilibrium, and keep its history."""
        at = self.at
        new = self.equilibrium.state()
        if load != at.load:
            ratio = self._ratio(load)
            turned = ratio is not None and ratio < 0
            at.unloads ^= turned
            springs = self.equilibrium.springs
            is_placed = springs is not None and not springs.idle
            began_in_balance = self.equilibrium.problem.from_rest or at.increment is not None
            if began_in_balance and not is_placed:
                at.increment = new - self.state
            else:
                at.increment = np.zeros_like(new)
            at.stride = 0.0 if is_placed else load - at.load
        at.load = load
        self.state = new
        self.equilibrium.commit()
        if self.coarse is not None and not self.coarse.follow():
            self.coarse = None

    def unheld(self, load: float, *, tied: bool = False) -> str:
        """The body that nothing can hold at the ``load``, not even if all contacts are ``tied``; ""
        without one."""
        springs = self.equilibrium.springs
        return springs.rigid.unheld(load, tied=tied) if springs else ""

    def take_back(self) -> None:
        """Undo the last attempt."""
        self.equilibrium.restore(self.at.load, self.state)
        if self.coarse is not None:
            self.coarse.take_back()

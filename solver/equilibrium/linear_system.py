"""The linear system of a Newton step, and the strategies that solve it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.report.timer import BEFORE_SOLVING, Timer
from archord.solver.equilibrium.evaluation import Evaluation
from archord.solver.equilibrium.tangent import TangentMatrix
from archord.solver.linear.bordered import Border, Bordered
from archord.solver.linear.choose import choose
from archord.solver.linear.multigrid import Multigrid, takes_a_sum
from archord.solver.linear.strategy import Facts, Strategy


class LinearSystem:
    """The tangent of the last ``evaluation`` and what solves with it. Collective.

    ``choice`` names the strategies that the ``facts`` allow; while no point has yielded, a system
    that would be condensed if bodies were elastic is condensed. ``tangent`` is the matrix of all
    displacements; the unknown levels are in the ``border``, None without any. ``strategy`` solves
    for all unknowns.
    """

    def __init__(self, evaluation: Evaluation, timer: Timer) -> None:
        self.evaluation = evaluation
        self.unknowns = evaluation.unknowns
        self.contact = evaluation.contact
        self.timer = timer
        self.facts = self._facts()
        self.choice = choose(self.facts)
        while_elastic = choose(replace(self.facts, yields=False))
        if while_elastic.uses("condensed"):
            self.choice = while_elastic
        self.tangent = self._tangent()
        self._multigrid: Multigrid | None = None  # the last one that was made
        self.border: Bordered | None = None
        with timer(BEFORE_SOLVING):
            if self.unknowns.n_levels:
                stiffness = self.unknowns.drives.stiffness
                n = self.unknowns.n_levels
                product = self.tangent.product  # of matrices that the solver knows
                self.border = Bordered(product, n, stiffness, self._solver)
            self.strategy = self._strategy()

    def _facts(self) -> Facts:
        """What the choice of strategies depends on."""
        bulk = self.evaluation.bulk
        drives = self.unknowns.drives
        laws = [pair.law for pair in self.contact.pairs]
        opens = bool(laws) and all(law.unilateral for law in laws)
        return Facts(
            comm=self.unknowns.comm,
            dofs=self.unknowns.dimension * self.unknowns.V.dofmap.index_map.size_global,
            dimension=self.unknowns.dimension,
            yields=bulk.plastic,
            friction=self.contact.has_friction,
            finite=bulk.finite,
            by_force=self.unknowns.n_levels > 0,
            gamma_factor=self.contact.gamma_factor if opens else None,
            held=lambda: all(map(drives.held, self.evaluation.problem.bodies)),
        )

    def _tangent(self) -> TangentMatrix:
        condense = self._revise_condensed if self.choice.uses("condensed") else None
        takes_sums = self.choice.uses("multigrid") and takes_a_sum(self.unknowns.V)
        return TangentMatrix(self.evaluation, self.timer, condense, beside=takes_sums)

    def _strategy(self) -> Strategy:
        if self.border:
            return self.border
        return self.tangent.condensed or self._solver()

    def _solver(self) -> Strategy:
        """The strategy for the matrix of the displacements."""
        terms = self.tangent.terms()
        strategy = self.choice.factoriser(self.unknowns.V, self.unknowns.fixed, terms)
        strategy.product = self.tangent.product
        if isinstance(strategy, Multigrid):
            self._multigrid = strategy
        return strategy

    def update(self, *, factorise: bool = True) -> None:
        """Assemble the tangent of the last evaluation, to be factorised or not."""
        self.tangent.update(factorise=factorise)
        if self.border:
            with self.timer("assemble border"):
                self.border.update(*self.tangent.border(), factorise=factorise)

    def follow(self) -> bool:
        """Replace the matrix where the pairs of the last evaluation slid out of its pattern, or
        where the first point yields; returns whether."""
        awaits_yield = self.facts.yields and self.choice.uses("condensed")
        if awaits_yield and self.evaluation.has_yielded():
            self._solve_as_yielding()
            return True
        if not self.evaluation.pattern_grew:
            return False
        self.tangent.renew()
        if self.tangent.of_contact is not None and self._multigrid is not None:
            self._multigrid.renew(self.tangent.terms())
            return True
        self.renew_factorisation()
        self.strategy = self._strategy()
        return True

    def _solve_as_yielding(self) -> None:
        """Replace the condensed system by the system of bodies that yield."""
        factorisations = self.tangent.factorisations
        self.choice = choose(self.facts)
        self.tangent = self._tangent()
        self.tangent.factorisations = factorisations
        self.strategy = self._strategy()

    def renew_factorisation(self) -> None:
        """Take note that the tangent is another matrix, or has to be factorised once more."""
        if self.border:
            self.border.replace(self.tangent.product)

    def revise(self, increment: Array) -> tuple[PETSc.Mat, Array] | None:
        """Let contact points go over to the branches to which an ``increment`` of this rank's
        unknowns brings them.

        Returns a matrix for these branches, valid until the next call, and what they add to the
        residual; None if no point changes.
        """
        with self.timer("contact"):
            change = self._go_over(*self.unknowns.change(increment))
        if change is None:
            return None
        matrix, of_contact = self.tangent.revised()
        if self.border:
            matrix = Border(matrix, *self.tangent.border(of_contact)).matrix()
        return matrix, change

    def _revise_condensed(self, increment: Array) -> Array | None:
        """The same for an increment of the nodes ``near`` the contact alone; updates the condensed
        matrix, and returns what is added to the residual at the nodes of the contact."""
        condensed = self.tangent.condensed
        assert condensed is not None
        with self.timer("contact"):
            u = np.zeros((self.unknowns.n_local, self.unknowns.dimension))
            here = self.unknowns.V.dofmap.index_map.global_to_local(condensed.near)
            u[here[here >= 0]] = increment[here >= 0]
            change = self._go_over(u, np.zeros_like(self.unknowns.levels))
        if change is None:
            return None
        self.update()
        return condensed.at_nodes(change.reshape(-1, self.unknowns.dimension))

    def _go_over(self, u: Array, levels: Array) -> Array | None:
        """Let contact points go over as increments ``u`` and ``levels`` say; what this adds to the
        residual."""
        before = self.evaluation.contact_residual()
        if not self.contact.anticipate(u, levels):
            return None
        return self.evaluation.contact_residual() - before

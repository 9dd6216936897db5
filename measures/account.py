"""The account of a problem: what is told of every step, and what its user is warned of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from archord.materials.material import Array
from archord.measures.doubts import Check
from archord.measures.energies import energy_balance, work_doubts
from archord.measures.measure import Accepted, Column, Measure
from archord.measures.record import Record
from archord.report.by_name import ByName, Names
from archord.solver.path.stepping import StepFailure

if TYPE_CHECKING:
    from archord.scene.file import AnyScene
    from archord.solver.path.stepping import Step
    from archord.solver.path.system import System

Values = Mapping[str, float]
Driven = tuple[Array, Array]  # displacements and forces (d,) that do the loads' work


@dataclass
class Account:
    """What a run tells of a ``system``, and what its user is warned of; made by
    `presets.account.account_of`.

    Parameters
    ----------
    scene : Scene or ProblemScene
        The problem in words.
    system : System
        The problem, ready to be solved.
    measures : list of Measure
        What is told of every step.
    columns : list of Column
        The headings of history.csv, in order, and their values of a record.
    driven : callable
        Displacements and forces ``(d,)`` of the loads, whose work is summed. Collective.
    profiles : callable
        The contact along the surfaces at the last evaluation, by name. Collective.
    fixed, per_step : tuple of str
        The arrays of a profile in contact.h5: those that stay, and those that change.
    balance : callable
        How far forces are from balance, of a state and the values of its measures. Collective.
    facts : callable
        What run.json says of the mesh and the model.
    warnings : list of str
        What to warn of before the first step.
    checks : list of Check
        What to warn of after a step.
    refusal : callable
        Why a run must not go on after its last record, "" where it may. Collective.
    ending : callable
        Why a run that came to its end does not count as done, "" where it does; and warnings.
    fit : int
        The first steps, in which bodies are pressed into each other.
    at : str
        The measure that is the load of the files of fields and contact; "" for the load factor.
    copies : float
        How many times lengths in contact make up the whole.
    """

    scene: AnyScene
    system: System
    measures: list[Measure]
    columns: list[Column]
    driven: Callable[[], Driven]
    profiles: Callable[[], Mapping[str, Any]]
    fixed: Names
    per_step: Names
    balance: Callable[[Accepted, Values], float]
    facts: Callable[[], ByName]
    warnings: list[str]
    checks: list[Check]
    refusal: Callable[[Sequence[Record]], str]
    ending: Callable[[Sequence[Record]], tuple[str, list[str]]]
    fit: int = 0
    at: str = ""
    copies: float = 1.0

    def step(
        self,
        before: Sequence[Record],
        step: Step,
        profiles: Mapping[str, Any],
        work: float,
        seconds: float,
    ) -> Record:
        """The record of the last accepted state, which follows the steps ``before``. Collective;
        raises `StepFailure` where a law has other quantities than its columns."""
        system = self.system
        for interface in system.contact.interfaces:
            if fault := interface.fault_of_quantities():
                raise StepFailure(fault, step)
        state = Accepted(system, profiles, before)
        values = {measure.name: float(measure.value(state)) for measure in self.measures}
        elastic_energy, plastic_dissipation = system.energies()
        return Record(
            step=len(before) + 1,
            at=values[self.at] if self.at else system.equilibrium.load,
            values=values,
            contact_area=self.copies * state.contact_area,
            elastic_energy=elastic_energy,
            plastic_dissipation=plastic_dissipation,
            friction_dissipation=system.friction_dissipation(),
            work=work,
            force_balance=self.balance(state, values),
            iterations=step.iterations,
            cutbacks=step.cutbacks,
            seconds=seconds,
        )

    def step_warnings(
        self, m: Record, profiles: Mapping[str, Any], residual: float, before: Sequence[Record] = ()
    ) -> list[str]:
        """What to warn of after the step ``m``, which Newton's method left with a ``residual`` and
        which follows the steps ``before``. Collective."""
        state = Accepted(self.system, profiles, before, residual)
        return [said for check in self.checks for said in check(state, m)]

    def energy_balance(self, steps: Sequence[Record]) -> float | None:
        """See `energies.energy_balance`; bodies are pressed into each other in the stage of
        fits."""
        return energy_balance(steps, self.fit, contact=self._may_touch)

    def work_doubts(self, steps: Sequence[Record]) -> list[str]:
        """See `energies.work_doubts`, with the same steps."""
        noise = self.system.energy_noise()
        return work_doubts(steps, self.fit, contact=self._may_touch, round_off=noise)

    @property
    def _may_touch(self) -> bool:
        return bool(self.system.problem.interactions)


def sizes(system: System) -> ByName:
    """Sizes of the mesh for run.json."""
    lengths = {name: side.facet_lengths() for name, side in system.sides.items()}
    extremes = {name: [float(s.min()), float(s.max())] for name, s in lengths.items()}
    return {
        "cells": system.n_cells,
        "kind": system.cell_kind,
        "dofs": system.n_dofs,
        "contact_facets": {name: len(length) for name, length in lengths.items()},
        "element_size_on_arc": extremes,
    }

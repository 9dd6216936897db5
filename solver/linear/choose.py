"""Which strategies solve the Newton systems of a problem, and why not the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dolfinx import fem
from petsc4py import PETSc

from archord.materials.kinematics import Bools
from archord.report.by_name import Words
from archord.solver.linear import bordered, condensed, lagged, look_ahead, multigrid, substructured
from archord.solver.linear.direct import Direct
from archord.solver.linear.strategy import Facts, Strategy

# Every strategy beside MUMPS on the whole matrix, which always goes: None, or why it does not fit
# the facts.
_MODULES = bordered, condensed, multigrid, substructured, lagged, look_ahead
RULES = {module.__name__.rpartition(".")[2]: module.why_not for module in _MODULES}
# of MUMPS on the whole matrix the first that fits, and how the system is said to be solved then
INSTEAD = {
    "condensed": "condensed",
    "multigrid": "solved by multigrid",
    "substructured": "substructured",
}
_WITHOUT = {"condensed": ["lagged", "look_ahead"], "multigrid": ["lagged"]}  # strategies they spare
LEFT_OUT: set[str] = set()  # strategies to do without; benchmarks and tests set it


@dataclass
class Choice:
    """``why_not`` holds, by the name of a strategy, why it is not used; None if it is."""

    why_not: dict[str, str | None]

    def uses(self, name: str) -> bool:
        """Whether the strategy ``name`` is used."""
        return self.why_not[name] is None

    def factoriser(
        self, V: fem.FunctionSpace, fixed: Bools, terms: Sequence[PETSc.Mat]
    ) -> Strategy:
        """The strategy that solves with the sum of ``terms``, which only multigrid takes more than
        one of, of the displacements ``V``, of which some are ``fixed`` ``(n_local, d)``.
        Collective."""
        if self.uses("multigrid"):
            return multigrid.Multigrid(terms, V, fixed)
        [A] = terms
        if self.uses("substructured"):
            parts = substructured.substructures(A, V)
            if not isinstance(parts, str):
                return parts
            self.why_not["substructured"] = parts
        return Direct(A)

    def words(self) -> dict[str, str | Words]:
        """The choice for run.json: ``strategy`` names what is used, ``not_used`` has the
        reasons."""
        used = [name for name in self.why_not if self.uses(name)]
        if not set(INSTEAD).intersection(used):
            used.append("direct")
        not_used = {name: said for name, said in self.why_not.items() if said is not None}
        return {"strategy": " + ".join(used), "not_used": not_used}


def choose(facts: Facts) -> Choice:
    """The strategies for a problem with these ``facts``. Collective."""
    reasons = {name: rule(facts) for name, rule in RULES.items()}
    reasons |= {name: "left out on request" for name in LEFT_OUT & reasons.keys()}
    fitting = [name for name in INSTEAD if reasons[name] is None]
    given_way = fitting[1:]
    if fitting and fitting[0] in _WITHOUT:
        given_way += _WITHOUT[fitting[0]]
    return Choice(reasons | {name: f"the system is {INSTEAD[fitting[0]]}" for name in given_way})

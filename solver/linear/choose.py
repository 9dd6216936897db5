"""Which strategies solve the Newton systems of a problem, and why not the others."""

from __future__ import annotations

from dataclasses import dataclass

from dolfinx import fem
from petsc4py import PETSc

from archord.solver.linear import bordered, condensed, lagged, look_ahead, substructured
from archord.solver.linear.direct import Direct
from archord.solver.linear.strategy import Facts, Strategy

# Every strategy beside MUMPS on the whole matrix, which always goes: None, or why it does not fit
# the facts.
_MODULES = bordered, condensed, substructured, lagged, look_ahead
RULES = {module.__name__.rpartition(".")[2]: module.why_not for module in _MODULES}
INSTEAD = ("condensed", "substructured")  # of MUMPS on the whole matrix: the first that fits
LEFT_OUT: set[str] = set()  # strategies to do without; benchmarks and tests set it


@dataclass
class Choice:
    """``why_not`` holds, by the name of a strategy, why it is not used; None if it is."""

    why_not: dict[str, str | None]

    def uses(self, name: str) -> bool:
        """Whether the strategy ``name`` is used."""
        return self.why_not[name] is None

    def factoriser(self, V: fem.FunctionSpace, A: PETSc.Mat) -> Strategy:
        """The strategy that factorises ``A``, of the displacements ``V``. Collective."""
        if self.uses("substructured"):
            parts = substructured.substructures(A, V)
            if not isinstance(parts, str):
                return parts
            self.why_not["substructured"] = parts
        return Direct(A)

    def words(self) -> dict[str, str | dict[str, str]]:
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
    if "condensed" in fitting:
        given_way += ["lagged", "look_ahead"]
    return Choice(reasons | {name: f"the system is {fitting[0]}" for name in given_way})

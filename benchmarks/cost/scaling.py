"""How time and memory grow with the mesh and fall with the ranks: ``archord benchmark scaling``.

Everything that is concluded here is concluded from measured costs; `extrapolated` says what it assumes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from archord.benchmarks.cost.scaling_cases import Case, cases
from archord.benchmarks.cost.scaling_run import PARTS, REST, Cost, launcher, middle, solve

SPEED_UP, SPEED_UP_AT = 1.6, 1_000_000  # on 2 ranks at so many dofs
ROUNDS = 3  # of all numbers of ranks at that size
CONTACT_SHARE = 0.1  # on 2 ranks
AROUND_FACTORS = 0.25  # of the solve, at every size
TIME_EXPONENT, MEMORY_EXPONENT = 1.3, 1.1
SAME_FORCE = 1e-8  # relative difference of P between numbers of ranks
SERIAL = ("start-up", "mesh", "output", REST)  # done by rank 0 alone, or by every rank in full
TOLD = (2, 4, 8, 16, 32, 64)  # ranks of the extrapolation


def run(
    largest: float, ranks: Sequence[int], folder: Path, repeats: int, said: Callable[[Cost], None] = lambda cost: None
) -> list[Cost]:
    """Solve all cases up to ``largest`` dofs below ``folder``, each ``repeats`` times, of which the run with the median
    time counts; ``said`` follows each. Raises `InputError`.

    Numbers of ranks take turns, and the size at which a speed-up is asked for is solved `ROUNDS` times at least: the
    time of such a run can differ by a third. Both materials are solved once before, on a small mesh, so that no run
    pays for compiling forms.
    """
    chosen = cases(largest, ranks)
    launcher(max(ranks))
    folder.mkdir(parents=True, exist_ok=True)
    for plastic in (False, True):
        solve(Case(3000, 1, plastic), folder)
    costs = []
    for size, of_size in groupby(chosen, key=lambda case: (case.dofs, case.plastic, case.guided)):
        side_by_side = list(of_size)
        rounds = max(repeats, ROUNDS if size[0] == SPEED_UP_AT and len(side_by_side) > 1 else 1)
        runs = [[solve(case, folder) for case in side_by_side] for _ in range(rounds)]
        for of_case in zip(*runs, strict=True):
            costs.append(middle(of_case))
            said(costs[-1])
    return costs


@dataclass(frozen=True)
class Costs:
    """The costs of all runs that finished, found by what was solved."""

    all: list[Cost]

    @property
    def finished(self) -> list[Cost]:
        """Runs without a fault, and with a coarse start."""
        return [cost for cost in self.all if not cost.fault and cost.case.guided]

    def unguided(self) -> list[tuple[Cost, Cost]]:
        """Pairs of runs of one case: with a coarse start, and without."""
        alone = [c for c in self.all if not c.fault and not c.case.guided]
        return [(c, a) for a in alone for c in self.finished if replace(a.case, guided=True) == c.case]

    def series(self, ranks: int, *, plastic: bool = False) -> list[Cost]:
        """Finished runs on ``ranks`` ranks by size, without those of the weak series alone."""
        found = [c for c in self.finished if c.case.ranks == ranks and c.case.plastic == plastic and not c.case.weak]
        return sorted(found, key=lambda cost: cost.dofs)

    def of(self, dofs: int, ranks: int) -> Cost | None:
        """The elastic run of this size, if it finished."""
        found = [c for c in self.finished if (c.case.dofs, c.case.ranks, c.case.plastic) == (dofs, ranks, False)]
        return found[0] if found else None

    @property
    def ranks(self) -> list[int]:
        """Numbers of ranks, 1 first."""
        return sorted({c.case.ranks for c in self.all})

    def strong(self) -> list[tuple[Cost, Cost]]:
        """Pairs of one size: on one rank, and on several."""
        pairs = [(one, self.of(one.case.dofs, r)) for one in self.series(1) for r in self.ranks[1:]]
        return [(one, several) for one, several in pairs if several is not None]

    def weak(self) -> list[tuple[Cost, Cost]]:
        """Pairs of about one size per rank: on one rank, and on several."""
        pairs = [(one, self.of(one.case.dofs * r, r)) for one in self.series(1) for r in self.ranks[1:]]
        return [(one, several) for one, several in pairs if several is not None]

    def faults(self) -> list[str]:
        """A sentence for every run that did not finish, and every force that depends on the number of ranks."""
        said = [f"{cost.case.name}: {cost.fault}" for cost in self.all if cost.fault]
        for one, several in self.strong():
            difference = abs(several.force / one.force - 1)
            if not difference <= SAME_FORCE:
                said.append(f"{several.case.name}: P differs by {difference:.1e} from that on 1 rank")
        return said


def exponent(dofs: Sequence[float], values: Sequence[float]) -> float:
    """The power of ``dofs`` with which ``values`` grow: slope of a least-squares line through their logarithms; nan for
    fewer than two."""
    if len(dofs) < 2:
        return float("nan")
    return float(np.polynomial.Polynomial.fit(np.log(dofs), np.log(values), 1).convert().coef[1])


def serial_fraction(one: float, several: float, ranks: int) -> float:
    """The share of Amdahl's law, ``T(r) = T(1) (s + (1 - s)/r)``, that explains the seconds on 1 and on ``ranks``
    ranks; between 0 and 1."""
    return float(np.clip((ranks * several / one - 1) / (ranks - 1), 0.0, 1.0)) if one > 0 else 1.0


def extrapolated(one: Cost, several: Cost, ranks: int) -> dict[str, float]:
    """Seconds by part on ``ranks`` ranks, if each part goes on as it was measured from 1 to several ranks.

    `SERIAL` parts stay what they were on several ranks; every other one follows Amdahl's law with its own measured
    serial fraction. Nothing here knows of networks, of memory that ranks share, or of the fronts of an elimination
    tree that are too few for many ranks: the law is kind to large numbers.
    """
    measured = several.case.ranks
    out = {name: several.seconds[name] for name in SERIAL}
    for name in (name for name in PARTS if name not in SERIAL):
        s = serial_fraction(one.seconds[name], several.seconds[name], measured)
        out[name] = one.seconds[name] * (s + (1 - s) / ranks)
    return out


def goals(costs: Costs) -> list[tuple[str, str, bool]]:
    """What is asked for, what was measured, and whether that meets it; without what was not measured."""
    said = []
    serial = costs.series(1)
    if len(serial) > 1:
        dofs = [c.dofs for c in serial]
        for name, values, limit in (
            ("time", [c.total for c in serial], TIME_EXPONENT),
            ("memory", [c.peak for c in serial], MEMORY_EXPONENT),
        ):
            power = exponent(dofs, values)
            said.append((f"{name} grows at most like N^{limit:g}", f"N^{power:.2f}", power <= limit))
    for one, two in costs.strong():
        if two.case.ranks == 2 and one.case.dofs == SPEED_UP_AT:
            factor = one.total / two.total
            said.append(
                (f"{SPEED_UP:g} times faster on 2 ranks at {one.dofs} dofs", f"{factor:.2f}", factor >= SPEED_UP)
            )
    shares = [c.contact_share for c in costs.series(2)]
    if shares:
        text = f"contact below {CONTACT_SHARE:.0%} of the time on 2 ranks"
        said.append((text, f"at most {max(shares):.1%}", max(shares) < CONTACT_SHARE))
    parts = [c.share_around_factors for plastic in (False, True) for c in costs.series(1, plastic=plastic)]
    if parts:
        text = f"contact search, assembly and return map at most {AROUND_FACTORS:.0%} of the solve at every size"
        said.append((text, f"at most {max(parts):.0%}", max(parts) <= AROUND_FACTORS))
    unfinished = [c for c in costs.all if c.fault]
    done = f"{len(costs.all) - len(unfinished)} of {len(costs.all)} runs"
    return [*said, ("every mesh finishes, plastic ones included", done, not unfinished)]

"""The joints that the general law is fitted to, and fresh ones that it is checked on, as sweep
files.

    python3 -m archord.studies.law_design > scenes/law.sweep.toml
    python3 -m archord.studies.law_design --fresh 200 --seed 1 > fresh.sweep.toml

A joint is drawn from Sobol's sequence over Poisson's ratios, the ratio of the moduli, dR/R, the
yield stress (from the smallest s of the range to one at which yielding begins at 3 dR), and the
other body's yield stress. It is solved at multiples of about the displacement of first yield up to
3 dR, then taken back, and a quarter of them once more from a smaller displacement. Where yielding
begins early it is solved with two steps between the same nodes, too.

First yield and the way back are those of the law that is there. To fit that anew moves
displacements, so scenes/law.sweep.toml, which the law was fitted to, is kept.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import tomli_w
from scipy.stats import qmc

from archord.postprocess.laws.general.elastic_model import Elastic, elastic_model
from archord.postprocess.laws.general.general_law import (
    CLEARANCES,
    NU,
    RATIOS,
    SMALLEST_S,
    law_of_numbers,
)
from archord.postprocess.laws.general.joint import Array
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.general.law_fit import EARLY
from archord.postprocess.laws.general.yield_model import MULTIPLES, first_yield
from archord.scene.errors import toml_value

Row = dict[str, Any]
# By plane, what yields, whether the other body is stronger, and whether by little, or the pin is
# soft, or yields early.
JOINTS = {
    **{
        "strain both": 280,
        "strain block": 170,
        "strain block weaker": 170,
        "strain pin": 170,
        "strain pin weaker": 190,
    },
    **{
        "strain both soft": 60,
        "strain block soft": 35,
        "strain block weaker soft": 35,
        "strain pin soft": 35,
    },
    **{"strain pin weaker soft": 35, "strain elastic": 320, "strain elastic soft": 64},
    **{
        "stress both": 100,
        "stress block": 70,
        "stress block weaker": 80,
        "stress pin": 70,
        "stress pin weaker": 80,
    },
    **{
        "stress block weaker alike": 110,
        "stress pin weaker alike": 40,
        "strain pin weaker early": 64,
    },
}
FRESH = {
    kind: number
    for kind, number in JOINTS.items()
    if kind.split()[-1] not in ("soft", "alike", "early")
} | {
    "strain elastic": 90,
    "stress elastic": 60,
}
ELASTIC = [
    0.01,
    0.02,
    0.035,
    0.06,
    0.1,
    0.16,
    0.25,
    0.38,
    0.55,
    0.8,
    1.1,
    1.5,
    2.0,
    2.5,
    3.05,
]  # x of elastic joints
_BEYOND = 0.03  # of the range, by which the joints to fit to exceed it
_WAY = np.array([0.2, 0.45, 0.66, 0.8, 0.9, 0.97, 1.03, 1.1])  # of the way back
_FRESH_WAY = np.array(
    [0.15, 0.35, 0.53, 0.67, 0.78, 0.86, 0.92, 0.96, 1.0, 1.04, 1.09, 1.16, 1.25, 1.4]
)
_CYCLES = 0.25  # share of joints that come back from a smaller displacement, too
_BASE = {
    "units": {"length": "R", "stress": "E*"},
    "analysis": {"plane": "strain"},
    "joint": {"radius": 1.0, "clearance": 0.005, "relative_element_size": 0.05},
    "block": {"E": 2.0, "nu": 0.3},
    "load": {"displacement": 2.0, "steps": 1},
    "output": {"fields": False},
}


@dataclass(frozen=True)
class Drawn:
    """A joint: what of the scene is its ``own``, in units of R and E*; its ``numbers`` (see
    `SolvedJoints`); x0 of the body that yields ``first`` and of the one that decides ``last``
    (infinite: elastic); two random numbers more."""

    own: Row
    numbers: tuple[float, ...]
    first: float
    last: float
    odd: float
    chance: float

    @cached_property
    def law(self) -> JointCurve:
        """Its law, as it is told before it is solved."""
        return law_of_numbers(self.numbers)

    def back(self, deepest: float, way: Array) -> list[float]:
        """Displacements at these shares of the way back from the ``deepest``."""
        opens = float(self.law.residual([[deepest]])[0, 0])
        return [t for t in deepest - (deepest - opens) * way if t > 0.01]


def joints(kind: str, number: int, seed: int, beyond: float = 0.0) -> Iterator[Drawn]:
    """``number`` joints of a ``kind``, one of `JOINTS`; their range exceeds that of the law by
    ``beyond``."""
    plane, yields, *more = kind.split()
    strain, soft, wide = plane == "strain", "soft" in more, 1 + beyond
    for u in qmc.Sobol(8, seed=seed).random(number):
        nu = NU[1] * (1 + beyond / 6) * u[:2] ** 0.85
        nu[0] = NU[1] * (0.83 + 0.17 * u[0]) if soft else nu[0]
        ratio = _between(RATIOS[0] / wide, 0.8 if soft else RATIOS[1] * wide, u[2])
        ends = 1 - nu**2 if strain else np.ones(2)
        p = float(ends[0] / ratio / (ends[0] / ratio + ends[1]))
        if (
            yields in ("block", "elastic") and not more
        ):  # a tenth of the pins are rigid, others nearly
            p *= float(np.clip((0.9 - u[2]) / 0.03, 0.0, 1.0))
        clearance = _between(CLEARANCES[0] / wide, CLEARANCES[1] * wide, u[3])
        own: Row = ({} if strain else {"analysis.plane": plane}) | {
            "joint.clearance": clearance,
            "block.E": ends[1] / (1 - p),
            "block.nu": nu[1],
        }
        own |= {"pin.E": ends[0] / p, "pin.nu": nu[0]} if p else {"pin.rigid": True}
        m, n = nu / (1 - nu) if strain else nu
        elastic = Elastic(*np.array([[p], [m if p else 0.0], [n], [clearance]]))
        onsets, stresses = [np.inf, np.inf], {"pin": np.inf, "block": np.inf}
        if yields != "elastic":
            latest = _latest(strain, elastic)
            s = _between(SMALLEST_S[plane] / wide, 0.4 if "early" in more else latest, u[4] ** 1.2)
            other = s if yields == "both" else np.inf
            if (
                "weaker" in more
            ):  # a weak pin in a block keeps its force in plane strain: the block yields, too
                weakest = 0.25 if "alike" in more else 0.75
                other = (
                    _between(s, latest, u[5])
                    if yields == "pin" and strain
                    else s / (0.98 - weakest * u[5])
                )
            stresses = {"pin": s, "block": other} if yields == "pin" else {"pin": other, "block": s}
            for body, stress in stresses.items():
                if np.isfinite(stress) and f"{body}.E" in own:
                    own[f"{body}.yield_stress"] = stress * clearance
            each = (s, other) if yields == "pin" and strain and "weaker" in more else (s, s)
            onsets = [
                float(first_yield(elastic_model(), strain, elastic, np.array([each_s]))[0])
                for each_s in each
            ]
        numbers = (
            float(strain),
            *(float(value[0]) for value in elastic),
            stresses["pin"],
            stresses["block"],
        )
        yield Drawn(own, numbers, *onsets, *u[6:].tolist())


def _between(low: float, high: float, share: float) -> float:
    return low * (high / low) ** share


def _latest(strain: bool, elastic: Elastic) -> float:
    """The s with which a joint begins to yield at nearly 3 dR."""
    grid = np.geomspace(0.05, 5.0, 200)
    many = Elastic(*(np.repeat(value, len(grid)) for value in elastic))
    return float(np.interp(2.95, first_yield(elastic_model(), strain, many, grid), grid))


def training() -> Iterator[Row]:
    """The scenes that the law is fitted to."""
    for seed, (kind, number) in enumerate(JOINTS.items(), 100):
        for joint in joints(kind, number, seed, _BEYOND):
            if np.isinf(joint.first):
                yield joint.own | {
                    "load.displacement": ELASTIC,
                    "joint.relative_element_size": 0.03,
                }
                continue
            x = joint.last * MULTIPLES[: int(np.searchsorted(joint.last * MULTIPLES, 3.0)) + 1]
            before = 0.95 * joint.first * 1.25 ** np.arange(30)
            x = np.concatenate([before[before < 0.85 * joint.last], x])
            yield from _yielding(joint, x, _WAY, joint.chance / _CYCLES)


def fresh(number: int, seed: int) -> Iterator[Row]:
    """Scenes of ``number`` joints, elastic ones among them, at other displacements than the law was
    fitted to."""
    shares = np.diff(
        np.round(np.cumsum(np.append(0, [*FRESH.values()])) * number / sum(FRESH.values()))
    ).astype(int)
    for offset, (kind, share) in enumerate(zip(FRESH, shares, strict=True)):
        for joint in joints(kind, share, 1000 * seed + offset):
            x0, early = joint.first, [0.02, 0.05, 0.1]
            if np.isinf(x0):
                yield joint.own | {
                    "load.displacement": [*early, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 2.5, 3.0]
                }
                continue
            x = x0 * (0.9 + 0.2 * joint.odd) * 1.16 ** np.arange(30)
            x = np.array([*(e for e in early if e < 0.8 * x0), *x[x < 2.9], 3.0])
            yield from _yielding(joint, x, _FRESH_WAY, joint.chance)


def _yielding(joint: Drawn, x: Array, way: Array, chance: float) -> Iterator[Row]:
    """Scenes of one joint that yields: to the last of ``x`` and back, twice as fine where it yields
    early, and, where ``chance`` is less than one, to an earlier one, back, and on."""
    yield joint.own | {"load.displacement": [*x, *joint.back(x[-1], way)]}
    if min(joint.numbers[5:]) < EARLY:
        yield joint.own | {"load.displacement": [*x], "load.steps": 2}
    if chance < 1 and len(x) > 3:
        i = 2 + int(chance * (len(x) - 3))
        below = joint.back(x[i], way)
        again = (below[min(2, len(below) - 1)] + x[i]) / 2
        yield joint.own | {"load.displacement": [*x[: i + 1], *below, again, *x[i : i + 2]]}


def sweep_file(rows: Iterable[Row]) -> str:
    """The sweep of ``rows``, in short numbers."""

    def short(value: Any) -> Any:
        if isinstance(value, list | tuple):
            return [float(f"{v:.4g}") for v in value]
        return float(f"{value:.5g}") if isinstance(value, float) else value

    lines = (
        ",".join(f"{key}={toml_value(short(value)).replace(' ', '')}" for key, value in row.items())
        for row in rows
    )
    return (
        "list = [\n"
        + "".join(f"{{{line}}},\n" for line in lines)
        + "]\n\n"
        + tomli_w.dumps({"base": _BASE})
    )


def main() -> None:
    """Print a sweep file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fresh", type=int, help="that many joints to check the law on")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print(sweep_file(fresh(given.fresh, given.seed) if given.fresh else training()), end="")


if __name__ == "__main__":
    main()

"""Sweep files of the joints that the general law is fitted to, and of fresh joints to check it on.

    python3 -m archord.studies.law_design > law.sweep.toml
    python3 -m archord.studies.law_design --fresh 200 --seed 1 > fresh.sweep.toml
    python3 -m archord.studies.law_design --fresh 8 --kind "strain elastic soft" > soft.sweep.toml
    python3 -m archord.studies.law_design --fresh 60 --ends > ends.sweep.toml
    python3 -m archord.studies.law_design --meshes > meshes.sweep.toml

A joint is drawn from Sobol's sequence over Poisson's ratios, the ratio of the moduli, dR/R, the
yield stress (from the smallest s of the range to one at which yielding begins at 3 dR), and the
other body's yield stress. It is solved at multiples of about the displacement of first yield up to
3 dR, then unloaded. A quarter of the joints are also unloaded from a smaller displacement. In
plane stress, and where yielding begins early, a second run takes two steps between the same nodes.

The law tells where joints yield first and open. The sweep was designed with an earlier law, so that
it is always the same file: law_design.json has the elastic model of this law, and law_design.npz
the residual clearances that it told.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from archord.materials.material import Array
from archord.postprocess.laws.general.elastic_model import Elastic, ElasticModel
from archord.postprocess.laws.general.general_law import (
    CLEARANCES,
    NU,
    RATIOS,
    SMALLEST_S,
    law_of_numbers,
)
from archord.postprocess.laws.general.law_fit import steps_count
from archord.postprocess.laws.general.yield_model import MULTIPLES, Numbers, first_yield
from archord.report.table import in_digits
from archord.scene.sections.errors import toml_value

Row = dict[str, Any]
# How many joints of each kind. A kind is the plane, what yields, whether the other body is stronger
# ("weaker"), and whether by little ("alike"), or the pin is soft, or yields early, or has at most
# 0.8 of the block's modulus ("compliant"), or numbers lie at the ends of their ranges ("ends").
JOINTS = {
    "strain both": 220,
    "strain block": 170,
    "strain block weaker": 170,
    "strain pin": 170,
    "strain pin weaker": 190,
    "strain both soft": 60,
    "strain block soft": 35,
    "strain block weaker soft": 35,
    "strain pin soft": 35,
    "strain pin weaker soft": 35,
    "strain elastic": 320,
    "strain elastic soft": 64,
    "stress both": 100,
    "stress block": 70,
    "stress block weaker": 80,
    "stress pin": 70,
    "stress pin weaker": 80,
    "stress block weaker alike": 110,
    "stress pin weaker alike": 40,
    "strain pin weaker early": 64,
    "strain both early compliant": 20,
    "strain block early compliant": 20,
    "strain block weaker early compliant": 32,
    "strain pin early compliant": 40,
    "strain pin weaker early compliant": 40,
    "strain elastic ends": 128,
}
_ENDS = " ends"
# kinds that are not drawn to check the law
_SPECIAL = ("soft", "alike", "early", "compliant", _ENDS)
FRESH = {kind: n for kind, n in JOINTS.items() if not kind.endswith(_SPECIAL)}
FRESH |= {"strain both": 280, "strain elastic": 90, "stress elastic": 60}
# Joints that are solved on several meshes, and the sizes of their elements over R: the error of the
# mesh is largest where a block yields alone in plane stress.
MESHES = {
    "stress block": 12,
    "stress pin": 4,
    "stress both": 4,
    "stress block weaker": 2,
    "strain block": 2,
}
SIZES = (0.1, 0.05, 0.02)
_NEXT = 1.25  # x of their nodes over the last one's
_SEED_OF_MESHES = 500
END = 3.0
# x of elastic joints
ELASTIC = [0.01, 0.02, 0.035, 0.06, 0.1, 0.16, 0.25, 0.38, 0.55, 0.8, 1.1, 1.5, 2.0, 2.5, 3.05]
_FRESH_EARLY = [0.02, 0.05, 0.1]  # x of all fresh joints
_FRESH_ELASTIC = [*_FRESH_EARLY, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 2.5, 3.0]
_BEYOND = 0.03  # part by which the joints to fit to exceed the range of the law
# Parts of the way back at which a joint is solved.
_WAY = np.array([0.2, 0.45, 0.66, 0.8, 0.9, 0.97, 1.03, 1.1])
FRESH_WAY = np.array(
    [0.15, 0.35, 0.53, 0.67, 0.78, 0.86, 0.92, 0.96, 1.0, 1.04, 1.09, 1.16, 1.25, 1.4]
)
_CYCLES = 0.25  # share of joints that are also unloaded from a smaller displacement
_OPENS = Path(__file__).with_suffix(".npz")
_ELASTIC = Path(__file__).with_suffix(".json")
ELEMENT_SIZE = 0.05  # over R, of the joints to fit to
CHECK_SIZE = 0.025  # of joints to check the law on, unless another one is asked for
_BASE = """
[base.units]
length = "R"
stress = "E*"

[base.analysis]
plane = "strain"
{tolerance}
[base.joint]
radius = 1.0
clearance = 0.005
relative_element_size = {size:g}

[base.block]
E = 2.0
nu = 0.3

[base.load]
displacement = 2.0
steps = 1

[base.output]
fields = false
"""


@dataclass(frozen=True)
class Drawn:
    """A joint: ``own`` keys of its scene, in units of R and E*; its ``numbers``; x0 of the body
    that yields ``first`` and of the body that decides ``last`` (infinite: elastic); and two more
    random numbers."""

    own: Row
    numbers: Numbers
    first: float
    last: float
    odd: float
    chance: float


def joints(kind: str, number: int, seed: int, beyond: float = 0.0) -> Iterator[Drawn]:
    """``number`` joints of a ``kind``, one of `JOINTS`; their range exceeds the range of the law by
    ``beyond``. With `_ENDS` behind the kind half of their numbers lie at an end of their range."""
    sequence = qmc.Sobol(8, seed=seed).random_base2(number.bit_length())
    for u in sequence[:number]:
        shares = np.clip(2 * u - 0.5, 0.0, 1.0) if kind.endswith(_ENDS) else u
        yield _drawn(kind.removesuffix(_ENDS), shares, beyond)


def _drawn(kind: str, u: Array, beyond: float) -> Drawn:
    """The joint of a ``kind`` that eight numbers ``u`` between 0 and 1 decide."""
    plane, yields, *more = kind.split()
    strain = plane == "strain"
    wide = 1 + beyond
    nu = NU[1] * (1 + beyond / 6) * u[:2] ** 0.85
    stiffest = RATIOS[1] * wide
    if "soft" in more:
        nu[0] = NU[1] * (0.83 + 0.17 * u[0])
    if "soft" in more or "compliant" in more:
        stiffest = 0.8
    ratio = _between(RATIOS[0] / wide, stiffest, u[2])
    ends = 1 - nu**2 if strain else np.ones(2)
    pin_compliance = ends[0] / ratio
    p = float(pin_compliance / (pin_compliance + ends[1]))
    if kind.endswith(("block", "elastic")):  # a tenth of the pins are rigid, others nearly
        p *= float(np.clip((0.9 - u[2]) / 0.03, 0.0, 1.0))
    clearance = _between(CLEARANCES[0] / wide, CLEARANCES[1] * wide, u[3])
    m, n = nu / (1 - nu) if strain else nu
    elastic = Elastic(p, m if p else 0.0, n, clearance)

    own: Row = {} if strain else {"analysis.plane": plane}
    own |= {"joint.clearance": clearance, "block.E": ends[1] / (1 - p), "block.nu": nu[1]}
    own |= {"pin.E": ends[0] / p, "pin.nu": nu[0]} if p else {"pin.rigid": True}
    s = stronger = onset = last = np.inf
    if yields != "elastic":
        latest = _latest(strain, elastic)
        largest = 0.4 if "early" in more else latest
        s = _between(SMALLEST_S[plane] / wide, largest, u[4] ** 1.2)
        onset = last = float(first_yield(earlier_model(), strain, elastic, s))
    if yields == "both":
        stronger = s
    elif "weaker" in more and yields == "pin" and strain:
        # The block holds the weak pin, and decides the force once it yields, too.
        stronger = _between(s, latest, u[5])
        last = float(first_yield(earlier_model(), strain, elastic, stronger))
    elif "weaker" in more:
        stronger = s / (0.98 - (0.25 if "alike" in more else 0.75) * u[5])
    pin, block = (s, stronger) if yields == "pin" else (stronger, s)
    for body, stress in (("pin", pin), ("block", block)):
        if np.isfinite(stress) and f"{body}.E" in own:
            own[f"{body}.yield_stress"] = stress * clearance
    odd, chance = map(float, u[6:])
    return Drawn(own, Numbers(float(strain), *elastic, pin, block), onset, last, odd, chance)


@cache
def earlier_model() -> ElasticModel:
    """The elastic model that the sweep was designed with."""
    return ElasticModel.from_json(_ELASTIC.read_text(encoding="utf-8"))


def _between(low: float, high: float, share: float) -> float:
    return low * (high / low) ** share


def _latest(strain: bool, elastic: Elastic) -> float:
    """The s with which a joint begins to yield at nearly 3 dR."""
    grid = np.geomspace(0.05, 5.0, 200)
    return float(np.interp(2.95, first_yield(earlier_model(), strain, elastic, grid), grid))


def training() -> Iterator[Row]:
    """The scenes that the law is fitted to."""
    with np.load(_OPENS) as stored:
        opens = iter(stored["opens"].tolist())
    for seed, (kind, number) in enumerate(JOINTS.items(), 100):
        for joint in joints(kind, number, seed, _BEYOND):
            if np.isinf(joint.first):
                yield joint.own | {
                    "load.displacement": ELASTIC,
                    "joint.relative_element_size": 0.03,
                }
                continue
            x = loading_nodes(joint)
            yield from yielding_rows(joint, x, _WAY, joint.chance / _CYCLES, lambda _: next(opens))


def loading_nodes(joint: Drawn) -> Array:
    """The x at which a joint that yields is solved on first loading, to fit a law."""
    x = joint.last * MULTIPLES
    x = x[: np.searchsorted(x, 3.0) + 1]
    before = 0.95 * joint.first * 1.25 ** np.arange(30)
    return np.concatenate([before[before < 0.85 * joint.last], x])


def meshes() -> Iterator[Row]:
    """Scenes of the joints of `MESHES`, each of all `SIZES`, in the same steps."""
    for seed, (kind, number) in enumerate(MESHES.items(), _SEED_OF_MESHES):
        for joint in joints(kind, number, seed):
            for size in SIZES:
                yield joint.own | {
                    "load.displacement": [*steady_nodes(joint, _NEXT)],
                    "joint.relative_element_size": size,
                }


def steady_nodes(joint: Drawn, ratio: float) -> Array:
    """x from about first yield to 3 dR, each at most ``ratio`` times the one before."""
    first = 0.95 * joint.first
    count = math.ceil(math.log(END / first) / math.log(ratio))
    return np.geomspace(first, END, count + 1)


def fresh(number: int, seed: int, of: Mapping[str, int] = FRESH) -> Iterator[Row]:
    """Scenes of ``number`` joints of these kinds, elastic ones among them, at other displacements
    than the law was fitted to."""
    ends = np.cumsum([0, *of.values()])
    shares = np.diff(np.round(ends * number / ends[-1])).astype(int)
    for seed_of_kind, (kind, share) in enumerate(zip(of, shares, strict=True), 1000 * seed):
        for joint in joints(kind, int(share), seed_of_kind):
            if np.isinf(joint.first):
                yield joint.own | {"load.displacement": _FRESH_ELASTIC}
                continue
            law = law_of_numbers(joint.numbers)
            x = fresh_nodes(joint)
            yield from yielding_rows(joint, x, FRESH_WAY, joint.chance, law.residual)


def fresh_nodes(joint: Drawn) -> Array:
    """The x at which a joint that yields is solved on first loading, to check a law."""
    x0 = joint.first
    x = x0 * (0.9 + 0.2 * joint.odd) * 1.16 ** np.arange(30)
    early = [each for each in _FRESH_EARLY if each < 0.8 * x0]
    return np.array([*early, *x[x < 2.9], 3.0])


def yielding_rows(
    joint: Drawn, x: Array, way: Array, chance: float, opens: Callable[[float], Any]
) -> Iterator[Row]:
    """Scenes of one joint that yields: to the last of ``x`` and back, twice as fine where
    `steps_count`, and, where ``chance`` is less than one, to an earlier one, back, and on.
    ``opens`` tells the residual clearance by the deepest displacement."""

    def back(deepest: float) -> list[float]:
        return [t for t in deepest - (deepest - opens(deepest)) * way if t > 0.01]

    yield joint.own | {"load.displacement": [*x, *back(x[-1])]}
    if steps_count(joint.numbers):
        yield joint.own | {"load.displacement": [*x], "load.steps": 2}
    if chance < 1 and len(x) > 3:
        i = 2 + int(chance * (len(x) - 3))
        below = back(x[i])
        lowest = below[min(2, len(below) - 1)]
        again = (lowest + x[i]) / 2
        yield joint.own | {"load.displacement": [*x[: i + 1], *below, again, *x[i : i + 2]]}


def in_planes(kinds: Mapping[str, int]) -> dict[str, int]:
    """How many joints are of each kind in both planes, by how many are in one."""
    return {f"{plane} {kind}": n for plane in SMALLEST_S for kind, n in kinds.items()}


def sweep_file(
    rows: Iterable[Row], size: float = ELEMENT_SIZE, tolerance: float | None = None
) -> str:
    """The sweep of ``rows``, in short numbers, with elements of this ``size`` over R and a
    ``tolerance`` of the solver, if any."""

    def short(value: Any, digits: int = 5) -> Any:
        if isinstance(value, list):
            return [short(each, 4) for each in value]
        return in_digits(value, digits) if isinstance(value, float) else value

    lines = []
    for row in rows:
        pairs = [f"{key}={toml_value(short(value))}" for key, value in row.items()]
        lines.append("{" + ",".join(pairs).replace(" ", "") + "},\n")
    given = f"tolerance = {tolerance}\n" if tolerance else ""
    return f"list = [\n{''.join(lines)}]\n{_BASE.format(tolerance=given, size=size)}"


def main() -> None:
    """Print a sweep file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fresh", type=int, help="that many joints to check the law on")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=JOINTS, help="of the fresh joints; others are of many")
    parser.add_argument("--ends", action="store_true", help="numbers at the ends of their ranges")
    parser.add_argument("--element-size", type=float, default=CHECK_SIZE, help="of fresh ones")
    parser.add_argument("--meshes", action="store_true", help="joints to solve on several meshes")
    given = parser.parse_args()
    if given.fresh:
        of = {given.kind: 1} if given.kind else FRESH
        if given.ends:
            of = {kind.removesuffix(_ENDS) + _ENDS: share for kind, share in of.items()}
        rows = fresh(given.fresh, given.seed, of)
        print(sweep_file(rows, given.element_size), end="")
        return
    print(sweep_file(meshes() if given.meshes else training()), end="")


if __name__ == "__main__":
    main()

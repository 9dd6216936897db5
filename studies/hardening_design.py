"""Sweep files of joints that harden: those that the law's representative strain is fitted to, and
fresh ones to check the law on.

    python3 -m archord.studies.hardening_design > hardening.sweep.toml
    python3 -m archord.studies.hardening_design --fresh 60 --seed 1 > fresh.sweep.toml

Joints are drawn as in law_design.py. Every body that yields then gets a hardening curve of its own,
of one of the `CURVES`; half of the joints whose bodies yield at one stress have one curve for both.
To these come pairs of named metals as they are, with a clearance that is drawn. Joints to fit to
have more pairs with the softest metal, and of metals that yield at nearly one stress.

    python3 -m archord.studies.hardening_design --metals stress > metals.sweep.toml

prints all pairs of named metals with one clearance.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from archord.materials.elasticity import Plane, contact_modulus
from archord.materials.named import metals
from archord.postprocess.laws.general.elastic_model import Elastic
from archord.postprocess.laws.general.general_law import NODES, SMALLEST_S, law_of_numbers
from archord.postprocess.laws.general.hardening_model import BODIES
from archord.postprocess.laws.general.law_fit import steps_count
from archord.postprocess.laws.general.yield_model import Numbers, first_yield
from archord.studies.law_design import (
    CHECK_SIZE,
    ELEMENT_SIZE,
    END,
    FRESH_WAY,
    Drawn,
    Row,
    earlier_model,
    fresh_nodes,
    in_planes,
    joints,
    steady_nodes,
    sweep_file,
    yielding_rows,
)

# how many joints of each kind of law_design.py
JOINTS = in_planes({"both": 84, "block": 54, "pin": 42, "block weaker": 42, "pin weaker": 42})
PAIRS = 80  # of named metals, in each plane
SOFT_PAIRS = 40  # the same, to fit to: with the softest metal as one body or both
CLOSE_PAIRS = 40  # the same, of unlike metals that yield at nearly one stress
NUMBER = sum(JOINTS.values()) + 2 * PAIRS
CURVES = ("line", "Swift", "Voce", "plateau", "metal")
_LATEST = 1.8  # x0 beyond which yielding says little of hardening
_PAIR_CLEARANCES = (0.002, 0.01)  # dR/R of pairs
_CLOSE = 0.35  # |ln| of the bodies' s of close pairs, at most
_ALL_PAIRS_CLEARANCE = 0.005
_SPARE = 4  # times as many joints are drawn as have an earlier x0
_SEED = 3600
_NEXT = 1.2  # x of a node to fit to over the last one's
_TOLERANCE = 1e-5  # of the solver; it moves P by 2e-7


def hardening(random: np.random.Generator, strength: float, E: float, clearance: float) -> Any:
    """The key ``hardening`` of a body with this yield stress ``strength``, in units of E*: how much
    it hardens where strains are of the size of dR/R is drawn. Laws are tables, as sweeps take
    them."""

    def between(low: float, high: float) -> float:
        return float(low * (high / low) ** random.random())

    kind = random.choice(CURVES)
    if kind == "line":
        return E * between(2e-3, 0.1)
    if kind == "metal":
        named = random.choice(sorted(metals()))
        points = np.array(metals()[named]["hardening"])
        return (points * [1.0, strength / points[0, 1]]).tolist()
    if kind == "plateau":
        length = between(0.1, 2.0)
        peeq = np.array([0.0, length, length + between(1.0, 10.0)])
        rise = np.array([1.0, 1.0, between(1.1, 1.8)])
    else:
        peeq = np.insert(np.geomspace(0.01, 50.0, 40), 0, 0.0)
        if kind == "Swift":
            rise = (1 + peeq / between(0.03, 2.0)) ** between(0.05, 0.35)
        else:
            saturation = between(1.1, 2.5)
            rise = saturation - (saturation - 1) * np.exp(-between(0.3, 10.0) * peeq)
    return np.column_stack([peeq * clearance, rise * strength]).tolist()


def pair(metal_of: Mapping[str, Any], strain: bool, clearance: float) -> Drawn:
    """The joint of the metals of "pin" and "block", in plane ``strain`` or in plane stress."""
    plane: Plane = "strain" if strain else "stress"
    metals_in_order = [metal_of[body] for body in BODIES]
    moduli = [contact_modulus(metal["E"], metal["nu"], plane) for metal in metals_in_order]
    E_star = 1 / sum(1 / modulus for modulus in moduli)
    nu = np.array([metal["nu"] for metal in metals_in_order])
    m, n = nu / (1 - nu) if strain else nu
    elastic = Elastic(E_star / moduli[0], m, n, clearance)
    own: Row = {} if strain else {"analysis.plane": "stress"}
    own["joint.clearance"] = clearance
    strengths = []
    for body, metal in metal_of.items():
        points = np.array(metal["hardening"]) / [1.0, E_star]
        own |= {f"{body}.E": metal["E"] / E_star, f"{body}.nu": metal["nu"]}
        own |= {f"{body}.yield_stress": float(points[0, 1]), f"{body}.hardening": points.tolist()}
        strengths.append(float(points[0, 1]) / clearance)
    first = float(first_yield(earlier_model(), strain, elastic, min(strengths)))
    return Drawn(own, Numbers(float(strain), *elastic, *strengths), first, first, 0.5, 1.0)


def any_pair(_: Drawn) -> bool:
    """Takes every pair of metals."""
    return True


def is_soft(joint: Drawn) -> bool:
    """Whether a body of the pair ``joint`` is of the metal that yields at the smallest strain."""
    softest = min(metals().values(), key=lambda metal: metal["hardening"][0][1] / metal["E"])
    strain = softest["hardening"][0][1] / softest["E"]
    strains = [joint.own[f"{body}.yield_stress"] / joint.own[f"{body}.E"] for body in BODIES]
    return bool(np.isclose(strains, strain, rtol=1e-9).any())


def is_close(joint: Drawn) -> bool:
    """Whether the bodies of the pair ``joint`` yield at nearly one stress."""
    pin, block = joint.numbers.yielding
    return pin != block and abs(np.log(block / pin)) < _CLOSE


def pairs(
    number: int,
    plane: str,
    random: np.random.Generator,
    is_wanted: Callable[[Drawn], bool] = any_pair,
) -> Iterator[Drawn]:
    """``number`` wanted pairs of named metals that yield early enough and are in the law's
    range."""
    names = sorted(metals())
    low, high = _PAIR_CLEARANCES
    found = 0
    while found < number:
        metal_of = {body: metals()[random.choice(names)] for body in BODIES}
        joint = pair(metal_of, plane == "strain", low * (high / low) ** random.random())
        in_range = joint.first < _LATEST and min(joint.numbers.yielding) > SMALLEST_S[plane]
        if in_range and is_wanted(joint):
            found += 1
            yield joint


def all_pairs(plane: str) -> Iterator[Drawn]:
    """All pairs of named metals, each with itself, too, that yield before 3 dR, with one
    clearance."""
    for names in itertools.product(sorted(metals()), repeat=2):
        metal_of = {body: metals()[name] for body, name in zip(BODIES, names, strict=True)}
        joint = pair(metal_of, plane == "strain", _ALL_PAIRS_CLEARANCE)
        if joint.first < END:
            yield joint


def hardened(joint: Drawn, random: np.random.Generator) -> Drawn:
    """``joint``, with curves of the bodies that yield."""
    own = dict(joint.own)
    pin, block = joint.numbers.yielding
    alike = pin == block and random.random() < 0.5
    for body in ("pin", "block"):
        strength = own.get(f"{body}.yield_stress")
        if strength is None:
            continue
        curve = hardening(random, strength, own[f"{body}.E"], joint.numbers.clearance)
        if alike and body == "block":
            curve = own["pin.hardening"]
        own[f"{body}.hardening"] = curve
    return replace(joint, own=own)


def drawn(share: float, seed: int, *, special: bool = False) -> Iterator[Drawn]:
    """A ``share`` of `JOINTS`, which harden, and of `PAIRS`; and of the ``special`` pairs, which
    are hard to tell from others."""
    random = np.random.default_rng(seed)
    for kind, count in JOINTS.items():
        wanted = max(round(count * share), 1)
        seed += 1
        candidates = joints(kind, _SPARE * wanted, seed)
        early = (joint for joint in candidates if joint.first < _LATEST)
        for joint, _ in zip(early, range(wanted), strict=False):
            yield hardened(joint, random)
    kinds: list[tuple[int, Callable[[Drawn], bool]]] = [(PAIRS, any_pair)]
    if special:
        kinds += [(SOFT_PAIRS, is_soft), (CLOSE_PAIRS, is_close)]
    for number, is_wanted in kinds:
        for plane in SMALLEST_S:
            yield from pairs(round(number * share), plane, random, is_wanted)


def rows_to_fit(given: Iterable[Drawn]) -> Iterator[Row]:
    """The scenes of the ``given`` joints: to 3 dR, in two step sizes where `steps_count`."""
    for joint in given:
        row = joint.own | {"load.displacement": [*steady_nodes(joint, _NEXT)]}
        yield row
        if steps_count(joint.numbers):
            yield row | {"load.steps": 2}


def rows_to_check(given: Iterable[Drawn]) -> Iterator[Row]:
    """The scenes of the ``given`` joints: to 3 dR at other displacements, and back."""
    for joint in given:
        opens = law_of_numbers(joint.numbers).residual
        nodes = fresh_nodes(joint)
        yield from yielding_rows(joint, nodes, FRESH_WAY[::2], 2.0, _up_to_the_last(opens))


def _up_to_the_last(opens: Callable[[float], Any]) -> Callable[[float], Any]:
    """``opens``, with joints that were deeper than the range as at its end."""
    return lambda deepest: opens(min(deepest, NODES[-1]))


def main() -> None:
    """Print a sweep file."""
    parser = argparse.ArgumentParser(description=__doc__)
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--fresh", type=int, help="that many joints to check the law on")
    which.add_argument("--metals", choices=SMALLEST_S, help="all pairs of metals in this plane")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--element-size", type=float, default=CHECK_SIZE, help="of fresh ones")
    given = parser.parse_args()
    if given.fresh:
        chosen = drawn(given.fresh / NUMBER, 1000 * given.seed)
        rows = rows_to_check(chosen)
    elif given.metals:
        rows = rows_to_fit(all_pairs(given.metals))
    else:
        rows = rows_to_fit(drawn(1.0, _SEED, special=True))
    size = given.element_size if given.fresh or given.metals else ELEMENT_SIZE
    print(sweep_file(rows, size, _TOLERANCE), end="")


if __name__ == "__main__":
    main()

"""Sweep files of joints that harden: those that the law's representative strain is fitted to, and
fresh ones to check the law on.

    python3 -m archord.studies.hardening_design > hardening.sweep.toml
    python3 -m archord.studies.hardening_design --fresh 60 --seed 1 > fresh.sweep.toml

Joints are drawn as in law_design.py. Every body that yields then gets a hardening curve of its own,
of one of the `CURVES`; half of the joints whose bodies yield at one stress have one curve for both.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from archord.materials.named import metals
from archord.postprocess.laws.general.general_law import NODES, law_of_numbers
from archord.studies.law_design import (
    FRESH_WAY,
    Drawn,
    Row,
    fresh_nodes,
    joints,
    loading_nodes,
    sweep_file,
    yielding_rows,
)

# how many joints of each kind of law_design.py, in each plane
JOINTS = {"both": 28, "block": 18, "pin": 12, "block weaker": 12, "pin weaker": 14}
CURVES = ("line", "Swift", "Voce", "plateau", "metal")
_LATEST = 1.8  # x0 beyond which yielding says little of hardening
_SPARE = 4  # times as many joints are drawn as have an earlier x0
_SEED = 3600
_WAY = np.array([0.2, 0.5, 0.75, 0.9, 1.0])  # parts of the way back
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


def hardened(joint: Drawn, random: np.random.Generator) -> Drawn:
    """``joint``, with curves of the bodies that yield."""
    own = dict(joint.own)
    *_, clearance, pin, block = joint.numbers
    alike = pin == block and random.random() < 0.5
    for body in ("pin", "block"):
        strength = own.get(f"{body}.yield_stress")
        if strength is None:
            continue
        curve = hardening(random, strength, own[f"{body}.E"], clearance)
        if alike and body == "block":
            curve = own["pin.hardening"]
        own[f"{body}.hardening"] = curve
    return replace(joint, own=own)


def drawn(number: float, seed: int) -> Iterator[Drawn]:
    """`JOINTS` times ``number`` joints that harden."""
    random = np.random.default_rng(seed)
    for plane in ("strain", "stress"):
        for kind, count in JOINTS.items():
            wanted = max(round(count * number), 1)
            seed += 1
            early = (
                joint
                for joint in joints(f"{plane} {kind}", _SPARE * wanted, seed)
                if joint.first < _LATEST
            )
            for joint, _ in zip(early, range(wanted), strict=False):
                yield hardened(joint, random)


def rows(given: Iterator[Drawn], fresh: bool) -> Iterator[Row]:
    """The scenes of the ``given`` joints: to 3 dR and back, in two step sizes where yielding begins
    early."""
    for joint in given:
        opens = law_of_numbers(joint.numbers).residual
        nodes = fresh_nodes(joint) if fresh else loading_nodes(joint)
        way = FRESH_WAY[::2] if fresh else _WAY
        yield from yielding_rows(joint, nodes, way, 2.0, _up_to_the_last(opens))


def _up_to_the_last(opens: Callable[[float], Any]) -> Callable[[float], Any]:
    """``opens``, with joints that were deeper than the range as at its end."""
    return lambda deepest: opens(min(deepest, NODES[-1]))


def main() -> None:
    """Print a sweep file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fresh", type=int, help="that many joints to check the law on")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    share = given.fresh / (2 * sum(JOINTS.values())) if given.fresh else 1.0
    seed = 1000 * given.seed if given.fresh else _SEED
    text = sweep_file(rows(drawn(share, seed), bool(given.fresh)))
    plane = 'plane = "strain"\n'
    print(text.replace(plane, f"{plane}tolerance = {_TOLERANCE}\n", 1), end="")


if __name__ == "__main__":
    main()

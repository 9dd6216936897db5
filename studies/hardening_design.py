"""Sweep files of joints that harden: those that the law's representative strain is fitted to, and
fresh ones to check the law on.

    python3 -m archord.studies.hardening_design > hardening.sweep.toml
    python3 -m archord.studies.hardening_design --fresh 60 --seed 1 > fresh.sweep.toml

Joints are drawn as in law_design.py. Every body that yields then gets a hardening curve of its own,
of one of the `CURVES`; half of the joints whose bodies yield at one stress have one curve for both.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from archord.materials.named import metals
from archord.postprocess.laws.general.general_law import NODES, law_of_numbers
from archord.postprocess.laws.general.law_fit import EARLY
from archord.studies.law_design import (
    CHECK_SIZE,
    FRESH_WAY,
    Drawn,
    Row,
    checking,
    fresh_nodes,
    joints,
    steady_nodes,
    sweep_file,
    yielding_rows,
)

# how many joints of each kind of law_design.py
_KINDS = {"both": 84, "block": 54, "pin": 42, "block weaker": 42, "pin weaker": 42}
JOINTS = {f"{plane} {kind}": n for plane in ("strain", "stress") for kind, n in _KINDS.items()}
CURVES = ("line", "Swift", "Voce", "plateau", "metal")
_LATEST = 1.8  # x0 beyond which yielding says little of hardening
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


def drawn(share: float, seed: int) -> Iterator[Drawn]:
    """A ``share`` of `JOINTS`, which harden."""
    random = np.random.default_rng(seed)
    for kind, count in JOINTS.items():
        wanted = max(round(count * share), 1)
        seed += 1
        candidates = joints(kind, _SPARE * wanted, seed)
        early = (joint for joint in candidates if joint.first < _LATEST)
        for joint, _ in zip(early, range(wanted), strict=False):
            yield hardened(joint, random)


def rows_to_fit(given: Iterable[Drawn]) -> Iterator[Row]:
    """The scenes of the ``given`` joints: to 3 dR, in two step sizes where yielding is early."""
    for joint in given:
        row = joint.own | {"load.displacement": [*steady_nodes(joint, _NEXT)]}
        yield row
        if min(joint.numbers[5:]) < EARLY:
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
    parser.add_argument("--fresh", type=int, help="that many joints to check the law on")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--element-size", type=float, default=CHECK_SIZE, help="of fresh ones")
    given = parser.parse_args()
    text = sweep_file(rows_to_fit(drawn(1.0, _SEED)))
    if given.fresh:
        chosen = drawn(given.fresh / sum(JOINTS.values()), 1000 * given.seed)
        text = checking(sweep_file(rows_to_check(chosen)), given.element_size)
    plane = 'plane = "strain"\n'
    print(text.replace(plane, f"{plane}tolerance = {_TOLERANCE}\n", 1), end="")


if __name__ == "__main__":
    main()

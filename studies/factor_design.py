"""Sweep files of joints with friction and at large strain, each solved without them, too: those
that the law's factors are fitted to, and fresh ones to check them on.

    python3 -m archord.studies.factor_design > factor.sweep.toml
    python3 -m archord.studies.factor_design friction > friction.sweep.toml
    python3 -m archord.studies.factor_design "large strain" > large.sweep.toml
    python3 -m archord.studies.factor_design friction --fresh 60 --seed 1 > fresh.sweep.toml

Joints are drawn as in law_design.py, half of those that yield with hardening curves as in
hardening_design.py. A third of them comes back.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterator
from itertools import cycle

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.factor_model import FRICTION, LARGE_STRAIN, LARGEST
from archord.postprocess.laws.general.law_fit import steps_count
from archord.studies.hardening_design import hardened
from archord.studies.law_design import (
    ELEMENT_SIZE,
    END,
    Drawn,
    Row,
    in_planes,
    joints,
    steady_nodes,
    sweep_file,
)

# how many joints of each kind of law_design.py
JOINTS = in_planes(
    {"both": 50, "block": 30, "pin": 25, "block weaker": 25, "pin weaker": 25, "elastic": 45}
)
KINDS = (FRICTION, LARGE_STRAIN)
_SMALLEST = 0.03  # coefficient of friction
_SEED = 7200
_FIRST = 0.05  # x
_NEXT = 1.3  # x of a node over the last one's
_BACK = 3  # of so many joints one comes back
_WAY = np.array([0.97, 0.92, 0.85, 0.75, 0.6, 0.45, 0.3])  # x over the deepest, on the way back


def nodes(joint: Drawn) -> Array:
    """The x at which a joint is solved, to 3 dR."""
    if np.isinf(joint.first):
        count = round(np.log(END / _FIRST) / np.log(_NEXT))
        return np.geomspace(_FIRST, END, count + 1)
    yielding = steady_nodes(joint, _NEXT)
    before = _FIRST * _NEXT ** np.arange(30)
    return np.concatenate([before[before < 0.85 * yielding[0]], yielding])


def drawn(share: float, seed: int) -> Iterator[tuple[Drawn, float]]:
    """A ``share`` of `JOINTS`, and their coefficients of friction."""
    random = np.random.default_rng(seed)
    for kind, count in JOINTS.items():
        seed += 1
        for joint in joints(kind, max(round(count * share), 1), seed):
            friction = float(random.uniform(_SMALLEST, LARGEST))
            yields = bool(np.isfinite(joint.first))
            hardens = yields and random.random() < 0.5
            yield (hardened(joint, random) if hardens else joint), friction


def rows(kinds: Collection[str], share: float, seed: int, *, checks: bool = False) -> Iterator[Row]:
    """The scenes of a ``share`` of `JOINTS`, without friction and large strain and with each of
    these ``kinds``; to check the law also in two step sizes where `steps_count`."""
    for (joint, friction), turn in zip(drawn(share, seed), cycle(range(_BACK)), strict=False):
        x = nodes(joint)
        back = x[-1] * _WAY if turn == 0 else []
        path = {"load.displacement": [*x, *back]}
        keys: dict[str, Row] = {
            FRICTION: {"analysis.friction": friction},
            LARGE_STRAIN: {"analysis.strain": "large"},
        }
        yield joint.own | path
        for kind in kinds:
            own = keys[kind]
            yield joint.own | path | own
            if checks and steps_count(joint.numbers):
                yield joint.own | own | {"load.displacement": [*x], "load.steps": 2}


def main() -> None:
    """Print a sweep file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", nargs="?", choices=KINDS, help="both kinds unless given")
    parser.add_argument("--fresh", type=int, help="that many joints to check the law on")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--element-size", type=float, default=ELEMENT_SIZE, help="of fresh ones")
    given = parser.parse_args()
    kinds = (given.kind,) if given.kind else KINDS
    if given.fresh:
        share = given.fresh / sum(JOINTS.values())
        own = rows(kinds, share, 1000 * given.seed, checks=True)
        print(sweep_file(own, given.element_size), end="")
        return
    print(sweep_file(rows(kinds, 1.0, _SEED)), end="")


if __name__ == "__main__":
    main()

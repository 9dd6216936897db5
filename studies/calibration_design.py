"""The design of the calibrated law, printed by ``python3 -m archord.studies.calibration_design``.

Joints of R = 10 mm and E* = 100 GPa, which no dimensionless result depends on, pressed by twice the clearance. Each
plane has joints that stay elastic, joints both of whose bodies yield at one stress, and joints of which only the block
yields; each of these kinds a Latin hypercube (McKay, Beckman, Conover 1979) over all that varies, and the edges of its
range by hand. ``s = sigY R/(E* dR)`` takes the place of sigY/E*, as it decides how far a joint yields.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from archord.scene.keys import toml_value

R, E_STAR = 10.0, 1e5  # mm, MPa
NU = (0.0, 0.49)
SOFTEST, BOTH_STIFFEST = -0.5, 9 / 11  # Dundurs' alpha of a pin 3 times softer and 10 times stiffer; 1: a rigid pin
S = {"strain": (0.15, 2.0), "stress": (0.2, 2.0)}  # in plane stress, a smaller one makes the pin collapse
CLEARANCE = (0.001, 0.02)  # dR/R
_DIGITS = 6
_HEAD = """\
# The joints to which the law of archord law calibrated is fitted, printed by
#     python3 -m archord.studies.calibration_design > scenes/calibration.sweep.toml
# Solve them, and fit the law again (docs/calibration.md):
#     mpirun -n 2 archord sweep scenes/calibration.sweep.toml
#     archord fit runs/calibration --law postprocess/laws/calibrated_law.json --csv postprocess/laws/calibrated_rows.csv
"""
_BASE = """\
[base.joint]
radius = {R}
relative_clearance = 0.005
relative_element_size = {size}

[base.pin]
E = 200000.0
nu = 0.3

[base.block]
E = 200000.0
nu = 0.3

[base.load]
displacement = 2.0
steps = 20

[base.output]
fields = false
"""


@dataclass(frozen=True)
class Joint:
    """A joint by its dimensionless numbers: ``alpha`` is Dundurs' (1: a rigid pin), ``s`` infinite if elastic.

    ``yielding`` is "none", "both" or "block".
    """

    plane: str
    yielding: str = "none"
    alpha: float = 0.0
    pin_nu: float = 0.3
    nu: float = 0.3
    s: float = math.inf
    clearance: float = 0.005

    def overrides(self) -> dict[str, Any]:
        """What the scene of this joint says, by dotted keys."""
        said: dict[str, Any] = {"analysis.plane": self.plane, "joint.relative_clearance": _rounded(self.clearance)}
        if self.alpha == 1:
            said["pin.rigid"] = True
        else:
            said |= {"pin.E": self._modulus(1 - self.alpha, self.pin_nu), "pin.nu": _rounded(self.pin_nu)}
        said |= {"block.E": self._modulus(1 + self.alpha, self.nu), "block.nu": _rounded(self.nu)}
        for body in {"none": (), "both": ("pin", "block"), "block": ("block",)}[self.yielding]:
            said[f"{body}.yield_stress"] = _rounded(self.s * self.clearance * E_STAR)
        return said

    def _modulus(self, compliance: float, nu: float) -> float:
        """E of a body that has half of ``compliance`` of 1/E*."""
        return _rounded(2 * E_STAR / compliance * (1 - nu**2 if self.plane == "strain" else 1))


def joints() -> list[Joint]:
    """All joints of the design."""
    return [joint for plane in S for joint in _of_plane(plane)]


def fresh(number: int, seed: int = 100) -> list[Joint]:
    """``number`` other joints of each plane and kind in the same ranges, to judge the law by."""
    found: list[Joint] = []
    for plane in S:
        for yielding, stiffest in (("none", 1.0), ("both", BOTH_STIFFEST), ("block", 1.0)):
            seed += 1
            found += _sampled(Joint(plane, yielding), number, seed, stiffest)
    return found


def _of_plane(plane: str) -> Iterator[Joint]:
    seed = list(S).index(plane)
    elastic = Joint(plane)
    for alpha in (SOFTEST, 0.0, 0.5, 1.0):
        for nu in (0.0, 0.15, 0.3, 0.4, 0.49):
            yield replace(elastic, alpha=alpha, nu=nu, pin_nu=nu)
    for nu, pin_nu in ((0.0, 0.49), (0.49, 0.0)):
        yield from (replace(elastic, alpha=alpha, nu=nu, pin_nu=pin_nu) for alpha in (SOFTEST, 0.0, 0.5))
    yield from _sampled(elastic, 20, 10 + seed, 1.0)
    both = replace(elastic, yielding="both")
    yield from (replace(both, s=s) for s in (S[plane][0], 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.6))
    for s in (0.2, 0.5):
        yield from (replace(both, s=s, nu=nu, pin_nu=nu) for nu in NU)
        yield from (replace(both, s=s, alpha=alpha) for alpha in (SOFTEST, BOTH_STIFFEST))
        yield from (replace(both, s=s, clearance=clearance) for clearance in CLEARANCE)
    yield from _sampled(both, 56, 20 + seed, BOTH_STIFFEST)
    block = replace(elastic, yielding="block")
    for alpha in (0.0, 1.0):
        yield from (replace(block, s=s, alpha=alpha) for s in (S[plane][0], 0.25, 0.4, 0.8, 1.25))
        yield from (replace(block, s=0.3, alpha=alpha, nu=nu, pin_nu=nu) for nu in NU)
    yield from _sampled(block, 36, 30 + seed, 1.0)


def _sampled(joint: Joint, number: int, seed: int, stiffest: float) -> Iterator[Joint]:
    """``number`` joints like ``joint`` at the points of a Latin hypercube, always the same ones."""
    from scipy.stats import qmc

    points = qmc.LatinHypercube(d=5, seed=np.random.default_rng(seed)).random(number)
    low = [NU[0], NU[0], SOFTEST, math.log(CLEARANCE[0]), math.log(S[joint.plane][0])]
    high = [NU[1], NU[1], stiffest, math.log(CLEARANCE[1]), math.log(S[joint.plane][1])]
    for nu, pin_nu, alpha, clearance, s in qmc.scale(points, low, high):
        stress = math.inf if joint.yielding == "none" else math.exp(s)
        yield replace(joint, nu=nu, pin_nu=pin_nu, alpha=alpha, clearance=math.exp(clearance), s=stress)


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def as_sweep(chosen: list[Joint] | None = None, element_sizes: tuple[float, ...] = (0.05,)) -> str:
    """The sweep file of all joints, or of those ``chosen``, on meshes with ``element_sizes`` on the arcs, over R."""
    rows = [
        "    { " + ", ".join(f"{key} = {toml_value(value)}" for key, value in joint.overrides().items()) + " },"
        for joint in (joints() if chosen is None else chosen)
    ]
    head = "" if chosen else _HEAD
    parts = [head, "list = [", *rows, "]", "", _BASE.format(R=R, size=element_sizes[0])]
    if len(element_sizes) > 1:
        parts += ["[grid]", f"joint.relative_element_size = {toml_value(list(element_sizes))}", ""]
    return "\n".join(parts)


def main() -> None:
    """Print the sweep file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--every", type=int, default=1, help="print every so many joints only [1]")
    parser.add_argument("--fresh", type=int, metavar="N", help="print N other joints of each plane and kind instead")
    parser.add_argument("--element-size", type=float, nargs="+", default=[0.05], help="on the arcs, over R [0.05]")
    arguments = parser.parse_args()
    chosen = None
    if arguments.fresh:
        chosen = fresh(arguments.fresh)
    elif arguments.every > 1:
        chosen = joints()[arguments.every // 2 :: arguments.every]
    print(as_sweep(chosen, tuple(arguments.element_size)), end="")


if __name__ == "__main__":
    main()

"""What moves the plastic law: ``python3 -m archord.benchmarks.finding``.

The paper's joint with dR/R = 0.5 %, sigY/E* = 0.2 %, where its eqs 11, 12 give 0.00434 E* R at 2 dR: what
plane, Poisson's ratio, ratio of the moduli, yielding body, clearance and kinematics make of it, and k and c of the
plastic-Winkler law that fits each (threshold c sigY; the paper has k = 0.85, c = 1).
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from mpi4py import MPI

from archord.benchmarks.paper_runs import PLANES, Plane
from archord.postprocess.calibration import calibrate
from archord.postprocess.run_curve import read_run
from archord.postprocess.winkler import plastic_force
from archord.solver.run import solve_scene
from archord.solver.scene import Scene
from archord.solver.scene_file import parse_scene


@dataclass(frozen=True)
class Variant:
    """A joint in units of R = E* = 1; ``ratio`` is E of the pin over that of the block (None: a rigid pin)."""

    name: str
    nu: float = 0.3
    ratio: float | None = 1.0
    yielding: tuple[str, ...] = ("pin", "block")
    clearance: float = 0.005
    yield_stress: float = 0.002
    kinematics: str = "current"

    def scene(self, plane: Plane, element_size: float, steps: int = 20) -> Scene:
        """The scene in a plane."""
        factor = 1 - self.nu**2 if plane == "strain" else 1.0
        block = factor * (1 + (0.0 if self.ratio is None else 1 / self.ratio))
        moduli = {"pin": None if self.ratio is None else self.ratio * block, "block": block}
        bodies = {
            name: {"rigid": True}
            if E is None
            else {"E": E, "nu": self.nu} | ({"yield_stress": self.yield_stress} if name in self.yielding else {})
            for name, E in moduli.items()
        }
        return parse_scene(
            {
                "joint": {"radius": 1.0, "clearance": self.clearance, "relative_element_size": element_size},
                **bodies,
                "analysis": {"plane": plane, "kinematics": self.kinematics},
                "load": {"displacement": 2.0, "steps": steps},
            }
        )


VARIANTS = (
    Variant("reference: like bodies, nu = 0.3"),
    Variant("nu = 0", nu=0.0),
    Variant("nu = 0.2", nu=0.2),
    Variant("nu = 0.4", nu=0.4),
    Variant("nu = 0.49", nu=0.49),
    Variant("pin 3 times stiffer", ratio=3.0),
    Variant("pin 10 times stiffer", ratio=10.0),
    Variant("pin 3 times softer", ratio=1 / 3),
    Variant("rigid pin", ratio=None, yielding=("block",)),
    Variant("only the block yields", yielding=("block",)),
    Variant("only the pin yields", yielding=("pin",)),
    Variant("pin 10 times stiffer, only the block yields", ratio=10.0, yielding=("block",)),
    Variant("reference kinematics", kinematics="reference"),
    Variant("dR/R = 0.1 %, sigY/E* = 0.04 %", clearance=0.001, yield_stress=0.0004),
    Variant("dR/R = 1 %, sigY/E* = 0.4 %", clearance=0.01, yield_stress=0.004),
    Variant("sigY/E* = 0.1 %", yield_stress=0.001),
    Variant("sigY/E* = 0.15 %", yield_stress=0.0015),
    Variant("sigY/E* = 0.3 %", yield_stress=0.003),
    Variant("sigY/E* = 0.4 %", yield_stress=0.004),
    Variant("sigY/E* = 0.5 %", yield_stress=0.005),
)
HEADINGS = ("joint", "plane", "P(2 dR)/(E* R)", "over eq. 12", "p0/sigY", "k", "c", "R2 of P", "c of the plateau")


def row(variant: Variant, plane: Plane, element_size: float) -> tuple[list[str], tuple[float, float] | None]:
    """Solve a variant and fit it: the entries below `HEADINGS`, and k and c where both could be fitted."""
    with tempfile.TemporaryDirectory() as folder:
        outcome = solve_scene(variant.scene(plane, element_size), Path(folder), MPI.COMM_SELF)
        if outcome.status != "done":
            return [variant.name, plane, outcome.message, *["-"] * 6], None
        fits = calibrate([read_run(folder)], (0.1, 2.0)).joint
    last = outcome.steps[-1]
    law = float(plastic_force(2 * variant.clearance, 0.85, 1.0, 1.0, 1.0, variant.clearance, variant.yield_stress))
    k, c = (f"{e.value:.3f} ± {e.error:.3f}" if e else "-" for e in (fits.P.k, fits.P.c))
    plateau = fits.plateau.c if fits.plateau else None
    numbers = [f"{last.P:.6f}", f"{last.P / law:.3f}", f"{last.p0 / variant.yield_stress:.3f}", k, c]
    entries = [variant.name, plane, *numbers, f"{fits.P.r2:.4f}", f"{plateau.value:.3f}" if plateau else "-"]
    return entries, (fits.P.k.value, fits.P.c.value) if fits.P.k and fits.P.c else None


def _trends(found: dict[tuple[Variant, Plane], tuple[float, float]]) -> Iterator[str]:
    """k and c as powers of s = sigY R/(E* dR), and c as a line in nu, for otherwise like variants."""
    like = VARIANTS[0]
    for plane in PLANES:
        series = {v: kc for (v, p), kc in found.items() if p == plane}
        by_yield = {
            v.yield_stress / v.clearance: kc
            for v, kc in series.items()
            if replace(v, name=like.name, yield_stress=like.yield_stress) == like
        }
        s, values = np.array(list(by_yield)), np.array(list(by_yield.values()))
        for name, value in zip("kc", values.T, strict=True):
            power, start = np.polyfit(np.log(s / 0.4), np.log(value), 1)
            off = np.abs(np.exp(start) * (s / 0.4) ** power / value - 1).max()
            law = f"{name} = {np.exp(start):.3f} (s/0.4)^{power:.3f}"
            yield f"plane {plane}, like bodies, nu = 0.3: {law} within {off:.1%} for s = {s.min():g} to {s.max():g}"
        by_nu = {v.nu: kc[1] for v, kc in series.items() if replace(v, name=like.name, nu=like.nu) == like}
        nu, c = np.array(list(by_nu)), np.array(list(by_nu.values()))
        slope, at_zero = np.polyfit(nu, c, 1)
        off = np.abs((at_zero + slope * nu) / c - 1).max()
        law = f"c = {at_zero:.3f} + {slope:.3f} nu"
        yield f"plane {plane}, like bodies, s = 0.4: {law} within {off:.1%} for nu = {nu.min():g} to {nu.max():g}"


def main() -> None:
    """Solve all variants in both planes, ranks side by side, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--element-size", type=float, default=0.04, help="on the arcs, over R [0.04]")
    element_size = parser.parse_args().element_size
    comm = MPI.COMM_WORLD
    jobs = [(variant, plane) for plane in PLANES for variant in VARIANTS]
    mine = {i: row(*jobs[i], element_size) for i in range(comm.rank, len(jobs), comm.size)}
    gathered = comm.gather(mine)
    if gathered is None:
        return
    rows = {i: result for part in gathered for i, result in part.items()}
    print("| " + " | ".join(HEADINGS) + " |")
    print("|" + "---|" * len(HEADINGS))
    for i in sorted(rows):
        print("| " + " | ".join(rows[i][0]) + " |")
    print("\nWith s = sigY R/(E* dR):\n")
    for line in _trends({jobs[i]: kc for i, (_, kc) in rows.items() if kc is not None}):
        print(f"- {line}")


if __name__ == "__main__":
    main()

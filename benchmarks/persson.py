"""Persson's joint against theory, as a table: ``python3 -m archord.benchmarks.persson``.

A pin in a ring of 100 R under a force at its core, in units of R = E* = 1, against Persson (1964) with the load-angle
relation of Ciavarella and Decuzzi (2001).
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from archord.benchmarks.case import Case, paper_joint, varied
from archord.postprocess.laws.elastic_laws import persson_pressure
from archord.postprocess.laws.joint import LawJoint
from archord.report.table import Table
from archord.scene.scene import Scene

DR = 1e-4
LOADS = (10.0, 2.0, 0.5, 0.1)  # E* dR/P
INTERFERENCE = (-0.05, -0.1, -0.2)
UNLIKE = ((3.0, 0.2), (1.0, 0.4))  # shear modulus and nu of two bodies with Dundurs' beta = 0


def persson_joint(load: float, element_size: float = 0.04, steps: int = 1, **sections: dict) -> Scene:
    """The joint at E* dR/P = ``load`` (negative: dR < 0); ``sections`` override keys of the scene's sections."""
    ring = {"model": "ring", "clearance": DR * float(np.sign(load))}
    force = {"displacement": None, "relative_force": DR / abs(load)}
    return varied(paper_joint(element_size, steps, joint=ring, load=force), **sections)


def unlike(pin: tuple[float, float], block: tuple[float, float]) -> tuple[dict[str, dict], float]:
    """Sections and Dundurs' alpha (positive: the pin is stiffer) of bodies given by shear modulus and nu."""
    bodies = {name: {"E": 2 * mu * (1 + nu), "nu": nu} for name, (mu, nu) in (("pin", pin), ("block", block))}
    modulus = [2 * mu / (1 - nu) for mu, nu in (pin, block)]
    return bodies, (modulus[0] - modulus[1]) / sum(modulus)


def theory(load: float, alpha: float = 0.0) -> tuple[float, float]:
    """``eps`` and ``R p0/P`` at E* dR/P = ``load``, also negative."""

    def excess(b: float) -> float:
        b2 = b * b
        return (2 - (1 + alpha) * (np.log1p(b2) + 2 * b2**2)) / (2 * np.pi * b2 * (1 + b2)) - load

    eps = 2 * np.arctan(brentq(excess, 1e-6, 1e3))
    peak = persson_pressure(LawJoint(1.0, DR, 1.0), np.array(1.0), np.array(eps), np.array(0.0))
    return float(eps), float(peak)


def main() -> None:
    """Solve and print."""
    cases: list[tuple] = [("like bodies", load, h, 1, 0.0, {}) for load in LOADS for h in (0.08, 0.04, 0.02)]
    cases += [("interference", load, 0.04, 4, 0.0, {}) for load in INTERFERENCE]
    for pair in (UNLIKE, UNLIKE[::-1]):
        bodies, alpha = unlike(*pair)
        cases.append((f"unlike, alpha = {alpha:+.3f}", 0.5, 0.04, 1, alpha, bodies))
    table = Table("case", "E* dR/P", "h/R", "R p0/P", "theory", "difference", "eps [deg]", "theory", "difference")
    for name, load, size, steps, alpha, bodies in cases:
        with tempfile.TemporaryDirectory() as folder:
            m = Case(name, persson_joint(load, size, steps, **bodies)).solve(Path(folder)).steps[-1]
        eps, peak = theory(load, alpha)
        pressure = f"{m.p0 / m.P:.6f}", f"{peak:.6f}", f"{m.p0 / m.P / peak - 1:+.1e}"
        angle, known = np.degrees(m.eps), np.degrees(eps)
        table.add(name, f"{load:g}", f"{size:g}", *pressure, f"{angle:.3f}", f"{known:.3f}", f"{angle - known:+.3f}")
    print(table.markdown(), end="")


if __name__ == "__main__":
    main()

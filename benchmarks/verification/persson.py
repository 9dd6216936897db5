"""Persson's joint against theory, as a table: ``python3 -m archord.benchmarks.verification.persson``.

A pin in a ring of 100 R under a force at its core, in units of R = E* = 1, against Persson (1964) with the load-angle
relation of Ciavarella and Decuzzi (2001).
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.optimize import brentq

from archord.benchmarks.case import E
from archord.output.run import solve_scene
from archord.postprocess.laws.law_joint import LawJoint
from archord.postprocess.laws.persson_law import persson_pressure
from archord.scene.file import parse_scene
from archord.scene.scene import Scene

DR = 1e-4
LOADS = (10.0, 2.0, 0.5, 0.1)  # E* dR/P
INTERFERENCE = (-0.05, -0.1, -0.2)
UNLIKE = ((3.0, 0.2), (1.0, 0.4))  # shear modulus and nu of two bodies with Dundurs' beta = 0


def persson_joint(load: float, element_size: float = 0.04, steps: int = 1, **sections: dict) -> Scene:
    """The joint at E* dR/P = ``load`` (negative: dR < 0); ``sections`` override keys of the scene's sections."""
    data: dict = {
        "joint": {"model": "ring", "radius": 1.0, "clearance": DR * np.sign(load), "element_size": element_size},
        "pin": {"E": E, "nu": 0.3},
        "block": {"E": E, "nu": 0.3},
        "load": {"relative_force": DR / abs(load), "steps": steps},
    }
    for name, values in sections.items():
        data[name] = data.get(name, {}) | values
    return parse_scene(data)


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


def _row(
    name: str,
    load: float,
    element_size: float,
    steps: int = 1,
    alpha: float = 0.0,
    bodies: dict[str, dict] | None = None,
) -> str:
    start = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        m = solve_scene(persson_joint(load, element_size, steps, **(bodies or {})), Path(folder)).steps[-1]
    eps, peak = theory(load, alpha)
    angle = f"{np.degrees(m.eps):.3f} | {np.degrees(eps):.3f} | {np.degrees(m.eps - eps):+.3f}"
    pressure = f"{m.p0 / m.P:.6f} | {peak:.6f} | {m.p0 / m.P / peak - 1:+.1e}"
    return f"| {name} | {load:g} | {element_size:g} | {pressure} | {angle} | {perf_counter() - start:.1f} s |"


def main() -> None:
    """Solve and print."""
    print("| case | E* dR/P | h/R | R p0/P | theory | difference | eps [deg] | theory | difference | time |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for load in LOADS:
        for size in (0.08, 0.04, 0.02):
            print(_row("like bodies", load, size), flush=True)
    for load in INTERFERENCE:
        print(_row("interference", load, 0.04, 4), flush=True)
    for pin, block in (UNLIKE, UNLIKE[::-1]):
        bodies, alpha = unlike(pin, block)
        print(_row(f"unlike, alpha = {alpha:+.3f}", 0.5, 0.04, alpha=alpha, bodies=bodies), flush=True)


if __name__ == "__main__":
    main()

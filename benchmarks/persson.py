"""Persson's joint and its theory: a pin in a ring of 100 R under a force at its core, in units of R
= E* = 1, by Persson (1964) with the load-angle relation of Ciavarella and Decuzzi (2001)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from archord.benchmarks.case import paper_joint, varied
from archord.postprocess.laws.elastic_laws import persson_pressure
from archord.postprocess.laws.general.joint import LawJoint
from archord.scene.presets.joint import Scene

DR = 1e-4
UNLIKE = ((3.0, 0.2), (1.0, 0.4))  # shear modulus and nu of two bodies with Dundurs' beta = 0


def persson_joint(
    load: float, element_size: float = 0.04, steps: int = 1, **sections: dict
) -> Scene:
    """The joint at E* dR/P = ``load`` (negative: dR < 0); ``sections`` override keys of the scene's
    sections."""
    ring = {"model": "ring", "clearance": DR * float(np.sign(load))}
    force = {"displacement": None, "relative_force": DR / abs(load)}
    return varied(paper_joint(element_size, steps, joint=ring, load=force), **sections)


def unlike(pin: tuple[float, float], block: tuple[float, float]) -> tuple[dict[str, dict], float]:
    """Sections and Dundurs' alpha (positive: the pin is stiffer) of bodies given by shear modulus
    and nu."""
    given = {"pin": pin, "block": block}
    bodies = {name: {"E": 2 * mu * (1 + nu), "nu": nu} for name, (mu, nu) in given.items()}
    of_pin, of_block = (2 * mu / (1 - nu) for mu, nu in given.values())
    return bodies, (of_pin - of_block) / (of_pin + of_block)


def theory(load: float, alpha: float = 0.0) -> tuple[float, float]:
    """``eps`` and ``R p0/P`` at E* dR/P = ``load``, also negative."""

    def excess(b: float) -> float:
        b2 = b * b
        closing = (1 + alpha) * (np.log1p(b2) + 2 * b2**2)
        return (2 - closing) / (2 * np.pi * b2 * (1 + b2)) - load

    eps = 2 * np.arctan(brentq(excess, 1e-6, 1e3))
    joint = LawJoint(1.0, DR, 1.0)
    peak = persson_pressure(joint, np.array(1.0), np.array(eps), np.array(0.0))
    return float(eps), float(peak)

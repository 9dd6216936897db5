"""What is wrong with the numbers of a material."""

from __future__ import annotations

from typing import Any

import numpy as np

from archord.materials.material import Material
from archord.report.errors import is_number, shown

_BOUNDS = {"E": (1e-30, 1e30), "nu": (-1.0, 0.5)}


def fault_of(material: Material) -> str:
    """What is wrong with E, nu and hardening of a ``material`` that has them; empty if nothing is.

    A yield stress that is no number, or that decreases, would be taken for another material
    without a word.
    """
    for key, (low, high) in _BOUNDS.items():
        value = getattr(material, key, low)
        if hasattr(material, key) and not (is_number(value) and low < value < high):
            return f"{key} = {shown(value)} must be a number between {low:g} and {high:g}"
    hardening: Any = getattr(material, "hardening", None)
    if hardening is None:
        return ""
    if not hasattr(hardening, "stress"):
        return f"hardening = {shown(hardening)} must be a hardening law, such as LinearHardening"
    stress = np.asarray(hardening.stress(hardening.knots()))
    grows = (stress[1:] >= stress[:-1]).all()
    if not (grows and stress[0] > 0):
        return "hardening: yield stresses must be positive and must not decrease with PEEQ"
    return ""

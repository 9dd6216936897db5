"""What small strain leaves out in plane stress: a block thickens where it yields, if its pin hardly
does so. P of small strain is then too low (docs/law.md)."""

from __future__ import annotations

import math

_LEADS = 0.7  # yield stress of a block over its pin's, at most
_NARROWEST = 1e-3  # dR/R of solved joints


def block_thickens(plane: str | None, pin_yield: float | None, block_yield: float | None) -> bool:
    """Whether the block yields in plane stress and its pin hardly does, by their yield stresses;
    None of an elastic body."""
    pin = pin_yield or math.inf
    block = block_yield or math.inf
    return plane == "stress" and block < _LEADS * pin


def error_of_small_strain(clearance: float, *, hardens: bool) -> float:
    """By what part of itself P is about too low then, over delta/R, with dR/R = ``clearance``: 4 to
    11 in solved joints (dR/R from 1.1 to 0.1 %), 0.3 to 2.5 if the block ``hardens``."""
    return 1.0 if hardens else 0.4 / math.sqrt(max(clearance, _NARROWEST))

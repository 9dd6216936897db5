"""Sections of lugs and pins by hand: the forces at which they reach a strength.

Of a plate of width ``W``, edge distance ``e``, thickness ``t``, with a hole of diameter ``D`` and a
pin of diameter ``d``, or a bushing (``d = D``), and the proof strength or the tensile strength for
``f``:

    net section   f (W - D) t
    bearing       1.5 f d t                               EN 1993-1-8, table 3.10
    shear-out     2 (e - D/2 cos 40 deg) t f / sqrt(3)    Bruhn 1973, chapter D1

Chamfers and fillets shorten what bears: for ``t`` then stands the length between them. Of the pin
of a clevis, of outer radius ``R`` and bore ``r``, that an inner plate bears on over ``t_i`` and two
outer ones each over ``t_o``, a gap ``g`` away:

    shear                    2 pi (R^2 - r^2) f / sqrt(3)
    bending, even bearing    2 M / (t_i/4 + g + t_o/2)             Bruhn 1973, chapter D1
    bending, ends bear       P/2 (b_i/2 + g + b_o/2) = M           Melcon and Hoblit 1953

``M`` is the moment that the pin takes: ``f pi (R^4 - r^4)/(4 R)`` where the proof strength is
reached at the surface, and ``4/3 f (R^3 - r^3)`` of the tensile strength on the whole section. A
pin that bends leans on the plates' faces: in the last formula the plates bear no farther from the
faces than they must at their own ultimate forces per thickness ``w``: ``b_i = P/(2 w_i)``, at most
``t_i/2``, and ``b_o = P/(2 w_o)``, at most ``t_o``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from archord.report.by_name import Amounts
from archord.scene.presets.lug import LugShape
from archord.scene.sections.bodies import Solid

PROOF = 0.002  # plastic strain at the proof strength
BEARING = 1.5
_SPREAD = math.radians(40)  # where the shear-out planes leave the hole, from the load axis


def lug_forces(
    lug: LugShape, strength: float, thickness: float, bears: float = math.inf
) -> Amounts:
    """Forces at which the sections of a ``lug`` reach a ``strength``; what bears on it is the pin
    or the bushing, over a length ``bears`` that may be shorter than its ``thickness``."""
    edge = lug.arguments()["edge_distance"]
    bore = lug.hole
    bearing = bore if lug.wall else lug.radius
    planes = 2 * (edge - bore * math.cos(_SPREAD))
    return {
        "net section": strength * (lug.width - 2 * bore) * thickness,
        "bearing": BEARING * strength * 2 * bearing * min(thickness, bears),
        "shear-out": planes * thickness * strength / math.sqrt(3),
    }


@dataclass(frozen=True)
class ClevisPin:
    """The pin of a clevis: its ``radius`` and ``bore``, the lengths over which the ``inner`` plate
    and each ``outer`` one bear, and the ``gap`` between these."""

    radius: float
    bore: float
    inner: float
    outer: float
    gap: float

    def forces(
        self, kind: str, strength: float, plates: tuple[float, float] | None = None
    ) -> Amounts:
        """Forces on the clevis at which the pin reaches a ``strength``, proof strength for the
        ``kind`` "yield". ``plates`` are the ultimate forces on the inner plate and on both outer
        plates together, where they are known."""
        moment = strength * self._modulus(kind)
        arm = self.inner / 4 + self.gap + self.outer / 2
        area = math.pi * (self.radius**2 - self.bore**2)
        found = {
            "shear": 2 * area * strength / math.sqrt(3),
            "bending, even bearing": 2 * moment / arm,
        }
        if kind == "ultimate" and plates is not None:
            found["bending, ends bear"] = self._bent(moment, plates)
        return found

    def _bent(self, moment: float, plates: tuple[float, float]) -> float:
        """The force that bends the pin by ``moment`` where plates bear no farther than they must.

        Each plate bears by its force, or over all its length. The arm is the smallest of the four
        cases, so the force is the largest.
        """
        inner_force, outer_force = plates
        lengths = (self.inner / 2, self.outer)
        per_length = (inner_force / self.inner, outer_force / (2 * self.outer))
        found = []
        for by_force in product((False, True), repeat=2):
            arm = self.gap
            per_force = 0.0
            for length, w, is_free in zip(lengths, per_length, by_force, strict=True):
                if is_free:
                    per_force += 1 / (4 * w)
                else:
                    arm += length / 2
            root = math.sqrt(arm**2 + 8 * per_force * moment)
            found.append(4 * moment / (arm + root))
        return max(found)

    def _modulus(self, kind: str) -> float:
        """Moment over strength: elastic up to the yield load, plastic at the ultimate one."""
        if kind == "yield":
            return math.pi * (self.radius**4 - self.bore**4) / (4 * self.radius)
        return 4 / 3 * (self.radius**3 - self.bore**3)


def proof_strength(solid: Solid) -> float:
    """The engineering stress at a plastic strain of 0.2 %, or first yield where that is higher, as
    with a plateau."""
    first = float(solid.yield_stress or 0.0)
    true = float(solid.law.stress(np.array([PROOF]))[0])
    return max(first, true * math.exp(-PROOF - true / solid.E))


def tensile_strength(solid: Solid) -> float:
    """The largest engineering stress of the hardening curve; beyond it a bar necks (Considere).

    It is at a knot of the curve, or within a straight line between two, where the true stress
    ``s`` has risen to ``h (1 - s/E)``, ``h`` being the slope of the line.
    """
    knots = np.unique([*solid.law.knots(), PROOF])
    stress = solid.law.stress(knots)
    slope = np.diff(stress) / np.diff(knots)
    at_necking = slope / (1 + slope / solid.E)
    beyond = (at_necking - stress[:-1]) / np.where(slope > 0, slope, 1.0)
    within = np.clip(knots[:-1] + beyond, knots[:-1], knots[1:])
    peeq = np.append(knots, within)
    true = solid.law.stress(peeq)
    return max(proof_strength(solid), float((true * np.exp(-peeq - true / solid.E)).max()))

"""What friction and large strain do to the force, p0 and eps of a joint on first loading.

    ln(P/P_0) = mu eps (1 - x_1/x) g    of friction
    ln(P/P_0) = delta/R g               of large strain

P_0 and eps are without them. ln of p0 and eps change likewise, each with a g of its own. Pressure
on the sides of the hole hardly carries without friction. Its shear pushes the pin back: mu times a
part of the force that grows with the semi-angle eps. g is a polynomial of the second degree in mu,
eps, p, p m, q n (see elastic_model.py) and of what is lost to yielding, for each plane. In plane
stress four terms follow for blocks that lead: of what is lost, times itself, and times ln of dR/R.
factor_model.json has the coefficients, which factor_fit.py makes. Below the first node x_1 of the
law friction adds nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import combinations_with_replacement
from pathlib import Path
from typing import NamedTuple

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.elastic_model import Elastic
from archord.report.by_name import ByName
from archord.report.files import read_json

TABLE = Path(__file__).parent / "factor_model.json"
FRICTION = "friction"
LARGE_STRAIN = "large strain"
LARGEST = 0.3  # coefficient of friction that the law covers
_N_INPUTS = 6
_USUAL_CLEARANCE = 0.005  # over R
# the products of inputs that g adds up, before the terms of blocks that lead
PRODUCTS = [
    chosen
    for degree in range(3)
    for chosen in combinations_with_replacement(range(_N_INPUTS), degree)
]
N_TERMS = len(PRODUCTS) + 4


class Plain(NamedTuple):
    """A joint at ``x`` ``(k,)``, from ``first``, the first node of the law, on: its plane, its
    coefficient of ``friction``, its elastic numbers; and at small strain without friction its
    semi-angle [rad], ``ln(P/P_el)``, and how far the block leads (see `block_leads`), ``(k,)``
    each."""

    plane: str
    friction: float
    joint: Elastic
    x: Array
    first: float
    angle: Array
    lost: Array
    leads: Array

    def scale(self, kind: str) -> Array:
        """What g of friction or large strain is multiplied by ``(k,)``."""
        if kind == LARGE_STRAIN:
            return self.x * self.joint.clearance
        return self.friction * self.angle * np.maximum(1 - self.first / self.x, 0.0)

    def terms(self) -> Array:
        """The terms ``(N_TERMS, k)`` of g: the `PRODUCTS` of the inputs, then four terms of a block
        that leads."""
        p, m, n, clearance = self.joint
        one = np.ones_like(self.x)
        inputs = np.stack(
            [
                self.friction / LARGEST * one,
                self.angle,
                p * one,
                p * m * one,
                (1 - p) * n * one,
                self.lost,
            ]
        )
        products = [np.prod(inputs[list(chosen)], axis=0) for chosen in PRODUCTS]
        by_clearance = np.log(clearance / _USUAL_CLEARANCE)
        linear = self.lost_to_leading
        squared = linear * self.lost
        leading = [linear, squared, linear * by_clearance, squared * by_clearance]
        return np.stack([*products, *leading])

    @property
    def lost_to_leading(self) -> Array:
        """What is lost to a block that leads ``(k,)``."""
        return self.leads * self.lost

    def deviation(self, kind: str, errors: Sequence[float]) -> Array:
        """The expected error of ``ln(P/P_0)`` ``(k,)`` by its ``errors``: over the `scale`, and
        more of it for what is lost to a block that leads."""
        usual, leading = errors
        return self.scale(kind) * np.hypot(usual, leading * self.lost_to_leading)


class Gain(NamedTuple):
    """What friction or large strain adds at ``x`` ``(k,)``: ``ln(P/P_0)``, and its expected error;
    the same of p0 and eps; and the expected error of P on the way back, over the largest P."""

    force: Array
    deviation: Array
    peak: Array
    angle: Array
    way_error: Array

    @classmethod
    def together(cls, gains: Sequence[Gain]) -> Gain:
        """All ``gains`` at once: they add up, and their errors are independent."""
        force, deviation, peak, angle, way_error = (
            np.stack(each) for each in zip(*gains, strict=True)
        )
        return cls(
            force.sum(axis=0),
            np.linalg.norm(deviation, axis=0),
            peak.sum(axis=0),
            angle.sum(axis=0),
            np.linalg.norm(way_error, axis=0),
        )


def gain(plain: Plain, kind: str) -> Gain:
    """What friction or large strain adds to a joint that is ``plain`` without."""
    table = factor_model()[kind]
    scale = plain.scale(kind)
    force, peak, angle = scale * (table["gain"][plain.plane] @ plain.terms())
    return Gain(
        force,
        plain.deviation(kind, table["error"][plain.plane]),
        peak,
        angle,
        table["back error"][plain.plane] * scale,
    )


@cache
def factor_model() -> dict[str, ByName]:
    """The models of `FRICTION` and `LARGE_STRAIN` that come with archord, by plane: ``gain``, the
    coefficients ``(3, N_TERMS)`` of `Plain.terms` of P, p0 and eps; ``error``, two numbers for
    `Plain.deviation`; and ``back error``, the factor on `Plain.scale`; 9 in 10 errors keep them."""
    table = read_json(TABLE)
    for model in table.values():
        model["gain"] = {plane: np.array(values) for plane, values in model["gain"].items()}
    return table

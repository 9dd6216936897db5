"""What friction and large strain do to the force, p0 and eps of a joint on first loading.

    ln(P/P_0) = mu eps (1 - x_1/x) g    of friction
    ln(P/P_0) = delta/R g               of large strain

P_0 and eps are without them. ln of p0 and eps change likewise, each with a g of its own. Pressure
on the sides of the hole hardly carries without friction. Its shear pushes the pin back: mu times a
part of the force that grows with the semi-angle eps. g is a polynomial of the second degree in mu,
eps, p, p m, q n (see elastic_model.py) and of what is lost to yielding, for each plane:
factor_model.json, which factor_fit.py makes. Below the first node x_1 of the law friction adds
nothing.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.elastic_model import Elastic

TABLE = Path(__file__).parent / "factor_model.json"
FRICTION = "friction"
LARGE_STRAIN = "large strain"
LARGEST = 0.3  # coefficient of friction that the law covers
_N_INPUTS = 6
# the products of inputs of which g is a sum
PRODUCTS = [
    chosen
    for degree in range(3)
    for chosen in combinations_with_replacement(range(_N_INPUTS), degree)
]


class Plain(NamedTuple):
    """A joint at ``x`` ``(k,)``, from ``first``, the first node of the law, on: its plane, its
    coefficient of ``friction``, its elastic numbers; and at small strain without friction its
    semi-angle [rad] and ``ln(P/P_el)`` ``(k,)``."""

    strain: bool
    friction: float
    joint: Elastic
    x: Array
    first: float
    angle: Array
    lost: Array

    @property
    def plane(self) -> str:
        """The plane."""
        return "strain" if self.strain else "stress"

    def scale(self, kind: str) -> Array:
        """What g of friction or large strain is multiplied by ``(k,)``."""
        if kind == LARGE_STRAIN:
            return self.x * self.joint.clearance
        return self.friction * self.angle * np.maximum(1 - self.first / self.x, 0.0)

    def terms(self) -> Array:
        """The `PRODUCTS` ``(terms, k)`` of the inputs."""
        p, m, n, _ = self.joint
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
        return np.stack([np.prod(inputs[list(chosen)], axis=0) for chosen in PRODUCTS])


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
        table["error"][plain.plane] * scale,
        peak,
        angle,
        table["back error"][plain.plane] * scale,
    )


@cache
def factor_model() -> dict[str, dict[str, Any]]:
    """The models of `FRICTION` and `LARGE_STRAIN` that come with archord, by plane: ``gain``, the
    coefficients ``(3, terms)`` of `PRODUCTS` of P, p0 and eps; and ``error`` and ``back error``,
    the factors on `Plain.scale` that 9 in 10 errors keep."""
    table = json.loads(TABLE.read_text(encoding="utf-8"))
    for model in table.values():
        model["gain"] = {plane: np.array(values) for plane, values in model["gain"].items()}
    return table

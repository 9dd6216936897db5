"""What friction does to the force, p0 and eps of a joint on first loading.

    ln(P/P_0) = mu eps (1 - x_1/x) g,    P_0 and eps without friction

and the same of p0 and eps, each with a g of its own. Pressure on the sides of the hole hardly
carries without friction. Its shear pushes the pin back: mu times a part of the force that grows
with the semi-angle eps. g is a polynomial of the second degree in mu, eps, p, p m, q n (see
elastic_model.py) and of what is lost to yielding, for each plane: friction_model.json, which
friction_fit.py makes. Below the first node x_1 of the law nothing is added.
"""

from __future__ import annotations

import json
from functools import cache
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from archord.postprocess.laws.general.elastic_model import Elastic
from archord.postprocess.laws.general.joint import Array

TABLE = Path(__file__).parent / "friction_model.json"
LARGEST = 0.3  # coefficient of friction that the law covers
_N_INPUTS = 6
# the products of inputs of which g is a sum
PRODUCTS = [
    chosen
    for degree in range(3)
    for chosen in combinations_with_replacement(range(_N_INPUTS), degree)
]


class Rubbing(NamedTuple):
    """A joint with ``friction`` at ``x`` ``(k,)``: its plane, its elastic numbers, and without
    friction its semi-angle [rad] and ``ln(P/P_el)`` ``(k,)``."""

    strain: bool
    friction: float
    joint: Elastic
    x: Array
    angle: Array
    lost: Array

    @property
    def plane(self) -> str:
        """The plane."""
        return "strain" if self.strain else "stress"

    def scale(self, first: float) -> Array:
        """``mu eps (1 - x_1/x)`` ``(k,)`` with the ``first`` node x_1."""
        return self.friction * self.angle * np.maximum(1 - first / self.x, 0.0)

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
    """What friction adds at ``x`` ``(k,)``: ``ln(P/P_0)``, and its expected error; the same of p0
    and eps; and the expected error of P on the way back, over the largest P."""

    force: Array
    deviation: Array
    peak: Array
    angle: Array
    way_error: Array


def gain(rubbing: Rubbing, first: float) -> Gain:
    """What friction adds to a joint that is ``rubbing``; ``first`` is the first node of the law."""
    table = friction_model()
    scale = rubbing.scale(first)
    force, peak, angle = scale * (table["gain"][rubbing.plane] @ rubbing.terms())
    return Gain(
        force,
        table["error"][rubbing.plane] * scale,
        peak,
        angle,
        table["back error"][rubbing.plane] * scale,
    )


@cache
def friction_model() -> dict[str, dict[str, Any]]:
    """The model that comes with archord, by plane: ``gain``, the coefficients ``(3, terms)`` of
    `PRODUCTS` of P, p0 and eps; and ``error`` and ``back error``, the factors on `Rubbing.scale`
    that 9 in 10 errors keep."""
    table = json.loads(TABLE.read_text(encoding="utf-8"))
    gains = {plane: np.array(values) for plane, values in table["gain"].items()}
    return {"gain": gains, "error": table["error"], "back error": table["back error"]}

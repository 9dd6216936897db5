"""The calibrated law of a joint: P(delta) for use elsewhere, as an object, as JSON and as plain Python."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, fields
from string import Template

import numpy as np
from numpy.typing import ArrayLike

from archord.postprocess.laws.chord_laws import plastic_force, plastic_stiffness
from archord.postprocess.laws.joint import Array, LawJoint
from archord.postprocess.laws.law import monotone_root


@dataclass(frozen=True)
class FittedLaw:
    """Plastic-Winkler law of one joint (Hu et al., eqs. 9 to 12 with the threshold ``c sigY``).

    ``c`` and ``sigY`` are None for an elastic law. ``k_error`` and ``c_error`` are standard errors with the mesh's
    error in quadrature (``c_error`` may be None). ``fitted_range`` is the range of ``delta/dR`` of the fit; outside it
    the law extrapolates. Lengths, stresses and forces per unit thickness in the named units. Raises ValueError for
    values that no joint has.
    """

    k: float
    E_star: float
    R: float
    dR: float
    k_error: float
    c: float | None = None
    sigY: float | None = None
    c_error: float | None = None
    fitted_range: tuple[float, float] = (0.0, 0.0)
    plane: str = "strain"
    length_unit: str = "mm"
    force_unit: str = "N/mm"
    fitted_to: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("k", "E_star", "R", "dR", "c", "sigY"):
            value = getattr(self, name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and 0 < value < math.inf) and not (value is None and name in ("c", "sigY")):
                raise ValueError(f"law: {name} = {value!r} must be a number greater than 0.")
        if (self.c is None) != (self.sigY is None):
            raise ValueError("law: c and sigY belong together; give both or none.")

    @property
    def joint(self) -> LawJoint:
        """The joint with the law's coefficients, as the closed-form laws take it."""
        return LawJoint(self.R, self.dR, self.E_star, self.sigY, k=self.k, c=self.c or 1.0)

    def force(self, delta: ArrayLike) -> Array:
        """Force per unit thickness of the whole joint at ``delta`` (any shape); 0 where ``delta <= 0``."""
        return plastic_force(self.joint, np.maximum(delta, 0.0))

    def stiffness(self, delta: ArrayLike) -> Array:
        """``dP/d(delta)`` of `force` (any shape); 0 where ``delta <= 0``."""
        return plastic_stiffness(self.joint, np.maximum(delta, 0.0))

    def displacement(self, force: ArrayLike) -> Array:
        """The inverse of `force` (any shape): 0 where ``force <= 0``, nan where no displacement brings so much.

        The plastic law's force stays below ``2 sqrt(2) c sigY R``, twice the threshold on the longest chord.
        """
        joint = self.joint
        return monotone_root(
            lambda x: plastic_force(joint, x), lambda x: plastic_stiffness(joint, x), np.asarray(force, float), self.dR
        )

    @classmethod
    def from_json(cls, text: str) -> FittedLaw:
        """The law in ``text``, written by ``archord fit --json``. Raises ValueError."""
        try:
            data = json.loads(text)
        except json.JSONDecodeError as error:
            raise ValueError(f"law: is not valid JSON: {error}.") from None
        if isinstance(data, dict) and isinstance(data.get("law"), dict):
            data = data["law"]
        known = {field.name for field in fields(cls)}
        if not isinstance(data, dict) or not {"k", "E_star", "R", "dR", "k_error"} <= data.keys() <= known:
            raise ValueError(f"law: must be a JSON object with keys out of {', '.join(sorted(known))}.")
        for name in ("fitted_range", "fitted_to"):
            if name in data:
                data[name] = tuple(data[name])
        return cls(**data)

    def to_python(self) -> str:
        """Source of a Python module with ``force(delta)`` and ``stiffness(delta)``, which needs only ``math``."""
        low, high = self.fitted_range
        numbers = {name: getattr(self, name) for name in ("k", "c", "sigY", "E_star", "R", "dR")}
        values = {name: "math.inf" if value is None else repr(float(value)) for name, value in numbers.items()}
        values |= {
            "note": "plastic-Winkler law" if self.c is not None else "Winkler law",
            "k_error": f"{self.k_error:.2g}",
            "c_comment": "no yield" if self.c is None else f"standard error {self.c_error or 0.0:.2g}",
            "range": f"{low:g} to {high:g}",
            "units": json.dumps(f"{self.length_unit}; force per unit thickness: {self.force_unit}"),
            "sources": json.dumps(", ".join(self.fitted_to)),
            "plane": self.plane,
        }
        return _MODULE.substitute(values)


PYTHON_BEGINS = '"""Force of a pin joint over its displacement: '  # by which a module of `to_python` is known

_MODULE = Template('''"""Force of a pin joint over its displacement: $note, calibrated by archord fit."""

# runs: $sources, plane $plane
# valid for delta from $range clearances dR
# length: $units

import math

K = $k  # foundation stiffness, standard error $k_error
C = $c  # plateau pressure over yield stress, $c_comment
E_STAR = $E_star  # contact modulus
R = $R  # radius of the pin
DR = $dR  # clearance
SIG_Y = $sigY  # yield stress


def force(delta, k=K, c=C, e_star=E_STAR, r=R, dr=DR, sig_y=SIG_Y):
    """Force per unit thickness at the displacement delta from first touch; 0 while the joint is open."""
    if delta <= 0.0:
        return 0.0
    chord = r * math.sqrt(2.0 * delta / (dr + delta))
    peak, threshold = k * e_star * delta / r, c * sig_y
    if peak <= threshold:
        return 4.0 / 3.0 * peak * chord
    u = threshold / peak
    s = math.sqrt(1.0 - u)
    return 2.0 * threshold * chord * (s + u * (2.0 + s) / (3.0 * (1.0 + s) ** 2))


def stiffness(delta, k=K, c=C, e_star=E_STAR, r=R, dr=DR, sig_y=SIG_Y):
    """Derivative of force; 0 while the joint is open."""
    if delta <= 0.0:
        return 0.0
    chord = r * math.sqrt(2.0 * delta / (dr + delta))
    peak, threshold = k * e_star * delta / r, c * sig_y
    longer = dr / (2.0 * (dr + delta))
    if peak <= threshold:
        return 4.0 / 3.0 * k * e_star / r * chord * (1.0 + longer)
    u = threshold / peak
    s = math.sqrt(1.0 - u)
    flank = u * (2.0 + s) / (3.0 * (1.0 + s) ** 2)
    return 2.0 * threshold * chord / delta * (flank + (flank + s) * longer)
''')

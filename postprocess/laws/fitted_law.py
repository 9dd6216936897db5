"""The law calibrated on runs of a joint: P(delta) for use elsewhere, as an object and as JSON."""

from __future__ import annotations

import warnings
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, model_validator

from archord.materials.material import Array
from archord.postprocess.laws.chord_laws import plastic_winkler
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.law import ROUND_OFF, LawRangeWarning, LawState, rising_root
from archord.report.by_name import Names, Words
from archord.report.readable import json_of

_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class FittedLaw(BaseModel):
    """Plastic-Winkler law of one joint (Hu et al., eqs. 9 to 12 with the threshold ``c sigY``);
    elastic without ``c`` and ``sigY``.

    Errors are standard errors with the mesh's in quadrature. ``fitted_range`` is the range of
    ``delta/dR``; outside it the law extrapolates, beyond its end with a `LawRangeWarning`. ``rms``
    and ``largest`` are of ``law/run - 1`` of P in that range (None: unknown). Lengths, stresses and
    forces per unit thickness in the named units. Raises ValueError for values that no joint has.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    k: _Positive
    E_star: _Positive
    R: _Positive
    dR: _Positive
    k_error: float
    c: _Positive | None = None
    sigY: _Positive | None = None
    c_error: float | None = None
    fitted_range: tuple[float, float] = (0.0, 0.0)
    plane: str = "strain"
    length_unit: str = "mm"
    force_unit: str = "N/mm"
    fitted_to: Names = ()
    rms: float | None = None
    largest: float | None = None

    @model_validator(mode="after")
    def _together(self) -> FittedLaw:
        if (self.c is None) != (self.sigY is None):
            raise ValueError("c and sigY belong together; give both or none")
        return self

    def _asked(self, delta: ArrayLike) -> LawState:
        """`_state`, with a warning beyond the range, if it is known."""
        farthest = float(np.max(delta, initial=0.0)) / self.dR
        end = self.fitted_range[1]
        if end and farthest > end * (1 + ROUND_OFF):
            said = (
                f"delta = {farthest:.4g} dR is beyond the {end:g} dR that the law was fitted to: "
                "it extrapolates"
            )
            warnings.warn(LawRangeWarning(said), stacklevel=3)
        return self._state(delta)

    def _state(self, delta: ArrayLike) -> LawState:
        joint = LawJoint(
            self.R, self.dR, self.E_star, block_yield=self.sigY, k=self.k, c=self.c or 1.0
        )
        return plastic_winkler(joint, np.maximum(delta, 0.0))

    def force(self, delta: ArrayLike) -> Array:
        """Force per unit thickness of the whole joint at ``delta`` (any shape); 0 where ``delta <=
        0``."""
        return self._asked(delta).load

    def stiffness(self, delta: ArrayLike) -> Array:
        """``dP/d(delta)`` of `force` (any shape); 0 where ``delta <= 0``."""
        return self._asked(delta).stiffness

    def displacement(self, force: ArrayLike) -> Array:
        """The inverse of `force` (any shape): 0 where ``force <= 0``, nan where no displacement
        brings so much: the plastic law's force stays below ``2 sqrt(2) c sigY R``."""
        return rising_root(lambda x: self._state(x).load, np.asarray(force, float), self.dR)

    @classmethod
    def from_json(cls, text: str) -> FittedLaw:
        """The law in ``text``, written by ``archord fit --json``. Raises ValueError."""
        data = json_of(text)
        return cls.model_validate(data.get("law", data) if isinstance(data, dict) else data)

    @property
    def about(self) -> Words:
        """What the law is of, how it was found, and how good it is, in words."""
        low, high = self.fitted_range
        law = "Winkler law" if self.c is None else "plastic-Winkler law"
        about = {
            "title": f"{law} of a pin joint, calibrated by archord fit",
            "k": f"{self.k!r}, foundation stiffness, standard error {self.k_error:.2g}",
            "E*": f"{self.E_star!r}, contact modulus",
            "R": f"{self.R!r}, radius of the pin",
            "dR": f"{self.dR!r}, clearance",
        }
        if self.c is not None:
            error = self.c_error or 0.0
            about["c"] = (
                f"{self.c!r}, plateau pressure over yield stress, standard error {error:.2g}"
            )
            about["sigY"] = f"{self.sigY!r}, yield stress"
        quality = "unknown"
        if self.rms is not None:
            quality = f"{self.rms:.2%} rms, {self.largest or 0.0:+.2%} at worst"
        return about | {
            "plane": self.plane,
            "fitted to": ", ".join(self.fitted_to),
            "range": f"delta from {low:g} to {high:g} clearances dR",
            "error against the runs that it was fitted to": quality,
        }

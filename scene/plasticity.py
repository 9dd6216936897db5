"""How a body hardens, in the words of a scene: a number, a table, a named law, a named metal."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag, model_validator

from archord.materials.hardening import (
    Hardening,
    LinearHardening,
    SwiftHardening,
    TabularHardening,
    VoceHardening,
)
from archord.materials.named import metal, metals
from archord.scene.keys import Fault, Pair, Positive, Section, key, require

ROUNDED = 1e-3  # how far a yield stress may be rounded beside a table, relatively
_LAWS = {
    "Voce": {"saturation", "rate"},
    "Swift": {"offset", "exponent"},
    "a tension test": {"engineering"},
}


class HardeningLaw(Section):
    """Parameters of one law: ``saturation`` and ``rate`` (Voce), ``offset`` and ``exponent``
    (Swift), or ``engineering``, the points (strain, stress) of a tension test from first yield
    on."""

    saturation: Positive | None = key("Voce: yield stress at large PEEQ", "stress", default=None)
    rate: Positive | None = key("Voce: how fast it gets there", default=None)
    offset: Positive | None = key("Swift: PEEQ by which the power law is shifted", default=None)
    exponent: Annotated[float, Field(gt=0, le=1)] | None = key(
        "Swift: exponent of the power law", default=None
    )
    engineering: list[Pair] | None = key(
        "points [strain, stress] of a tension test", default=None, min_length=1
    )

    @model_validator(mode="after")
    def _one_law(self) -> HardeningLaw:
        laws = "; or ".join(f"{' and '.join(sorted(keys))} ({law})" for law, keys in _LAWS.items())
        require(set(self.model_dump(exclude_none=True)) in _LAWS.values(), (), f"must have {laws}")
        return self


def _kind(value: Any) -> str:
    return (
        "list"
        if isinstance(value, list)
        else "law"
        if isinstance(value, dict | HardeningLaw)
        else "number"
    )


HardeningKey = Annotated[
    Annotated[float, Field(ge=0), Tag("number")]
    | Annotated[list[Pair], Field(min_length=1), Tag("list")]
    | Annotated[HardeningLaw, Tag("law")],
    Discriminator(_kind),
]


def filled(data: Any, unit: str) -> Any:
    """The keys ``data`` of a solid with those that they leave open: what the metal brings that
    ``material`` names, in the ``unit`` of stress, and the yield stress that a table or a tension
    test says. Raises `Fault`."""
    if not isinstance(data, dict):
        return data
    if isinstance(data.get("material"), int) and str(data["material"]) in metals():
        data = data | {"material": str(data["material"])}  # as --set reads 4340
    if isinstance(data.get("material"), str) and not data.get("rigid"):
        data = _brought(data, unit) | data
    with suppress(
        TypeError, ValueError, LookupError, OverflowError
    ):  # what is no table is refused later
        begin = first_yield(data.get("hardening"))
        said = data.get("yield_stress")
        near = [math.isclose(said, stress, rel_tol=ROUNDED) for stress in begin if said is not None]
        if begin and (said is None or any(near)):
            return data | {"yield_stress": begin[-1]}
    return data


def _brought(data: dict[str, Any], unit: str) -> dict[str, Any]:
    """What the metal brings that ``data`` names: its whole curve from first yield on; or the listed
    yield strength, where the scene says how the metal hardens from there; or its elasticity alone,
    where the scene says the yield stress, too. Raises `Fault`."""
    try:
        found = metal(data["material"], unit)
    except ValueError as error:
        raise Fault(("material",), str(error)) from None
    elastic = {"E": found["E"], "nu": found["nu"]}
    hardening = data.get("hardening")
    if "yield_stress" in data or _begins(hardening):
        return elastic
    if "hardening" in data:
        return elastic | {"yield_stress": found["yield"]}
    said = "would add to the curve of the material, which is all of its hardening: give hardening, too (0.0 for none)"
    require(not data.get("back_stresses"), ("back_stresses",), said)
    curve = found["hardening"]
    return elastic | {"yield_stress": curve[0][1], "hardening": curve}


def _begins(hardening: Any) -> bool:
    """Whether this hardening says itself where it begins: a table, or a tension test."""
    return isinstance(hardening, list) or (
        isinstance(hardening, dict) and "engineering" in hardening
    )


def first_yield(hardening: Any) -> tuple[float, ...]:
    """The stress at which a table begins; of a tension test the engineering stress and the true
    one; of others ()."""
    if not _begins(hardening):
        return ()
    if isinstance(hardening, list):
        return (float(hardening[0][1]),)
    strain, stress = hardening["engineering"][0]
    return float(stress), float(stress * (1 + strain))


def hardening_law(yield_stress: float, hardening: Any, E: float) -> Hardening:
    """The hardening of a body with this yield stress and Young's modulus. Raises ValueError for
    what is no such law."""
    if isinstance(hardening, list):
        return TabularHardening(tuple(map(tuple, hardening)))
    if not isinstance(hardening, HardeningLaw):
        return LinearHardening(yield_stress, hardening)
    if hardening.engineering is not None:
        return TabularHardening.from_engineering(hardening.engineering, E)
    if hardening.rate is not None and hardening.saturation is not None:
        return VoceHardening(yield_stress, hardening.saturation, hardening.rate)
    offset, exponent = hardening.offset or 0.0, hardening.exponent or 0.0
    return SwiftHardening(yield_stress / offset**exponent, offset, exponent)

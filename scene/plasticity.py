"""How a body hardens, in the words of a scene: a number, a table, a named law, a named metal."""

from __future__ import annotations

from contextlib import suppress
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag, model_validator

from archord.materials.hardening import Hardening, LinearHardening, SwiftHardening, TabularHardening, VoceHardening
from archord.materials.named import metal
from archord.scene.keys import Fault, Pair, Positive, Section, key, require

_LAWS = {"Voce": {"saturation", "rate"}, "Swift": {"offset", "exponent"}, "a tension test": {"engineering"}}


class HardeningLaw(Section):
    """Parameters of one law: ``saturation`` and ``rate`` (Voce), ``offset`` and ``exponent`` (Swift), or
    ``engineering``, the points (strain, stress) of a tension test from first yield on."""

    saturation: Positive | None = key("Voce: yield stress at large PEEQ", "stress", default=None)
    rate: Positive | None = key("Voce: how fast it gets there", default=None)
    offset: Positive | None = key("Swift: PEEQ by which the power law is shifted", default=None)
    exponent: Annotated[float, Field(gt=0, le=1)] | None = key("Swift: exponent of the power law", default=None)
    engineering: list[Pair] | None = key("points [strain, stress] of a tension test", default=None, min_length=1)

    @model_validator(mode="after")
    def _one_law(self) -> HardeningLaw:
        laws = "; or ".join(f"{' and '.join(sorted(keys))} ({law})" for law, keys in _LAWS.items())
        require(set(self.model_dump(exclude_none=True)) in _LAWS.values(), (), f"must have {laws}")
        return self


def _kind(value: Any) -> str:
    return "list" if isinstance(value, list) else "law" if isinstance(value, dict | HardeningLaw) else "number"


HardeningKey = Annotated[
    Annotated[float, Field(ge=0), Tag("number")]
    | Annotated[list[Pair], Field(min_length=1), Tag("list")]
    | Annotated[HardeningLaw, Tag("law")],
    Discriminator(_kind),
]


def filled(data: Any, unit: str) -> Any:
    """The keys ``data`` of a solid with those that they leave open: those of the metal that ``material`` names, in the
    ``unit`` of stress, whose hardening goes with its own yield stress alone; and the yield stress that a table or a
    tension test says. Raises `Fault`."""
    if not isinstance(data, dict):
        return data
    if isinstance(name := data.get("material"), str) and not data.get("rigid"):
        try:
            found = metal(name, unit)
        except ValueError as error:
            raise Fault(("material",), str(error)) from None
        if "hardening" in data or "yield_stress" in data:
            del found["hardening"]
        data = found | data
    hardening = data.get("hardening")
    with suppress(TypeError, ValueError, IndexError, KeyError):  # what is no table is refused later
        if isinstance(hardening, dict):
            strain, stress = hardening["engineering"][0]
            return {"yield_stress": stress * (1 + strain)} | data
        if hardening is not None:
            return {"yield_stress": hardening[0][1]} | data
    return data


def hardening_law(yield_stress: float, hardening: Any, E: float) -> Hardening:
    """The hardening of a body with this yield stress and Young's modulus. Raises ValueError for what is no such law."""
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

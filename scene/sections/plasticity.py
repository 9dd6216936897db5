"""How a body hardens, in the words of a scene: a number, a table, a named law, a named metal."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, create_model

from archord.materials.hardening import (
    Hardening,
    LinearHardening,
    SwiftHardening,
    TabularHardening,
    VoceHardening,
)
from archord.materials.named import metal, metals
from archord.report.by_name import ByName
from archord.scene.sections.errors import Fault, toml_value
from archord.scene.sections.keys import Pair, Positive, Section, after, key, require

ROUNDED = 1e-3  # how far a yield stress may be rounded beside a table, relatively
Exponent = Annotated[float, Field(gt=0, le=1)]
Points = Annotated[list[Pair], Field(min_length=1)]


@dataclass(frozen=True)
class NamedLaw:
    """A hardening law as a scene states it: a table of ``parameters``.

    - ``name``: the word of the key ``law``, which scenes need where two laws have the same keys
    - ``law``: the class
    - ``parameters``: the type and the meaning of each key
    - ``make``: takes the yield stress, E and the parameters by name, and returns the `Hardening`;
      by default ``law(yield_stress, **parameters)``
    - ``begins``: of a law that says itself where it begins, takes the parameters and returns the
      stresses that a ``yield_stress`` beside it may repeat; the last one is the true stress
    """

    name: str
    law: type[Hardening]
    parameters: dict[str, tuple[Any, str]]
    make: Callable[..., Hardening] | None = None
    begins: Callable[[ByName], tuple[float, ...]] | None = None

    def of(self, yield_stress: float, E: float, parameters: ByName) -> Hardening:
        """The law of a body with these ``parameters``."""
        if self.make is None:
            made: Callable[..., Hardening] = self.law
            return made(yield_stress, **parameters)
        return self.make(yield_stress, E, **parameters)


def _tension_test(yield_stress: float, E: float, engineering: list[list[float]]) -> Hardening:
    return TabularHardening.from_engineering(engineering, E)


def _first_of_test(parameters: ByName) -> tuple[float, float]:
    strain, stress = parameters["engineering"][0]
    return float(stress), float(stress * (1 + strain))


def _swift(yield_stress: float, E: float, offset: float, exponent: float) -> Hardening:
    return SwiftHardening(yield_stress / offset**exponent, offset, exponent)


# A new law is a class in materials/hardening.py and a row here.
LAWS = (
    NamedLaw(
        "Voce",
        VoceHardening,
        {
            "saturation": (Positive, "yield stress at large PEEQ"),
            "rate": (Positive, "how fast it gets there"),
        },
    ),
    NamedLaw(
        "Swift",
        SwiftHardening,
        {
            "offset": (Positive, "PEEQ by which the power law is shifted"),
            "exponent": (Exponent, "exponent of the power law"),
        },
        _swift,
    ),
    NamedLaw(
        "a tension test",
        TabularHardening,
        {"engineering": (Points, "points [strain, stress] from first yield on")},
        _tension_test,
        _first_of_test,
    ),
)
IN_WORDS = ", ".join(f"{{{', '.join(law.parameters)}}} ({law.name})" for law in LAWS)


def _laws_of(table: ByName) -> list[NamedLaw]:
    """The laws that have just the parameters of a ``table``, and the name that it says."""
    names = table.keys() - {"law"}
    fitting = [law for law in LAWS if law.parameters.keys() == names]
    return [law for law in fitting if table.get("law") in (None, law.name)]


def parameters_of(law: Hardening) -> ByName | None:
    """The table of a scene that states ``law``; None for a law of a class without a row."""
    for row in LAWS:
        if type(law) is row.law and all(hasattr(law, name) for name in row.parameters):
            table = {name: getattr(law, name) for name in row.parameters}
            return table if len(_laws_of(table)) == 1 else {"law": row.name} | table
    return None


class _HardeningTable(Section):
    """The parameters of one of the `LAWS`."""

    @after
    def _one_law(self) -> _HardeningTable:
        laws = (f"{' and '.join(sorted(law.parameters))} ({law.name})" for law in LAWS)
        fitting = _laws_of(self.model_dump(exclude_none=True))
        require(bool(fitting), (), f"must have {'; or '.join(laws)}")
        names = " or ".join(toml_value(law.name) for law in fitting)
        require(len(fitting) == 1, ("law",), f"must be given: {names}")
        return self


def _keys() -> ByName:
    """The keys of all laws, for pydantic: their types, and what they mean in each law."""
    types: ByName = {}
    meanings: dict[str, list[str]] = {}
    for law in LAWS:
        for name, (kind, meaning) in law.parameters.items():
            types[name] = types[name] | kind if name in types else kind
            meanings.setdefault(name, []).append(f"{law.name}: {meaning}")
    keys = {
        name: (types[name] | None, key("; ".join(meanings[name]), default=None)) for name in types
    }
    names = Literal[tuple(law.name for law in LAWS)]  # type: ignore[valid-type]
    said = "name of the law, which its keys tell, too, unless two laws have the same"
    return keys | {"law": (names | None, key(said, default=None))}


HardeningLaw = create_model("HardeningLaw", __base__=_HardeningTable, **_keys())


def _kind(value: Any) -> str:
    if isinstance(value, list):
        return "list"
    return "a law" if isinstance(value, dict | HardeningLaw) else "number"


HardeningKey = Annotated[
    Annotated[float, Field(ge=0), Tag("number")]
    | Annotated[Points, Tag("list")]
    | Annotated[HardeningLaw, Tag("a law")],  # type: ignore[valid-type]
    Discriminator(_kind),
]


def filled(data: Any, unit: str) -> Any:
    """The keys ``data`` of a solid, with the keys that the scene leaves open.

    A metal that ``material`` names brings its numbers, in the ``unit`` of stress. A table or a
    tension test says the yield stress. Raises `Fault`.
    """
    if not isinstance(data, dict):
        return data
    if isinstance(data.get("material"), int) and str(data["material"]) in metals():
        data = data | {"material": str(data["material"])}  # as --set reads 4340
    if isinstance(data.get("material"), str) and not data.get("rigid"):
        data = _brought(data, unit) | data
    # what is no table is refused later
    with suppress(TypeError, ValueError, LookupError, OverflowError):
        begin = first_yield(data.get("hardening"))
        said = data.get("yield_stress")
        repeated = said is not None and any(
            math.isclose(said, stress, rel_tol=ROUNDED) for stress in begin
        )
        if begin and (said is None or repeated):
            return data | {"yield_stress": begin[-1]}
    return data


def _brought(data: ByName, unit: str) -> ByName:
    """What the metal brings that ``data`` names.

    It brings its whole curve from first yield on; or the listed yield strength, where the scene
    says how the metal hardens from there; or its elasticity alone, where the scene says the yield
    stress, too. Raises `Fault`.
    """
    try:
        found = metal(data["material"], unit)
    except ValueError as error:
        raise Fault(("material",), str(error)) from None
    elastic = {"E": found["E"], "nu": found["nu"]}
    if "yield_stress" in data or _beginning_of(data.get("hardening")) is not None:
        return elastic
    if "hardening" in data:
        return elastic | {"yield_stress": found["yield"]}
    said = (
        "would add to the curve of the material, which is all of its hardening: give hardening, "
        "too (0.0 for none)"
    )
    require(not data.get("back_stresses"), ("back_stresses",), said)
    curve = found["hardening"]
    return elastic | {"yield_stress": curve[0][1], "hardening": curve}


def _first_of_table(points: list[list[float]]) -> tuple[float]:
    return (float(points[0][1]),)


def _beginning_of(hardening: Any) -> Callable[[Any], tuple[float, ...]] | None:
    """What tells where this hardening begins, of a table and of a law that says it itself."""
    if isinstance(hardening, list):
        return _first_of_table
    if not isinstance(hardening, dict):
        return None
    begins = (law.begins for law in LAWS if law.begins and law.parameters.keys() & hardening.keys())
    return next(begins, None)


def first_yield(hardening: Any) -> tuple[float, ...]:
    """The stresses at which a ``hardening`` begins that says it itself, the true one last.

    A table has one. A tension test has the engineering stress and the true one. Others have none.
    """
    beginning = _beginning_of(hardening)
    return beginning(hardening) if beginning else ()


def hardening_law(yield_stress: float, hardening: Any, E: float) -> Hardening:
    """The hardening of a body with this yield stress and Young's modulus. Raises ValueError for
    what is no such law."""
    if isinstance(hardening, list):
        return TabularHardening(tuple(map(tuple, hardening)))
    if not isinstance(hardening, HardeningLaw):
        return LinearHardening(yield_stress, hardening)
    parameters = hardening.model_dump(exclude_none=True)
    (law,) = _laws_of(parameters)  # `_one_law` has checked it
    parameters.pop("law", None)
    return law.of(yield_stress, E, parameters)

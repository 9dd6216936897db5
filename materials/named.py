"""Metals by name: elastic constants, strengths and hardening, as named.toml lists them."""

from __future__ import annotations

import difflib
from functools import cache
from typing import TYPE_CHECKING

from archord.report.by_name import ByName
from archord.report.files import toml_beside

if TYPE_CHECKING:
    from archord.materials.j2 import J2Material

_PSI = (
    6.894757293168361e-3  # one pound-force (4.4482216152605 N) on a square inch (25.4 mm), in MPa
)
_PER_MPA = {
    "MPa": 1.0,
    "N/mm2": 1.0,
    "Pa": 1e6,
    "kPa": 1e3,
    "GPa": 1e-3,
    "psi": 1 / _PSI,
    "ksi": 1e-3 / _PSI,
}


@cache
def metals() -> dict[str, ByName]:
    """The tables of named.toml, in MPa."""
    return toml_beside(__file__, "named.toml")


def metal(name: str, unit: str) -> ByName:
    """The metal ``name`` in a ``unit`` of stress: ``E``, ``nu``, the listed strengths ``yield`` (or
    0.2 % proof) and ``tensile``, and ``hardening``, points (PEEQ, true stress) from first yield on.
    Raises ValueError for a name or a unit that is not known."""
    if name not in metals():
        near = difflib.get_close_matches(name, metals(), 1)
        said = f"did you mean {near[0]}? Materials" if near else "materials"
        raise ValueError(f"is not a known material; {said} are {', '.join(metals())}")
    if unit not in _PER_MPA:
        raise ValueError(f"needs a units.stress that is one of {', '.join(_PER_MPA)}, not {unit}")
    found = metals()[name]
    scale = _PER_MPA[unit]
    scaled = {key: scale * found[key] for key in ("E", "yield", "tensile")}
    points = [[peeq, scale * stress] for peeq, stress in found["hardening"]]
    return scaled | {"nu": found["nu"], "hardening": points}


def named_material(name: str, unit: str) -> J2Material:
    """The metal ``name`` in a ``unit`` of stress, with its hardening from first yield on, in plane
    strain. Raises ValueError as `metal`."""
    from archord.materials.hardening import TabularHardening
    from archord.materials.j2 import J2Material

    found = metal(name, unit)
    points = tuple((peeq, stress) for peeq, stress in found["hardening"])
    return J2Material(found["E"], found["nu"], "strain", TabularHardening(points))

"""The cases of the stability benchmark, read from ``cases.toml``: a joint each, and what it must give.

A case names what its numbers must agree with: a closed form; another case of the same run that gets there another way
(other units, other steps, the other control); or the same joint on a fine mesh, stored in ``fine.json``, which
``python3 -m archord.benchmarks.stability.fine`` writes.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from archord.benchmarks.case import Case, Expected, paper_joint
from archord.benchmarks.persson import persson_joint, theory
from archord.scene.scene import Scene

FINE = "fine"  # an expected value that is the same case's on a fine mesh (see `fine_scene`)
_COARSE, _STEPS = 0.1, 4
_WITHIN = 0.005  # of the value on a fine mesh


def cases() -> dict[str, Case]:
    """All cases by name, in the order of the table."""
    groups = tomllib.loads(Path(__file__).with_name("cases.toml").read_text(encoding="utf-8"))
    return {name: _case(name, group, keys) for group, table in groups.items() for name, keys in table.items()}


def _case(name: str, group: str, keys: dict[str, Any]) -> Case:
    limits = {key: keys.pop(key) for key in ("stops", "warns", "budget") if key in keys}
    expected = _expected(keys, bool(limits.get("stops")))
    return Case(name, _scene(keys), group, expected, **limits)


def _expected(keys: dict[str, Any], stops: bool) -> tuple[Expected, ...]:
    """What a case must give, by the ``keys`` that say so, which are taken out."""
    quantities, like, value, fine = (keys.pop(key, None) for key in ("of", "like", "value", "fine"))
    if "persson" in keys and not (like or fine):
        eps, peak = theory(keys["persson"])
        known = Expected("eps", eps, 0.02, "Ciavarella and Decuzzi 2001")
        return Expected("p0/P", peak, 0.01, "Persson 1964"), known
    if stops and not (like or fine):
        return ()
    said = like or value or (FINE, fine or _WITHIN, "fine mesh")
    return tuple(Expected(quantity, *said) for quantity in quantities or ["P/(E* R)"])


def _scene(keys: dict[str, Any]) -> Scene:
    """The joint that the rest of the ``keys`` of a case describe."""
    size, steps = keys.pop("size", _COARSE), keys.pop("steps", _STEPS)
    strength, load, both = keys.pop("yield_stress", None), keys.pop("persson", None), keys.pop("both", None)
    if "ratio" in keys or "nu" in keys:
        ratio, nu = keys.pop("ratio", 1.0), keys.pop("nu", 0.3)
        E = (1 - nu**2) * (1 + 1 / ratio)
        keys = {"pin": {"E": ratio * E, "nu": nu}, "block": {"E": E, "nu": nu} | keys.pop("block", {}), **keys}
    if both:
        keys |= {"pin": both, "block": both}
    if "relative_force" in keys.get("load", {}):
        keys["load"] = {"displacement": None, **keys["load"]}
    if load is not None:
        return persson_joint(load, size, steps, **keys)
    return paper_joint(size, steps, strength, **keys)

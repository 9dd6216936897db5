"""The cases of the stability benchmark: joints read from ``cases.toml``, general scenes from
``problems.toml`` and ``space.toml``, whose blocks are drawn here; and what each must give.

A case names what its numbers must agree with: a closed form; another case of the same run that gets
there another way (other units, other steps, the other control); or the same joint on a fine mesh,
stored in ``fine.json``, which ``python3 -m archord.benchmarks.stability.cases`` completes: it
solves what is missing there.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from archord.benchmarks.case import Case, Expected, paper_joint, varied
from archord.benchmarks.persson import persson_joint, theory
from archord.benchmarks.stability.eye import drawn_eye
from archord.presets.views import view_of
from archord.report.by_name import Amounts, ByName
from archord.report.files import read_json, toml_beside
from archord.scene.file import AnyScene, parse_any
from archord.scene.presets.joint import Scene

Values = dict[str, Amounts]  # by case and quantity
FILE = Path(__file__).with_name("fine.json")
FINE = "fine"  # an expected value that is the same case's on a fine mesh (see `fine_scene`)
_COARSE = 0.1
_STEPS = 4
_WITHIN = 0.005  # of the value on a fine mesh
_SIZE = 0.025  # element size over R of fine meshes
_TINY = 0.0025  # and of those where a few elements of 10 %R touch
_TINY_LOAD = 0.02  # delta/dR up to which the contact is tiny


def cases() -> dict[str, Case]:
    """All cases by name, in the order of the table."""
    found = {}
    for group, table in toml_beside(__file__, "cases.toml").items():
        for name, keys in table.items():
            found[name] = _case(name, group, keys, _joint, "P/(E* R)")  # compared by default
    for file in ("problems.toml", "space.toml"):
        problems = toml_beside(__file__, file)
        bases = problems.pop("base")
        for group, table in problems.items():
            for name, keys in table.items():
                base = bases[keys.pop("base", group)]
                merged = _merged(base, keys)
                found[name] = _case(name, group, merged, _problem, "")
    return found


def _merged(base: Any, keys: Any) -> Any:
    """``base`` with ``keys`` on top, table by table; None where a key is "none"."""
    if not (isinstance(base, dict) and isinstance(keys, dict)):
        return keys
    both = base | {name: _merged(base.get(name), value) for name, value in keys.items()}
    return {name: value for name, value in both.items() if value != "none"}


def _case(
    name: str, group: str, keys: ByName, scene: Callable[[Any], AnyScene], default: str
) -> Case:
    limits = {key: keys.pop(key) for key in ("stops", "warns", "budget") if key in keys}
    expected = _expected(keys, bool(limits.get("stops")), default)
    return Case(name, scene(keys), group, expected, **limits)


def _expected(keys: ByName, stops: bool, default: str) -> tuple[Expected, ...]:
    """What a case must give, by the ``keys`` that say so, which are taken out."""
    of, like, value, fine = (keys.pop(key, None) for key in ("of", "like", "value", "fine"))
    if "persson" in keys and not (like or fine):
        eps, peak = theory(keys["persson"])
        known = Expected("eps", eps, 0.02, "Ciavarella and Decuzzi 2001")
        return Expected("p0/P", peak, 0.01, "Persson 1964"), known
    if (stops or not default) and not (like or value or fine):
        return ()
    said = like or value or (FINE, fine or _WITHIN, "fine mesh")
    return tuple(Expected(quantity, *said) for quantity in of or [default or "pull force"])


def _joint(keys: ByName) -> Scene:
    """The joint that the rest of the ``keys`` of a case describe."""
    size = keys.pop("size", _COARSE)
    steps = keys.pop("steps", _STEPS)
    strength = keys.pop("yield_stress", None)
    load = keys.pop("persson", None)
    both = keys.pop("both", None)
    if "ratio" in keys or "nu" in keys:
        ratio = keys.pop("ratio", 1.0)
        nu = keys.pop("nu", 0.3)
        E = (1 - nu**2) * (1 + 1 / ratio)
        keys = {
            "pin": {"E": ratio * E, "nu": nu},
            "block": {"E": E, "nu": nu} | keys.pop("block", {}),
            **keys,
        }
    if both:
        keys |= {"pin": both, "block": both}
    if "relative_force" in keys.get("load", {}):
        keys["load"] = {"displacement": None, **keys["load"]}
    if load is not None:
        return persson_joint(load, size, steps, **keys)
    return paper_joint(size, steps, strength, **keys)


def _problem(keys: ByName) -> AnyScene:
    """The scene of a case's ``keys``, its ``blocks`` or its ``eye``, if there is one, drawn as a
    mesh file."""
    load = keys["load"]
    if cycles := keys.pop("cycles", None):
        load |= {name: value * cycles for name, value in load.items() if isinstance(value, list)}
    if blocks := keys.pop("blocks", None):
        drawn = _drawn(json.dumps(blocks), keys.pop("triangles", False))
        keys["mesh"] = keys.get("mesh", {}) | {"file": str(drawn)}
    if edges := keys.pop("eye", None):
        keys["mesh"] = {"file": str(drawn_eye(edges))}
    return parse_any(keys)


@cache
def _drawn(blocks: str, triangles: bool) -> Path:
    """An .inp file of ``blocks`` by name: ranges x0, y0, x1, y1, and numbers of quadrilaterals
    across and up, which ``triangles`` cut in two; x and y are radius and angle (times pi) with a 1
    behind. Sets: "NAME left" and so on."""
    file = Path(tempfile.mkdtemp()) / "blocks.inp"
    start = 1
    with file.open("wb") as out:
        for name, (x0, y0, x1, y1, n, m, *polar) in json.loads(blocks).items():
            across = np.linspace(x0, x1, n + 1)
            up = np.linspace(y0, y1, m + 1)
            x, y = np.meshgrid(across, up)
            if polar:
                radius = x
                x = radius * np.cos(np.pi * y)
                y = radius * np.sin(np.pi * y)
            ids = start + np.arange(x.size).reshape(x.shape)
            lower = ids[:-1]
            upper = ids[1:]
            corners = [lower[:, :-1], lower[:, 1:], upper[:, 1:], upper[:, :-1]]
            cells = np.stack(corners, axis=2).reshape(-1, 4)
            if triangles:
                cells = np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
            nodes = np.column_stack([ids.ravel(), x.ravel(), y.ravel()])
            numbers = start + np.arange(len(cells))
            elements = np.column_stack([numbers, cells])
            rows = {
                "*NODE": nodes,
                f"*ELEMENT, TYPE=CPE{cells.shape[1]}, ELSET={name}": elements,
                f"*NSET, NSET={name} left": ids[:, 0],
                f"*NSET, NSET={name} right": ids[:, -1],
                f"*NSET, NSET={name} bottom": ids[0],
                f"*NSET, NSET={name} top": ids[-1],
            }
            for heading, values in rows.items():
                out.write(f"{heading}\n".encode())
                np.savetxt(out, values, "%.15g", ", ")
            start += max(x.size, len(cells))
    return file


def fine_scene(scene: Any) -> Scene:
    """The joint of ``scene`` with equal elements of 2.5 %R (0.25 %R for tiny contacts) or half as
    large, the default gamma factor and, if it can yield, at least 20 and at least twice as many
    steps."""
    given = scene.joint
    tiny = not scene.force_controlled and 0 < max(scene.targets) <= _TINY_LOAD * given.dR
    size = _SIZE
    if tiny:
        size = _TINY
    elif given.size_ratio == 1:
        size = min(_SIZE, given.h / given.radius / 2)
    joint = {"element_size": None, "relative_element_size": size, "size_ratio": None}
    if tiny:
        joint["growth"] = 1.0
    load = {}
    if scene.plastic:
        load["steps"] = [max(20, 2 * n) for n in scene.load.stage_steps]
    return varied(scene, joint=joint, analysis={"gamma_factor": None}, load=load)


def main() -> None:
    """Solve the joints that `FILE` lacks on fine meshes, and write after each. Raises RuntimeError
    if a run stops."""
    known = cases()
    values = read_json(FILE)
    for name, case in known.items():
        needs_fine = any(expected.value == FINE for expected in case.expected)
        if needs_fine and name not in values:
            fine = replace(case, scene=fine_scene(case.scene))
            with tempfile.TemporaryDirectory() as folder:
                last = fine.solve(Path(folder)).steps[-1]
            values[name] = view_of(fine.scene).quantities(last)
            print(f"{case.group}: {name}: {values[name]}", flush=True)
            kept = {other: values[other] for other in known if other in values}
            FILE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""The general scenes of the stability benchmark, read from ``problems.toml``: presets, and blocks drawn here."""

from __future__ import annotations

import json
import tomllib
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

from archord.scene.file import AnyScene, parse_any

Groups = dict[str, dict[str, dict[str, Any]]]


def groups() -> Groups:
    """The keys of all cases by group and name, on top of those of their ``base``."""
    table = tomllib.loads(Path(__file__).with_name("problems.toml").read_text(encoding="utf-8"))
    bases = table.pop("base")
    return {
        group: {name: _merged(bases[keys.pop("base", group)], keys) for name, keys in cases.items()}
        for group, cases in table.items()
    }


def _merged(base: Any, keys: Any) -> Any:
    """``base`` with ``keys`` on top, table by table; None where a key is "none"."""
    if not (isinstance(base, dict) and isinstance(keys, dict)):
        return keys
    both = base | {name: _merged(base.get(name), value) for name, value in keys.items()}
    return {name: value for name, value in both.items() if value != "none"}


def problem_scene(keys: dict[str, Any]) -> AnyScene:
    """The scene of a case's ``keys``, its ``blocks``, if there are any, drawn as a mesh file."""
    load = keys["load"]
    if cycles := keys.pop("cycles", None):
        load |= {name: value * cycles for name, value in load.items() if isinstance(value, list)}
    if blocks := keys.pop("blocks", None):
        keys["mesh"] = keys.get("mesh", {}) | {"file": str(_drawn(json.dumps(blocks), keys.pop("triangles", False)))}
    return parse_any(keys)


@cache
def _drawn(blocks: str, triangles: bool) -> Path:
    """An .inp file of ``blocks`` by name: ranges x0, y0, x1, y1, and numbers of quadrilaterals across and up, which
    ``triangles`` cut in two; x and y are radius and angle (times pi) with a 1 behind. Sets: "NAME left" and so on."""
    file, start = Path(mkdtemp()) / "blocks.inp", 1
    with file.open("w", encoding="utf-8") as out:
        for name, (x0, y0, x1, y1, n, m, *polar) in json.loads(blocks).items():
            x, y = np.meshgrid(np.linspace(x0, x1, n + 1), np.linspace(y0, y1, m + 1))
            if polar:
                x, y = x * np.cos(np.pi * y), x * np.sin(np.pi * y)
            ids = start + np.arange(x.size).reshape(x.shape)
            quads = np.stack([ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]], axis=2).reshape(-1, 4)
            cells = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]) if triangles else quads
            blocks_of = {"*NODE": np.column_stack([ids.ravel(), x.ravel(), y.ravel()])}
            blocks_of[f"*ELEMENT, TYPE=CPE{cells.shape[1]}, ELSET={name}"] = np.column_stack(
                [start + np.arange(len(cells)), cells]
            )
            sides = {"left": ids[:, 0], "right": ids[:, -1], "bottom": ids[0], "top": ids[-1]}
            blocks_of |= {f"*NSET, NSET={name} {side}": nodes[:, None] for side, nodes in sides.items()}
            for heading, rows in blocks_of.items():
                out.write(f"{heading}\n" + "".join(", ".join(f"{v:.15g}" for v in row) + "\n" for row in rows))
            start += max(x.size, len(cells))
    return file

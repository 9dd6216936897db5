"""Which plane stands for a joint of a thickness? Force and peak pressure in space over both planes:
``python3 -m archord.benchmarks.space.planes``.

The block of the paper's joint yields without hardening; pin and block are equally thick. On meshes
of half the element size elastic forces are the same to 0.05 %, the others up to 0.6 % lower, at the
last load of the thinnest joint 1.4 %; peak pressures are up to 2.5 % lower.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from mpi4py import MPI

from archord.measures.record import Record
from archord.output.run import solve_scene
from archord.report.by_name import ByName
from archord.report.table import Table
from archord.scene.file import parse_any

THICKNESSES = (0.2, 0.5, 1.0, 2.0, 4.0)  # over R
_RADIUS = 10.0
_STEPS = (1, 2, 4)  # of the four whose loads stand in the table
STEEL = {"E": 210000.0, "nu": 0.3}
JOINT = {
    "radius": _RADIUS,
    "clearance": 0.05,
    "block_size": 40.0,
    "relative_element_size": 0.15,
    "growth": 0.35,
}
_SCENE = {
    "joint": JOINT,
    "pin": STEEL,
    "block": STEEL | {"yield_stress": 300.0},
    "load": {"displacement": 3.2, "steps": 4},  # in clearances
    "output": {"fields": False},
}


def solved(changes: ByName) -> Sequence[Record]:
    """The steps of the joint with ``changes`` of its sections."""
    with tempfile.TemporaryDirectory() as folder:
        run = solve_scene(parse_any(_SCENE | changes), Path(folder), MPI.COMM_SELF)
    return run.steps


def table_of(thicknesses: Sequence[float]) -> Table:
    """Forces and peak pressures in space over those of plane stress and of plane strain."""
    fine = JOINT | {"relative_element_size": 0.05, "growth": 0.2}
    planes = [
        solved({"joint": fine, "analysis": {"plane": plane}}) for plane in ("stress", "strain")
    ]
    over = [f"{what}/{plane} {{:.3f}}" for what in ("P", "p0") for plane in ("stress", "strain")]
    table = Table("t/R {:g}", "delta/dR {:g}", *over, "rim/p0 {:.3f}")
    for ratio in thicknesses:
        thickness = ratio * _RADIUS
        solid = solved({"space": {"thickness": thickness, "rim_ratio": 1.0}})
        for step in _STEPS:
            found = solid[step - 1]
            flat = [plane[step - 1] for plane in planes]
            forces = [found["P"] / thickness / plane["P"] for plane in flat]
            peaks = [found["p0"] / plane["p0"] for plane in flat]
            rim = found["rim pressure"] / found["p0"]
            moved = 3.2 * step / len(solid)
            table.add(ratio, moved, *forces, *peaks, rim)
    return table


if __name__ == "__main__":
    print(table_of(THICKNESSES).markdown())

"""Runs against the first of them: their curves at common loads, and what differs in their scenes.

Of joints P, p0 and eps over the displacement, or where forces load all of them delta, p0 and eps
over the force; of general runs the quantities that all of them have over the load factor. Runs that
were led through the same loads are compared step by step, unloading included. Of others the first
loading counts, the steps before the pin first goes back, at those loads of the first run that all
reach; between their steps the others are interpolated by monotone cubics (Fritsch and Carlson
1980).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from archord.materials.material import Array
from archord.postprocess.curve import first_loading, gap_name
from archord.postprocess.run import Run
from archord.scene.errors import InputError
from archord.scene.file import scene_keys

COMPARED = ("P", "p0", "eps")
COMMON = (
    " force",
    " displacement",
    " largest pressure",
    " peeq_max",
)  # ends of what general runs are compared by
_SAME = 1e-9  # relative difference up to which loads, or sizes of the joint, are the same
_NOTHING = 1e-9  # part of the largest value below which a relative difference says nothing


@dataclass(frozen=True)
class Comparison:
    """``r`` runs at ``n`` common loads."""

    runs: list[Run]
    labels: dict[str, str]  # of "load" and of the quantities
    step_by_step: bool
    load: Array  # (n,)
    values: dict[str, Array]  # (r, n)
    interpolated: np.ndarray  # (r, n) whether the values lie between steps

    def relative(self, name: str) -> Array:
        """``value/first - 1`` ``(r, n)``; NaN where the first is nothing beside its largest value
        and the other is not."""
        values = self.values[name]
        first, nothing = values[0], _NOTHING * np.abs(values).max(initial=0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = (values - first) / np.abs(first)
        unknown = np.where(np.abs(values - first) <= nothing, 0.0, np.nan)
        return np.where(np.abs(first) > nothing, relative, unknown)


def compare_runs(runs: list[Run]) -> Comparison:
    """Compare ``runs`` with the first. Raises `InputError` for fewer than two, one without steps,
    or no common load."""
    if len(runs) < 2:
        raise InputError("compare: needs two runs or more.")
    tables, labels, _ = curves_of(runs)
    load = tables[0]["load"]
    margin = _SAME * np.abs(load).max()
    alike = [
        len(t["load"]) == len(load) and np.allclose(t["load"], load, rtol=0, atol=margin)
        for t in tables
    ]
    between: np.ndarray = np.zeros((len(runs), len(load)), dtype=bool)
    if not all(alike):
        tables = [
            {name: values[first_loading(t["load"])] for name, values in t.items()} for t in tables
        ]
        low, high = max(t["load"][0] for t in tables), min(t["load"][-1] for t in tables)
        load = tables[0]["load"]
        load = load[(load >= low - margin) & (load <= high + margin)]
        if not len(load):
            raise InputError(f"{runs[0].folder}: shares no range of loads with the others.")
        between = np.array([np.abs(load[:, None] - t["load"]).min(axis=1) > margin for t in tables])
        tables = [_at(load, table, k) for table, k in zip(tables, between, strict=True)]
    values = {
        name: np.array([table[name] for table in tables]) for name in labels if name != "load"
    }
    return Comparison(runs, labels, all(alike), load, values, between)


def curves_of(runs: Sequence[Run]) -> tuple[list[dict[str, Array]], dict[str, str], Array]:
    """What is compared of each run over its "load", ``(n,)`` by name; their labels; and what
    pressures are divided by.

    Of joints P (delta, where forces load all of them), p0 and eps, as they are where the units, R,
    dR and E* of all are the same, else over powers of E*, R and the clearance. Raises `InputError`
    for general runs without a common quantity or unit.
    """
    units = [run.scene.units for run in runs]
    if not any(run.is_joint for run in runs):
        first, columns = runs[0], [set(run.columns) for run in runs]
        shared = set.intersection(*columns) - {
            f"{load.name} {load.kind}" for load in first.scene.load
        }
        names = [name for name in first.columns if name.endswith(COMMON) and name in shared]
        for run in runs:
            run.number(None)
            if any(run.units.get(name) != first.units.get(name) for name in names):
                raise InputError(f"{run.folder}: has other units than {first.folder}.")
        if not names:
            raise InputError(f"{first.folder}: shares no load with the others.")
        tables = [
            {"load": np.array(run.path)} | {name: np.array(run.columns[name]) for name in names}
            for run in runs
        ]
        return (
            tables,
            {"load": "load factor"} | {name: first.heading(name) for name in names},
            np.ones(len(runs)),
        )
    curves = [run.curve for run in runs]
    sizes = np.array([[curve.R, curve.dR, curve.E_star] for curve in curves])
    if all(unit == units[0] for unit in units) and np.allclose(sizes, sizes[0], rtol=_SAME, atol=0):
        one, per = units[0], np.ones((len(runs), 3))
        labels = {
            "delta": f"delta [{one.length}]",
            "P": f"P [{one.force_of(None)}]",
            "p0": f"p0 [{one.stress}]",
        }
    else:
        gap = gap_name(min(curve.dR for curve in curves))
        labels = {"delta": f"delta/{gap}", "P": f"P/(E* {gap})", "p0": f"p0 R/(E* {gap})"}
        R, dR, E_star = np.abs(sizes).T
        per = np.stack([dR, E_star * dR, E_star * dR / R], axis=1)
    load = "P" if all(run.scene.force_controlled for run in runs) else "delta"
    labels = {"load": labels.pop(load)} | labels | {"eps": "eps [rad]"}
    tables = []
    for c, row in zip(curves, per, strict=True):
        scaled = {"delta": c.delta / row[0], "P": c.P / row[1], "p0": c.p0 / row[2], "eps": c.eps}
        tables.append({"load" if name == load else name: values for name, values in scaled.items()})
    return tables, labels, per[:, 2]


def _at(load: Array, table: dict[str, Array], between: np.ndarray) -> dict[str, Array]:
    """The first loading of a run at ``load`` ``(n,)``; interpolated where that lies ``between`` its
    own loads."""
    own = table["load"]
    found = {
        name: values[np.abs(load[:, None] - own).argmin(axis=1)] for name, values in table.items()
    }
    if between.any():
        from scipy.interpolate import PchipInterpolator

        for name, values in table.items():
            found[name][between] = PchipInterpolator(own, values)(load[between])
    return found


def differing_keys(scenes: Sequence[Any]) -> dict[str, list[str]]:
    """Keys in which the ``scenes`` differ, and their values as TOML writes them; empty where a
    scene has none."""
    tables = [scene_keys(scene) for scene in scenes]
    names = list(dict.fromkeys(name for table in tables for name in table))
    rows = {
        name: [json.dumps(t[name], ensure_ascii=False) if name in t else "" for t in tables]
        for name in names
    }
    return {name: values for name, values in rows.items() if len(set(values)) > 1}

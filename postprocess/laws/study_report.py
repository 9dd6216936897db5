"""The fit of a sweep for people and programs: its cases, the errors of the model, JSON, and a picture."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np

from archord.output.user_file import writing
from archord.postprocess.laws.calibrated import CalibratedModel, Points
from archord.postprocess.laws.study import COLUMNS, KINDS, Cases, Errors, known, of_kind, predictions
from archord.report.figure import new_figure, save
from archord.report.table import Table

JSON_BEGINS = '{\n "from": {\n  "archord": '  # by which a file of `as_json` is known
_YIELDS = {"none": "none (elastic)", "block": "block alone"}
_SHOWN = {"ratio": ".4g", "pin_nu": ".4g", "nu": ".4g", "clearance": ".4g", "strength": ".4g"}  # with their formats


def case_table(cases: Cases) -> Table:
    """One row per case: what decides it, k and c with their errors, the plateau's median pressure over sigY, and rms
    and largest of ``law/run - 1``."""
    shown = dict(_SHOWN)
    for name in "kc":
        shown |= {name: ".4f", f"{name}_error": ".1e"}
        shown |= {f"{name}_mesh": ".1e"} if cases.k_mesh.notna().any() else {}
    shown |= {"plateau": ".3f", "rms": ".1%", "largest": "+.1%"}
    columns = [[format(value, form) if math.isfinite(value) else "-" for value in cases[name]]
               for name, form in shown.items()]  # fmt: skip
    headings = ("plane", "yields", *(COLUMNS[name] for name in shown))
    return Table("run", *headings, rows=zip(cases.run, cases.plane, cases.yielding, *columns, strict=True))


def error_table(errors: dict[str, Errors]) -> Table:
    """A row for each kind of joint in ``errors``, by what they are the errors of."""
    table = Table("law", "plane", "yields", "cases", "k rms", "k largest", "c rms", "c largest", "P rms", "P largest",
                  "own k, c: P rms", "P early rms")  # fmt: skip
    shown = [(name, what) for name in ("k", "c", "P") for what in ("rms", "largest")]
    shown += [("P own", "rms"), ("P early", "rms")]
    forms = {"rms": ".1%", "largest": "+.1%"}
    for law, kinds in errors.items():
        for kind, found in kinds.items():
            plane, yielding = kind.split()
            cells = [format(found[name][what], forms[what]) if found.get(name) else "-" for name, what in shown]
            table.add(law, plane, _YIELDS.get(yielding, yielding), found["cases"], *cells)
    return table


def as_json(cases: Cases, notes: dict[str, str], left_out: list[tuple[str, str]], model: CalibratedModel | None) -> str:
    """Everything as JSON; what is not a finite number is null."""
    data = {
        "from": notes,
        "cases": json.loads(cases[[*COLUMNS, "s"]].to_json(orient="records", double_precision=15)),
        "left_out": [{"run": name, "reason": reason} for name, reason in left_out],
        "model": model and model.data,
    }
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def draw_study(cases: Cases, model: CalibratedModel, target: Path) -> Path:
    """Draw the elastic k over Poisson's ratio, k and c over the onset of yielding, and the model against the cases, as
    ``target``; returns the file. Raises ValueError for an unknown format."""
    figure = new_figure(11, 8.4)
    elastic, late, threshold, parity = figure.subplots(2, 2).flat
    cases = known(model, cases)
    k, c = predictions(model, cases)
    for i, kind in enumerate(KINDS):
        same, style = of_kind(cases, kind), {"ms": 4, "mfc": "none", "color": f"C{i}", "label": " ".join(kind)}
        if kind[1] == "none":
            elastic.plot(same.nu, same.k, "o", **style)
        else:
            k_elastic = model.elastic_k(Points.of(same))
            late.plot(same.s / k_elastic, same.k / k_elastic, "o", **style)
            threshold.plot(same.s, same.clear_c, "o", **style)
    nu = np.linspace(0, 0.49, 60)
    for alpha, words in ((0.0, "like bodies"), (1.0, "rigid pin")):
        joints = {"plane": "strain", "alpha": alpha, "pin_nu": math.nan, "nu": nu, "s": math.inf, "clearance": 0.005}
        elastic.plot(nu, model.elastic_k(Points.of(joints)), color="black", ls="-" if alpha else "--", lw=1,
                     label=f"model: strain, {words}")  # fmt: skip
    parity.plot(cases.k, k, ".", ms=4, label="k")
    parity.plot(cases.clear_c, np.where(np.isfinite(c), c, np.nan), ".", ms=4, label="c")
    parity.axline((1, 1), slope=1, color="black", lw=0.8)
    elastic.set(xlabel="ν of the block", ylabel="k, elastic")
    late.set(xlabel="s / k of the elastic joint, s = sigY R/(E* ΔR)", ylabel="k / k of the elastic joint", xscale="log")
    threshold.set(xlabel="s = sigY R/(E* ΔR)", ylabel="c", xscale="log")
    parity.set(xlabel="of the case itself", ylabel="of the model")
    for axis in figure.axes:
        axis.grid(alpha=0.3)
        axis.legend(frameon=False, fontsize="x-small")
    with writing(target):
        return save(figure, target)

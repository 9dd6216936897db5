"""The fit of a sweep for people and programs: its cases, the model with its coefficients, the errors, and a picture."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from archord.output.user_file import writing
from archord.postprocess.laws.calibrated import SOFT, CalibratedModel, Points
from archord.postprocess.laws.study import COLUMNS, KINDS, PLANES, Cases, Row, Study, known, of_kind, predictions
from archord.report.figure import new_figure, save
from archord.report.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from archord.postprocess.laws.joint import Array

PAPER_K = 0.85
_YIELDS = {"none": "none (elastic)", "block": "block alone"}
_COLORS = dict(zip([kind for kind in KINDS if kind[1] != "none"], ("C0", "C1", "C2", "C4"), strict=True))
_STYLES = {"strain": ("o", "-"), "stress": ("s", "--")}  # of points and lines
_ALIKE = 0.01


def case_table(numbers: Iterable[int], cases: Cases, varied: dict[str, list[str]]) -> Table:
    """One row per case: number, what is ``varied`` (a column by heading), k and c with their errors, the plateau's
    median pressure over sigY, and rms and largest of ``law/run - 1``."""
    errors = {"_error": "s.e."} | ({"_mesh": "mesh"} if cases.k_mesh.notna().any() else {})
    columns: dict[str, str] = {}
    for name in "kc":
        columns |= {name: ".4f"} | {name + error: ".1e" for error in errors}
    columns["plateau"] = ".3f"
    fitted = [["-" if math.isnan(value) else format(value, form) for value in cases[name]]
              for name, form in columns.items()]  # fmt: skip
    quality = [f"{value:.1%}" for value in cases.rms], [f"{value:+.1%}" for value in cases.largest]
    headings = (*varied, "k", *errors.values(), "c", *errors.values(), "plateau", "rms", "largest")
    return Table("case", *headings, rows=zip(numbers, *varied.values(), *fitted, *quality, strict=True))


def numbers_of(cases: Cases) -> dict[str, list[str]]:
    """What decides each case, as columns of `case_table` where nothing else is known to vary."""
    shown = {"plane": list(cases.plane), "yields": list(cases.yielding), "E1/E2": [f"{x:.4g}" for x in cases.ratio]}
    for name in ("pin_nu", "nu", "clearance", "strength"):
        shown[COLUMNS[name]] = [f"{value:.4g}" if math.isfinite(value) else "-" for value in cases[name]]
    return shown


def model_text(study: Study, total: int) -> str:
    """The model with its numbers, ready to be typed, of ``total`` cases; its errors, beside those of simpler forms; and
    where they are largest."""
    cases = pd.concat([study.used, study.held]).set_index("run")
    worst = (_worst(*row, cases) for row in study.rows)
    used, held = len(study.used), len(study.held)
    return "\n".join([
        f"model: {study.model.numbers} coefficients from {used} of {total} cases; {held} held out until the end\n",
        *(f"    {line}" for line in _formulas(study.model)),
        "",
        error_table(study.rows).markdown(),
        error_table(study.simpler).markdown(),
        *worst,
    ])  # fmt: skip


def _formulas(model: CalibratedModel) -> list[str]:
    form = model.data["form"]
    lines = [f"1/k_e = {_sum(form['elastic'], model.data['elastic'])}"]
    for part in model.data["plastic"]:
        lines.append(f"plane {part['plane']}, {'block alone yields' if part['yielding'] == 'block' else 'both yield'}:")
        if part["late"]:
            lines.append(f"  ln(k/k_e) = exp(-{part['rate']:g} s/k_e) ({_sum(form['late'], part['late'])})")
        lines.append(f"  ln c = {_sum(form[part['plane']], part['threshold'])}")
    return lines


def _sum(terms: list[str], values: list[float]) -> str:
    said = ""
    for term, value in zip(terms, values, strict=True):
        sign, factors = "-" if value < 0 else "+", "" if term == "1" else " " + " ".join(term)
        said += f" {sign} {abs(value):g}{factors}"
    return said.removeprefix(" + ").strip()


def error_table(rows: Iterable[Row]) -> Table:
    """Of each row what the numbers are, plane, what yields, and a summary of `Errors`."""
    table = Table("law", "plane", "yields", "cases", "k rms", "k largest", "c rms", "c largest", "P rms", "P largest",
                  "own k, c: P rms", "P early rms")  # fmt: skip
    for law, plane, yielding, found in rows:
        cells = [_of(found, name, what) for name in ("k", "c", "P") for what in ("rms", "largest")]
        own = [_of(found, "P own", "rms"), _of(found, "P early", "rms")]
        table.add(law, plane, _YIELDS.get(yielding, yielding), found["cases"], *cells, *own)
    return table


def _of(found: dict[str, Any], name: str, what: str) -> str:
    if not found.get(name):
        return "-"
    return f"{found[name][what]:.1%}" if what == "rms" else f"{found[name][what]:+.1%}"


def _worst(what: str, plane: str, yielding: str, found: dict[str, Any], cases: Cases) -> str:
    kind, said = "" if yielding == "all" else f", plane {plane}, {yielding}", []
    for name in ("k", "c", "P"):
        if name in found:
            load = f" at {found[name]['delta/dR']:g} dR" if name == "P" else ""
            said.append(f"{name} {found[name]['largest']:+.1%}{load} ({_words(cases.loc[found[name]['case']])})")
    return f"largest {what}{kind}: {'; '.join(said)}"


def _words(case: pd.Series) -> str:
    pin = "rigid pin" if math.isnan(case.pin_nu) else f"E1/E2 = {case.ratio:.3g}, nu1 = {case.pin_nu:.3g}"
    s = "" if math.isinf(case.s) else f", sigY/E* = {case.strength:.3g}, s = {case.s:.3g}, {case.yielding}"
    return f"{case.name}: plane {case.plane}, {pin}, nu2 = {case.nu:.3g}, dR/R = {case.clearance:.3g}{s}"


JSON_BEGINS = '{\n "from": {\n  "archord": '  # by which a file of `as_json` is known


def as_json(cases: Cases, notes: dict[str, str], left_out: list[tuple[str, str]], model: CalibratedModel | None) -> str:
    """Everything as JSON; what is not a finite number is null."""
    data = {
        "from": notes,
        "cases": [{name: _plain(value) for name, value in case.items()}
                  for case in cases[[*COLUMNS, "s"]].to_dict("records")],
        "left_out": [{"run": name, "reason": reason} for name, reason in left_out],
        "model": model and model.data,
    }  # fmt: skip
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def draw_study(cases: Cases, model: CalibratedModel | None, target: str | Path) -> Path:
    """Draw k against Poisson's ratio, moduli and the onset of yielding, c against sigY/E* and dR/R, and the model
    against the cases, as ``target``; returns the file.

    Points are cases of like Poisson's ratios (k) or like bodies with nu = 0.3 (c), lines the model, where there is one.
    Raises ValueError for an unknown format.
    """
    target, figure = Path(target), new_figure(14.5, 8.4)
    axes = figure.subplots(2, 3)
    _elastic_k(axes[0, 0], axes[0, 1], cases[cases.yielding == "none"], model)
    alike = (abs(cases.alpha) < _ALIKE) & (abs(cases.nu - 0.3) < _ALIKE) & (abs(cases.pin_nu - 0.3) < _ALIKE)
    c_of = cases[alike & (cases.yielding == "both") & cases.clear_c.notna()]
    _threshold(axes[1, 0], c_of, model, "strength", "sigY / E*", "clearance", "ΔR/R", (0.001, 0.005, 0.02))
    _threshold(axes[1, 1], c_of, model, "clearance", "ΔR / R", "strength", "sigY/E*", (0.0005, 0.001, 0.002, 0.004))
    if model is not None:
        _onset(axes[0, 2], cases, model)
        _parity(axes[1, 2], known(model, cases), model)
    for axis in axes.flat:
        if not axis.lines:  # a sweep need not have what belongs here
            axis.text(0.5, 0.5, "no such case", transform=axis.transAxes, ha="center", color="0.4")
        axis.grid(alpha=0.3)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(frameon=False, fontsize="x-small")
    with writing(target):
        return save(figure, target)


def _points(axis: Axes, cases: Cases, x: str, y: str, color: str) -> None:
    for plane, (marker, _) in _STYLES.items():
        same = cases[cases.plane == plane]
        if len(same):
            axis.plot(same[x], same[y], marker, ms=4, mfc="none", color=color)


def _line(
    axis: Axes, x: Array, model: CalibratedModel | None, plane: str, color: str, said: str, **numbers: Any
) -> None:
    """c of the model where both bodies yield, k without ``s``, for joints of these ``numbers`` and one Poisson's ratio,
    where there is a model and it holds; named in plane strain."""
    if model is None:
        return
    joints = {"plane": plane, "alpha": 0.0, "nu": 0.3, "s": math.inf, "clearance": 0.005, "pin_nu": math.nan} | numbers
    points = Points.of(joints)
    k, c = model.coefficients((plane, "both" if "s" in numbers else "none"), points)
    values = np.where((1 - points.alpha) / 2 * points.m > SOFT, np.nan, c if "s" in numbers else k)
    axis.plot(x, values, ls=_STYLES[plane][1], lw=1, color=color, label=said if plane == "strain" else None)


def _elastic_k(by_nu: Axes, by_moduli: Axes, cases: Cases, model: CalibratedModel | None) -> None:
    nu, alpha = np.linspace(0, 0.49, 60), np.linspace(-0.5, 0.98, 80)
    alike = cases[cases.pin_nu.isna() | (abs(cases.pin_nu - cases.nu) < 1e-6)]
    pins = {-0.5: "pin 3 times softer", 0.0: "like bodies", 0.5: "pin 3 times stiffer", 1.0: "rigid pin"}
    for i, (ratio, words) in enumerate(pins.items()):
        _points(by_nu, alike[abs(alike.alpha - ratio) < _ALIKE], "nu", "k", f"C{i}")
        for plane in PLANES:
            _line(by_nu, nu, model, plane, f"C{i}", words, alpha=ratio, nu=nu)
    for i, value in enumerate((0.0, 0.3, 0.49)):
        _points(by_moduli, alike[(abs(alike.nu - value) < 1e-3) & (alike.alpha < 1)], "ratio", "k", f"C{i}")
        for plane in PLANES:
            x = (1 + alpha) / (1 - alpha)
            _line(by_moduli, x, model, plane, f"C{i}", f"ν = {value:g}", alpha=alpha, nu=value)
    for axis in (by_nu, by_moduli):
        axis.axhline(PAPER_K, color="black", lw=0.8, label="k = 0.85")
        axis.set(ylabel="k, elastic", ylim=(0.4, 1.3))
    by_nu.set(xlabel="ν of both bodies", title="○ — plane strain, □ -- plane stress")
    by_moduli.set(xlabel="E of the pin / E of the block", xscale="log")


def _onset(axis: Axes, cases: Cases, model: CalibratedModel) -> None:
    for (plane, yielding), color in _COLORS.items():
        same = of_kind(cases, (plane, yielding))
        if len(same):
            k, label = model.elastic_k(Points.of(same)), f"plane {plane}, {yielding}"
            axis.plot(same.s / k, same.k / k, _STYLES[plane][0], ms=4, mfc="none", color=color, label=label)
    label = "s / k of the elastic joint,  s = sigY R/(E* ΔR)"
    axis.set(xlabel=label, ylabel="k / k of the elastic joint", xscale="log")


def _threshold(
    axis: Axes, cases: Cases, model: CalibratedModel | None, over: str, label: str, by: str, name: str,
    values: tuple[float, ...],
) -> None:  # fmt: skip
    """c of like bodies, nu = 0.3, over one of dR/R and sigY/E*, in the colour of the other."""
    _points(axis, cases, over, "c", "0.4")
    bounds = {plane: model.bounds((plane, "both")) for plane in PLANES} if model else {}
    for i, value in enumerate(values):
        _points(axis, cases[np.isclose(cases[by], value, rtol=0.02)], over, "c", f"C{i}")
        for plane, found in bounds.items():
            if found:
                s = np.geomspace(max(0.1, found["s"][0]), 1.2, 50)
                if over == "clearance":
                    s = s[(value / s >= 0.001) & (value / s <= 0.02)]
                x, said = s * value if over == "strength" else value / s, f"{name} = {value:.2%}"
                _line(axis, x, model, plane, f"C{i}", said, s=s, clearance=value)
    if axis.lines:
        axis.axhline(1, color="black", lw=0.8, label="c = 1")
    axis.set(xlabel=label, ylabel="c, like bodies, ν = 0.3", xscale="log")


def _parity(axis: Axes, cases: Cases, model: CalibratedModel) -> None:
    from matplotlib.ticker import FixedLocator, NullFormatter

    k, c = predictions(model, cases)
    axis.plot(cases.k, k, ".", ms=4, color="C0", label="k")
    axis.plot(cases.clear_c, np.where(np.isfinite(c), c, np.nan), ".", ms=4, color="C3", label="c")
    ends = np.array([0.3, 2.6])
    axis.plot(ends, ends, color="black", lw=0.8)
    axis.fill_between(ends, 0.95 * ends, 1.05 * ends, color="0.85", label="5 %")
    axis.set(xlabel="of the case itself", ylabel="of the model", xscale="log", yscale="log", xlim=ends, ylim=ends)
    for side in (axis.xaxis, axis.yaxis):  # over less than a decade matplotlib's own labels overlap
        side.set_major_locator(FixedLocator([0.3, 0.5, 1.0, 2.0]))
        side.set_major_formatter("{x:g}")
        side.set_minor_formatter(NullFormatter())

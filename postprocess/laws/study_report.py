"""The fit of a sweep for people and programs: its cases, the model with its coefficients, the errors, and a picture."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.output.user_file import writing
from archord.postprocess.laws.calibrated import SOFT, CalibratedModel, Points, equivalent
from archord.postprocess.laws.study import KINDS, PLANES, FittedCase, Row, Study, known, predictions
from archord.report.figure import new_figure, save
from archord.report.table import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from archord.geometry.basis import Array

PAPER_K = 0.85
_YIELDS = {"none": "none (elastic)", "block": "block alone"}
_COLORS = dict(zip([kind for kind in KINDS if kind[1] != "none"], ("C0", "C1", "C2", "C4"), strict=True))
_STYLES = {"strain": ("o", "-"), "stress": ("s", "--")}  # of points and lines
_ALIKE = 0.01


def case_table(numbers: list[int], cases: list[FittedCase], varied: dict[str, list[str]]) -> Table:
    """One row per case: number, what is ``varied`` (a column by heading), k and c with their errors, the plateau's
    median pressure over sigY, and rms and largest of ``law/run - 1``."""
    errors = {"_error": "s.e."}
    if any(math.isfinite(case.k_mesh) for case in cases):
        errors["_mesh"] = "mesh"
    table = Table("case", *varied, "k", *errors.values(), "c", *errors.values(), "plateau", "rms", "largest")
    forms = (
        {"k": ".4f"} | {f"k{kind}": ".1e" for kind in errors} | {"c": ".4f"} | {f"c{kind}": ".1e" for kind in errors}
    )
    for i, (number, case) in enumerate(zip(numbers, cases, strict=True)):
        values = [(getattr(case, name), form) for name, form in (forms | {"plateau": ".3f"}).items()]
        fitted = [format(value, form) if math.isfinite(value) else "-" for value, form in values]
        joint = [column[i] for column in varied.values()]
        table.add(number, *joint, *fitted, f"{case.rms:.1%}", f"{case.largest:+.1%}")
    return table


def numbers_of(cases: list[FittedCase]) -> dict[str, list[str]]:
    """What decides each case, as columns of `case_table` where nothing else is known to vary."""
    names = {"E1/E2": "ratio", "nu1": "pin_nu", "nu2": "nu", "dR/R": "clearance", "sigY/E*": "strength"}

    def said(name: str, value: float) -> str:
        return "-" if math.isnan(value) or (math.isinf(value) and name != "ratio") else f"{value:.4g}"

    columns = {heading: [said(name, getattr(case, name)) for case in cases] for heading, name in names.items()}
    return {"plane": [case.plane for case in cases], "yields": [case.yielding for case in cases]} | columns


def model_text(study: Study, total: int) -> str:
    """The model with its numbers, ready to be typed, of ``total`` cases; its errors, beside those of simpler forms; and
    where they are largest."""
    cases = {case.run: case for case in study.used + study.held}
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


def _worst(what: str, plane: str, yielding: str, found: dict[str, Any], cases: dict[str, FittedCase]) -> str:
    kind, said = "" if yielding == "all" else f", plane {plane}, {yielding}", []
    for name in ("k", "c", "P"):
        if name in found:
            load = f" at {found[name]['delta/dR']:g} dR" if name == "P" else ""
            said.append(f"{name} {found[name]['largest']:+.1%}{load} ({_words(cases[found[name]['case']])})")
    return f"largest {what}{kind}: {'; '.join(said)}"


def _words(case: FittedCase) -> str:
    pin = "rigid pin" if math.isnan(case.pin_nu) else f"E1/E2 = {case.ratio:.3g}, nu1 = {case.pin_nu:.3g}"
    s = "" if math.isinf(case.s) else f", sigY/E* = {case.strength:.3g}, s = {case.s:.3g}, {case.yielding}"
    return f"{case.run}: plane {case.plane}, {pin}, nu2 = {case.nu:.3g}, dR/R = {case.clearance:.3g}{s}"


JSON_BEGINS = '{\n "from": {\n  "archord": '  # by which a file of `as_json` is known


def as_json(
    cases: list[FittedCase],
    notes: dict[str, str],
    left_out: list[tuple[str, str]],
    model: CalibratedModel | None,
) -> str:
    """Everything as JSON; what is not a finite number is null."""
    data = {
        "from": notes,
        "cases": [
            {name: _plain(value) for name, value in (asdict(case) | {"s": case.s}).items()} for case in cases
        ],
        "left_out": [{"run": name, "reason": reason} for name, reason in left_out],
        "model": model and model.data,
    }  # fmt: skip
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return None if isinstance(value, float) and not math.isfinite(value) else value


@dataclass(frozen=True)
class _Joint:
    """What a line of the model is drawn for; both bodies have one Poisson's ratio."""

    plane: str
    alpha: float = 0.0
    nu: float = 0.3
    s: float = math.inf
    clearance: float = 0.005
    pin_nu: float | None = None


def draw_study(cases: list[FittedCase], model: CalibratedModel | None, target: str | Path) -> Path:
    """Draw k against Poisson's ratio, moduli and the onset of yielding, c against sigY/E* and dR/R, and the model
    against the cases, as ``target``; returns the file.

    Points are cases of like Poisson's ratios (k) or like bodies with nu = 0.3 (c), lines the model, where there is one.
    Raises ValueError for an unknown format.
    """
    target, figure = Path(target), new_figure(14.5, 8.4)
    axes = figure.subplots(2, 3)
    _elastic_k(axes[0, 0], axes[0, 1], cases, model)
    c_of = [c for c in cases if c.yielding == "both" and abs(c.alpha) < _ALIKE and abs(c.nu - 0.3) < _ALIKE
            and abs(c.pin_nu - 0.3) < _ALIKE and math.isfinite(c.told_c)]  # fmt: skip
    _threshold(axes[1, 0], c_of, model, "strength", "sigY / E*", "clearance", "ΔR/R", (0.001, 0.005, 0.02))
    _threshold(axes[1, 1], c_of, model, "clearance", "ΔR / R", "strength", "sigY/E*", (0.0005, 0.001, 0.002, 0.004))
    if model is not None:
        _onset(axes[0, 2], cases, model)
        _parity(axes[1, 2], known(model, [case for case in cases if case.kind in KINDS]), model)
    for axis in axes.flat:
        if not axis.lines:  # a sweep need not have what belongs here
            axis.text(0.5, 0.5, "no such case", transform=axis.transAxes, ha="center", color="0.4")
        axis.grid(alpha=0.3)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(frameon=False, fontsize="x-small")
    with writing(target):
        return save(figure, target)


def _points(
    axis: Axes, cases: list[FittedCase], value: Callable[[FittedCase], tuple[float, float]], color: str
) -> None:
    for plane, (marker, _) in _STYLES.items():
        rows = [value(case) for case in cases if case.plane == plane]
        if rows:
            axis.plot(*zip(*rows, strict=True), marker, ms=4, mfc="none", color=color)


def _line(
    axis: Axes, x: Array, joints: list[_Joint], model: CalibratedModel, which: int, color: str, said: str
) -> None:
    """k (``which`` 0) or c (1) of the model for ``joints`` of one plane, where it holds; named in plane strain."""
    plane = joints[0].plane
    values = model.coefficients((plane, ("none", "both")[which]), Points.of(joints))[which]
    soft = [(1 - joint.alpha) / 2 * float(equivalent(joint.nu, plane)) > SOFT for joint in joints]
    label = said if plane == "strain" else None
    axis.plot(x, np.where(soft, np.nan, values), ls=_STYLES[plane][1], lw=1, color=color, label=label)


def _elastic_k(by_nu: Axes, by_moduli: Axes, cases: list[FittedCase], model: CalibratedModel | None) -> None:
    nus, alphas = np.linspace(0, 0.49, 60), np.linspace(-0.5, 0.98, 80)
    elastic = [c for c in cases if c.yielding == "none" and (math.isnan(c.pin_nu) or abs(c.pin_nu - c.nu) < 1e-6)]
    pins = {-0.5: "pin 3 times softer", 0.0: "like bodies", 0.5: "pin 3 times stiffer", 1.0: "rigid pin"}
    for i, (alpha, words) in enumerate(pins.items()):
        _points(by_nu, [c for c in elastic if abs(c.alpha - alpha) < _ALIKE], lambda c: (c.nu, c.k), f"C{i}")
        for plane in PLANES if model else ():
            _line(by_nu, nus, [_Joint(plane, alpha, nu) for nu in nus], model, 0, f"C{i}", words)
    for i, nu in enumerate((0.0, 0.3, 0.49)):
        same = [c for c in elastic if abs(c.nu - nu) < 1e-3 and c.alpha < 1]
        _points(by_moduli, same, lambda c: (c.ratio, c.k), f"C{i}")
        for plane in PLANES if model else ():
            joints = [_Joint(plane, alpha, nu) for alpha in alphas]
            _line(by_moduli, (1 + alphas) / (1 - alphas), joints, model, 0, f"C{i}", f"ν = {nu:g}")
    for axis in (by_nu, by_moduli):
        axis.axhline(PAPER_K, color="black", lw=0.8, label="k = 0.85")
        axis.set(ylabel="k, elastic", ylim=(0.4, 1.3))
    by_nu.set(xlabel="ν of both bodies", title="○ — plane strain, □ -- plane stress")
    by_moduli.set(xlabel="E of the pin / E of the block", xscale="log")


def _onset(axis: Axes, cases: list[FittedCase], model: CalibratedModel) -> None:
    for (plane, yielding), color in _COLORS.items():
        same = [c for c in cases if c.kind == (plane, yielding)]
        if same:
            k = model.elastic_k(Points.of(same))
            s, own = np.array([(c.s, c.k) for c in same]).T / k
            axis.plot(s, own, _STYLES[plane][0], ms=4, mfc="none", color=color, label=f"plane {plane}, {yielding}")
    label = "s / k of the elastic joint,  s = sigY R/(E* ΔR)"
    axis.set(xlabel=label, ylabel="k / k of the elastic joint", xscale="log")


def _threshold(
    axis: Axes, cases: list[FittedCase], model: CalibratedModel | None, over: str, label: str, by: str, name: str,
    values: tuple[float, ...],
) -> None:  # fmt: skip
    """c of like bodies, nu = 0.3, over one of dR/R and sigY/E*, in the colour of the other."""
    _points(axis, cases, lambda c: (getattr(c, over), c.c), "0.4")
    bounds = {plane: model.bounds((plane, "both")) for plane in PLANES} if model else {}
    for i, value in enumerate(values):
        same = [c for c in cases if math.isclose(getattr(c, by), value, rel_tol=0.02)]
        _points(axis, same, lambda c: (getattr(c, over), c.c), f"C{i}")
        for plane, found in bounds.items():
            if found:
                s = np.geomspace(max(0.1, found["s"][0]), 1.2, 50)
                x = s * value if over == "strength" else value / s
                s, x = (part[(over == "strength") | ((x >= 0.001) & (x <= 0.02))] for part in (s, x))
                if len(s):
                    joints = [_Joint(plane, s=one, clearance=value) for one in s]
                    _line(axis, x, joints, model, 1, f"C{i}", f"{name} = {value:.2%}")
    if axis.lines:
        axis.axhline(1, color="black", lw=0.8, label="c = 1")
    axis.set(xlabel=label, ylabel="c, like bodies, ν = 0.3", xscale="log")


def _parity(axis: Axes, cases: list[FittedCase], model: CalibratedModel) -> None:
    from matplotlib.ticker import FixedLocator, NullFormatter

    k, c = predictions(model, cases)
    axis.plot([case.k for case in cases], k, ".", ms=4, color="C0", label="k")
    axis.plot([case.told_c for case in cases], np.where(np.isfinite(c), c, np.nan), ".", ms=4, color="C3", label="c")
    ends = np.array([0.3, 2.6])
    axis.plot(ends, ends, color="black", lw=0.8)
    axis.fill_between(ends, 0.95 * ends, 1.05 * ends, color="0.85", label="5 %")
    axis.set(xlabel="of the case itself", ylabel="of the model", xscale="log", yscale="log", xlim=ends, ylim=ends)
    for side in (axis.xaxis, axis.yaxis):  # over less than a decade matplotlib's own labels overlap
        side.set_major_locator(FixedLocator([0.3, 0.5, 1.0, 2.0]))
        side.set_major_formatter("{x:g}")
        side.set_minor_formatter(NullFormatter())

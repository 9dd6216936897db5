"""The fit of a sweep in words and tables: its cases, the model with its coefficients, and the errors."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Any

from rich.table import Table

from archord.postprocess.laws.calibrated_model import CalibratedModel
from archord.postprocess.laws.fitted_cases import FittedCase

_YIELDS = {"none": "none (elastic)", "both": "both", "block": "block alone"}


def case_table(numbers: list[int], cases: list[FittedCase], varied: dict[str, list[str]]) -> Table:
    """One row per case: number, what is ``varied`` (a column by heading), k and c with their errors, the plateau's
    median pressure over sigY, and rms and largest of ``law/run - 1``."""
    table = Table(box=None, pad_edge=False, header_style="")
    meshes = any(math.isfinite(case.k_mesh) for case in cases)
    errors, kinds = (("s.e.", "mesh"), ("_error", "_mesh")) if meshes else (("s.e.",), ("_error",))
    for heading in ("case", *varied, "k", *errors, "c", *errors, "plateau", "rms", "largest"):
        table.add_column(heading, justify="right", no_wrap=True)
    for i, (number, case) in enumerate(zip(numbers, cases, strict=True)):
        k, c = (
            [_number(getattr(case, name), ".4f"), *(_number(getattr(case, name + error), ".1e") for error in kinds)]
            for name in "kc"
        )
        quality = [_number(case.plateau, ".3f"), f"{case.rms:.1%}", f"{case.largest:+.1%}"]
        table.add_row(str(number), *(column[i] for column in varied.values()), *k, *c, *quality)
    return table


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "-"


def numbers_of(cases: list[FittedCase]) -> dict[str, list[str]]:
    """What decides each case, as columns of `case_table` where nothing else is known to vary."""

    def column(name: str, absent: float) -> list[str]:
        values = [getattr(case, name) for case in cases]
        return ["-" if math.isnan(value) or value == absent else f"{value:.4g}" for value in values]

    return {
        "plane": [case.plane for case in cases],
        "yields": [case.yielding for case in cases],
        "E1/E2": [f"{case.ratio:.4g}" for case in cases],
        "nu1": column("pin_nu", math.inf),
        "nu2": column("nu", math.inf),
        "dR/R": column("clearance", math.inf),
        "sigY/E*": column("strength", math.inf),
    }


def formulas(model: CalibratedModel) -> list[str]:
    """The model with its numbers, ready to be typed."""
    lines = [f"1/k_e = {_sum(model.form.elastic, model.elastic)}"]
    for part in model.plastic:
        lines.append(f"plane {part.plane}, {_YIELDS[part.yielding]} yield{'s' if part.yielding == 'block' else ''}:")
        if part.late:
            lines.append(f"  ln(k/k_e) = exp(-{part.rate:g} s/k_e) ({_sum(model.form.late, part.late)})")
        lines.append(f"  ln c = {_sum(model.form.threshold(part.plane), part.threshold)}")
    return lines


def _sum(terms: tuple[str, ...], values: tuple[float, ...]) -> str:
    said = ""
    for term, value in zip(terms, values, strict=True):
        sign = "-" if value < 0 else "+"
        product = "" if term == "1" else " " + " ".join(term)
        said += f" {sign} {abs(value):g}{product}"
    return said[3:] if said.startswith(" + ") else said.strip()


def error_lines(rows: list[tuple[str, str, str, dict[str, Any]]]) -> list[str]:
    """A Markdown table: of each row what the numbers are, plane, what yields, and a summary of `Errors`."""
    lines = [
        "| law | plane | yields | cases | k rms | k largest | c rms | c largest | P rms | P largest | own k, c: P rms "
        "| P early rms |",
        "|" + "---|" * 12,
    ]
    for law, plane, yielding, found in rows:
        cells = [_of(found, name, what) for name in ("k", "c", "P") for what in ("rms", "largest")]
        cells += [_of(found, "P own", "rms"), _of(found, "P early", "rms")]
        lines.append(
            f"| {law} | {plane} | {_YIELDS.get(yielding, yielding)} | {found['cases']} | {' | '.join(cells)} |"
        )
    return lines


def _of(found: dict[str, Any], name: str, what: str) -> str:
    if not found.get(name):
        return "-"
    return f"{found[name]['rms']:.1%}" if what == "rms" else f"{found[name]['largest']:+.1%}"


def worst_line(found: dict[str, Any], cases: list[FittedCase]) -> str:
    """Where the largest errors of a summary are."""
    by_run = {case.run: case for case in cases}
    said = []
    for name in ("k", "c", "P"):
        if name in found:
            load = f" at {found[name]['delta/dR']:g} dR" if name == "P" else ""
            said.append(f"{name} {found[name]['largest']:+.1%}{load} ({words(by_run[found[name]['case']])})")
    return "; ".join(said)


def words(case: FittedCase) -> str:
    """A case in words."""
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
    return (
        json.dumps(
            {
                "from": notes,
                "cases": [
                    {name: _plain(value) for name, value in asdict(case).items()} | {"s": _plain(case.s)}
                    for case in cases
                ],
                "left_out": [{"run": name, "reason": reason} for name, reason in left_out],
                "model": None if model is None else json.loads(model.to_json()),
            },
            indent=1,
            ensure_ascii=False,
            allow_nan=False,
        )
        + "\n"
    )


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    return None if isinstance(value, float) and not math.isfinite(value) else value

"""The commands ``archord laws`` and ``archord law``: closed-form laws of the joint, listed, tabulated and drawn."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from archord.plain_typer import typer

if TYPE_CHECKING:
    from archord.postprocess.laws.joint import LawJoint
    from archord.postprocess.laws.law import Law, Outside

DEFAULT = "calibrated"  # the law that is meant where none is named


def register(app: typer.Typer) -> None:
    """Add the commands of this file to ``app``."""
    app.command()(laws)
    app.command()(law)


def laws(
    markdown: Annotated[bool, typer.Option("--markdown", help="print all that is known of each, as Markdown")] = False,
) -> int:
    """List the closed-form laws: name, title, range and source."""
    from archord.postprocess.laws.law_report import laws_as_markdown
    from archord.postprocess.laws.laws import LAWS

    if markdown:
        print(laws_as_markdown(), end="")
        return 0
    from archord.report.table import Table

    print(
        Table(
            "name", "law", "range", "source", rows=((x.name, x.title, x.range, x.source) for x in LAWS.values()), left=4
        )
    )
    return 0


@contextmanager
def sentences() -> Iterator[None]:
    """Around formulas, whose ValueErrors are bad input here."""
    from archord.scene.errors import InputError

    try:
        yield
    except ValueError as error:
        raise InputError(str(error)) from error


def law(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME...", help=f"laws, as archord laws lists them [{DEFAULT}]", show_default=False),
    ] = None,
    scene: Annotated[Path | None, typer.Option(help="take the joint from this scene file")] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", metavar="SECTION.KEY=VALUE", help="override a key of the scene")
    ] = None,
    radius: Annotated[float | None, typer.Option(help="radius of the pin")] = None,
    clearance: Annotated[float | None, typer.Option(help="radius of the hole less that of the pin")] = None,
    E_star: Annotated[float | None, typer.Option("--E-star", help="contact modulus E*")] = None,
    yield_stress: Annotated[float | None, typer.Option(help="yield stress")] = None,
    length: Annotated[float | None, typer.Option(help="length of the joint, for the laws that need one")] = None,
    k: Annotated[float, typer.Option("--k", help="Winkler's coefficient")] = 0.85,
    c: Annotated[float | None, typer.Option("--c", help="plateau of the pressure over the yield stress [1]")] = None,
    plane: Annotated[str | None, typer.Option(help="strain or stress, for the calibrated law")] = None,
    nu: Annotated[float | None, typer.Option(help="Poisson's ratio of both bodies, for the calibrated law")] = None,
    pin_nu: Annotated[float | None, typer.Option(help="Poisson's ratio of the pin, if another than --nu")] = None,
    yielding: Annotated[
        str | None, typer.Option(help="which bodies yield, for the calibrated law: both, block or pin [both]")
    ] = None,
    dundurs_alpha: Annotated[
        float | None, typer.Option(help="(E1' - E2')/(E1' + E2'), positive for the stiffer pin [0, or the scene's]")
    ] = None,
    by_load: Annotated[
        bool, typer.Option("--by-load", help="rows in equal loads, as for laws that give no displacement")
    ] = False,
    to: Annotated[float, typer.Option(help="last row: delta in clearances, or P in E* dR")] = 2.0,
    points: Annotated[int, typer.Option(help="rows, in equal steps from zero")] = 20,
    extrapolate: Annotated[
        bool, typer.Option("--extrapolate", help="evaluate formulas outside the range of the law")
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="outside the range of a law is an error")] = False,
    plot: Annotated[Path | None, typer.Option(help="draw the laws into this file instead of a table")] = None,
) -> int:
    """Print a table of closed-form laws, or draw them against each other."""
    import math

    from archord.postprocess.laws.laws import find_law
    from archord.scene.errors import InputError

    with sentences():
        chosen = [find_law(name) for name in dict.fromkeys(names or [DEFAULT])]
    if not (math.isfinite(to) and to > 0):
        raise InputError(f"--to {to:g}: must be a positive number.")
    if not 1 <= points <= 100000:
        raise InputError(f"--points {points}: must be between 1 and 100000.")
    if strict and extrapolate:
        raise InputError("--strict: must not be given together with --extrapolate.")
    given: dict[str, Any] = {
        "radius": radius,
        "clearance": clearance,
        "E_star": E_star,
        "yield_stress": yield_stress,
        "length": length,
        "dundurs_alpha": dundurs_alpha,
        "c": c,
        "plane": plane,
        "nu": nu,
        "pin_nu": pin_nu,
        "yielding": yielding,
    }
    with sentences():
        joint, units = _joint(scene, overrides or [], given, k)
    rows = "load" if by_load or not all(entry.gives_displacement for entry in chosen) else "displacement"
    outside: Outside = "raise" if strict else "extrapolate" if extrapolate else "nan"
    if plot is not None:
        from archord.output.user_file import check_target
        from archord.postprocess.laws.law_report import draw_laws
        from archord.scene.file import files_read

        check_target(plot, files_read(scene, overrides or []) if scene else [], force=True)
        print(_warned(draw_laws, chosen, joint, plot, rows, to, outside))
        return 0
    _warned(_print_table, chosen, joint, rows, to, points, outside, units)
    return 0


def _joint(
    scene: Path | None, overrides: list[str], given: dict[str, Any], k: float
) -> tuple[LawJoint, dict[str, str]]:
    """The joint of the scene, or of the options, which come before it; and the names of the units."""
    import dataclasses

    from archord.postprocess.laws.joint import LawJoint
    from archord.scene.errors import InputError

    values: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if "nu" in values:
        values.setdefault("pin_nu", None)  # one for both
    if scene is not None:
        from archord.scene.file import load_scene

        loaded = load_scene(scene, overrides)
        units = {"length": loaded.units.length, "stress": loaded.units.stress, "force": loaded.units.force}
        return dataclasses.replace(LawJoint.from_scene(loaded, k=k), **values), units
    if overrides:
        raise InputError("--set: changes a scene; give one with --scene.")
    missing = [f"--{name.replace('_', '-')}" for name in ("radius", "clearance", "E_star") if name not in values]
    if missing:
        raise InputError(f"{', '.join(missing)}: missing; give radius, clearance and E* of the joint, or a --scene.")
    return LawJoint(**values, k=k), {}


def _warned(function: Any, *arguments: Any) -> Any:
    """Call ``function`` and print each warning about a range once, as one sentence on stderr."""
    import warnings

    from archord.postprocess.laws.joint import LawRangeWarning

    with sentences(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LawRangeWarning)
        result = function(*arguments)
    for message in dict.fromkeys(str(w.message) for w in caught):
        print(f"archord: warning: {message}.", file=sys.stderr)
    return result


def _print_table(
    chosen: list[Law], joint: LawJoint, rows: str, to: float, points: int, outside: Outside, units: dict[str, str]
) -> None:
    from archord.postprocess.laws.law_report import law_columns
    from archord.report.table import Table

    for i, entry in enumerate(chosen):
        columns = law_columns(entry, joint, rows, to, points, outside, units)
        values = zip(*columns.values(), strict=True)
        print(f"{'' if i == 0 else chr(10)}{entry.name}: {entry.title}")
        print(Table(*columns, rows=[[f"{value:.6g}" for value in row] for row in values]))

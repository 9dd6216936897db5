"""``archord identify``: a joint from a measured force-displacement curve."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from archord.commands.law_files import Text, sentences, write
from archord.commands.options import argument, file, flag, output, overrides, warn
from archord.report.by_name import Names
from archord.report.errors import InputError

if TYPE_CHECKING:
    from archord.postprocess.laws.identification.identification import Identification
    from archord.scene.presets.joint import Scene

_FREE = "free"
_RIGID = "rigid"
_SCENE = "identified.toml"
_NUMBERS = "identified.json"


@click.command()
@argument("curve", "CURVE", "CSV file of displacement and force, in the units of the scene")
@file("--scene", "the joint, with values to begin with", "SCENE")
@overrides()
@click.option(
    "--free",
    "frees",
    multiple=True,
    metavar="KEY[,KEY][=LOW:HIGH]",
    help="a key to identify, or keys with one value; may be repeated",
)
@click.option("--delta", help="heading of the displacement [first column]")
@click.option("--load", help="heading of the force [second column]")
@click.option(
    "--offset", default=_FREE, metavar="NUMBER", help="reading of the displacement at first touch"
)
@click.option(
    "--machine-stiffness",
    "stiffness",
    default=_FREE,
    metavar="NUMBER|rigid",
    help="stiffness of what is in series with the joint",
)
@output("folder of the results [runs/<name of the curve>_identified]")
@flag("--force", "overwrite the results in the folder")
@click.option("--confirm/--no-confirm", default=True, help="solve the identified scene")
@sentences()
def identify(
    curve: Path,
    scene: Path | None,
    overrides: Names,
    frees: Names,
    delta: str | None,
    load: str | None,
    offset: str,
    stiffness: str,
    output: Path | None,
    force: bool,
    confirm: bool,
) -> int:
    """Identify a joint from a measured curve: clearance, yield stress and other keys of a scene.

    Loads of the whole joint if the scene has a thickness, else per unit thickness.
    """
    from archord.commands.law_joint import law_scene
    from archord.postprocess.laws.identification import identify_report
    from archord.postprocess.laws.identification.identification import identify as fit
    from archord.postprocess.laws.identification.measured import read_curve

    if scene is None or not frees:
        raise InputError("archord identify: needs a --scene and what is --free in it.")
    begun = law_scene(scene, overrides)
    if begun.joint.is_ring:
        raise InputError(scene, "is a ring, and the law is of a pin in a block.")
    units = begun.units.length, begun.units.force_of(begun.analysis.thickness)
    measured = read_curve(curve, delta, load, units)
    at = _number("--offset", offset)
    if at and measured.turned:
        at = -at  # it is a reading of the file
    stiff = None if stiffness == _FREE else _stiffness(stiffness)
    folder = output or Path("runs") / f"{curve.stem}_identified"
    _refuse(folder, [curve, scene], force)
    found = fit(begun, measured, frees, at, stiff)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(folder, f"cannot hold results: {error.strerror}.") from None
    print(identify_report.estimates_table(found))
    print("", identify_report.correlation_table(found), sep="\n")
    print("", *identify_report.notes(found), sep="\n")
    warn(*identify_report.doubts(found))
    target = folder / _SCENE
    texts: list[Text] = [
        (target, lambda: _identified(found, begun)),
        (folder / _NUMBERS, lambda: identify_report.as_json(found)),
    ]
    files = write(texts, [curve, scene], force)
    solved = _confirmed(found, target, folder, force) if confirm else None
    picture = identify_report.draw(found, folder / "identified.png", solved)
    print("", *files, picture, sep="\n")
    return 0


def _refuse(folder: Path, inputs: list[Path], force: bool) -> None:
    """Raise `InputError` if the ``folder`` cannot hold results or, without ``force``, has some:
    before the fit, which takes seconds."""
    from archord.output.user_file import check_target

    nearest = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not nearest.is_dir():
        raise InputError(folder, "cannot hold results: Not a directory.")
    if nearest == folder:
        for name in (_SCENE, _NUMBERS):
            check_target(folder / name, inputs, force=force)


def _number(option: str, text: str) -> float | None:
    """The number of an option; None if it is free."""
    if text == _FREE:
        return None
    said = f"{option} {text}: must be a number, or {_FREE}."
    try:
        found = float(text)
    except ValueError:
        raise InputError(said) from None
    if not math.isfinite(found):
        raise InputError(said)
    return found


def _stiffness(text: str) -> float:
    """The stiffness of the machine."""
    if text == _RIGID:
        return math.inf
    found = _number("--machine-stiffness", text)
    if found is None or not found > 0:
        raise InputError(f"--machine-stiffness {text}: must be positive, or {_RIGID}.")
    return found


def _identified(found: Identification, scene: Scene) -> str:
    """The ``scene`` with the identified values, pressed and released as the joint was."""
    from archord.postprocess.laws.identification.confirmation import path_of
    from archord.scene.file import parse_scene, put, resolved

    data = scene.resolved_data()
    values = {key: one.value for one in found.estimates for key in one.unknown.keys}
    for key, value in (values | path_of(found)).items():
        section, _, name = key.partition(".")
        put(data, section, name, value, key)
    return resolved(parse_scene(data))


def _confirmed(found: Identification, scene: Path, folder: Path, force: bool) -> Any:
    """The identified scene solved; prints by how much curve and law differ from the solution."""
    import numpy as np
    from mpi4py import MPI

    from archord.commands.progress import solve_and_report
    from archord.postprocess.laws.identification.confirmation import compared
    from archord.postprocess.run import Run
    from archord.scene.file import load_scene

    target = folder / "run"
    print()
    solve_and_report(lambda: load_scene(scene), target, MPI.COMM_SELF, force=force, silent=False)
    run = Run(target)
    solved = tuple(np.array(run.columns[name]) for name in ("delta", "P"))
    print("", *compared(found, solved[0], solved[1]), sep="\n")
    return solved

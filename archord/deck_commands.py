"""The command ``archord export-deck``: the joint as an input deck for another solver."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

from archord.plain_typer import typer


class Elements(StrEnum):
    """Elements of a deck: archord's own second-order triangles, or each of them cut into four."""

    QUADRATIC = "quadratic"
    LINEAR = "linear"


def export_deck(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="scene file (TOML)")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="deck to write [<scene name>.inp]")] = None,
    elements: Annotated[
        Elements, typer.Option(help="six-node triangles, archord's own mesh, or each cut into four of three nodes")
    ] = Elements.QUADRATIC,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="SECTION.KEY=VALUE", help="override a key of the scene; may be repeated"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite a file that is there")] = False,
) -> int:
    """Write a scene as an input deck for CalculiX or Abaqus."""
    from archord.output.user_file import check_target
    from archord.scene.errors import InputError
    from archord.scene.file import files_read, load_scene

    checked = load_scene(scene, overrides or [])
    if checked.joint.model != "block":
        raise InputError(f'{scene}: joint.model = "{checked.joint.model}" cannot be exported; only "block" can.')
    from archord.postprocess.deck import write_deck

    path = output or Path(f"{scene.stem}.inp")
    check_target(path, files_read(scene, overrides or []), force=force)
    write_deck(checked, path, elements.value)
    print(path)
    return 0

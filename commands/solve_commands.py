"""``archord solve``; and ``archord scene`` and ``mesh``, which tell what there is to solve."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from archord.commands.options import (
    PATH,
    SCENE,
    argument,
    complain,
    flag,
    output,
    overrides,
    pictures,
    quiet,
    warn,
)
from archord.report.by_name import Names

if TYPE_CHECKING:
    from archord.scene.file import AnyScene


@click.command()
@SCENE
@overrides()
@output("run folder [runs/<scene name>]")
@flag("--force", "overwrite the results in the run folder")
@flag("--restart", "continue the interrupted run in the run folder")
@flag("--extend", "continue the run along the scene's path, which must go further")
@quiet()
@click.option("-v", "--verbose", is_flag=True, help="print a line for every Newton iteration, too")
@click.pass_obj
def solve(
    begun: float,
    scene: Path,
    overrides: Names,
    output: Path | None,
    force: bool,
    restart: bool,
    extend: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Solve a scene into a run folder. Under mpirun, all ranks work on it.

    With --restart and --extend, the run folder may stand in the place of the scene.
    """
    from archord.output.folder import refuse_folder
    from archord.scene.file import load_scene

    if restart + extend + force > 1:
        raise click.UsageError("choose one of --force, --restart and --extend")
    if quiet and verbose:
        raise click.UsageError("choose one of -q and -v")
    told = {"quiet": quiet, "verbose": verbose}
    if not (restart or extend):
        refuse_folder(scene)
        folder = output or Path("runs") / scene.stem
        return _solve(lambda: load_scene(scene, overrides), folder, begun, force=force, **told)
    if output is not None and scene.is_dir():
        raise click.UsageError("-o does not go with a run folder")
    folder = scene if scene.is_dir() else output or Path("runs") / scene.stem
    file = scene / "scene.toml" if scene.is_dir() else scene
    from mpi4py import MPI

    from archord.output.ranks import agreed
    from archord.output.restart import plan_restart  # on all ranks: it imports PETSc

    planned = agreed(
        MPI.COMM_WORLD, lambda: plan_restart(folder, load_scene(file, overrides), extend=extend)
    )
    if not quiet:
        print(f"{planned.said}.", flush=True)
    if planned.finished:
        return 0
    return _solve(lambda: planned.scene, folder, begun, force=True, start=planned.start, **told)


def _solve(
    load: Callable[[], AnyScene], folder: Path, begun: float, *, quiet: bool, **options: Any
) -> int:
    """`solve_and_report`, with its ``options``; returns the exit code."""
    from mpi4py import MPI

    from archord.commands.progress import solve_and_report

    def doubted() -> AnyScene:
        """The scene; what is to be doubted of it is told before it is solved."""
        scene = load()
        told.extend(scene.doubts)
        warn(*told)
        return scene

    comm = MPI.COMM_WORLD
    told = list[str]()
    scene, outcome = solve_and_report(doubted, folder, comm, silent=quiet, begun=begun, **options)
    if outcome.warnings:
        from archord.postprocess.tables import first_of_each_kind

        warn(*first_of_each_kind([said for said in outcome.warnings if said not in told]))
    if comm.rank == 0 and outcome.status != "done":
        steps = f"{len(outcome.steps)} accepted steps are in {folder}"
        complain(outcome.message, f"{outcome.status}; {steps}")
    elif comm.rank == 0 and not quiet:
        said = f"{len(outcome.steps)} steps in {perf_counter() - begun:.1f} s"
        if outcome.accuracy is not None and outcome.accuracy.estimated is not None:
            name = scene.accurate
            asked = outcome.accuracy.asked
            said += (
                f", estimated error of {name} {outcome.accuracy.estimated:.1e} (asked {asked:g})"
            )
        print(f"{said}, results in {folder}")
    return {"done": 0, "stopped": 3, "interrupted": 128 + outcome.signal}[outcome.status]


@click.command()
@flag("--example", "print a commented example of a joint")
@flag("--general", "print a commented example of a general scene")
@flag("--reference", "print all keys as Markdown tables")
@flag("--materials", "print the metals that a scene may name, as a Markdown table")
@click.option(
    "--expand", type=PATH, metavar="SCENE", help="print the general scene that SCENE stands for"
)
def scene(
    example: bool, general: bool, reference: bool, materials: bool, expand: Path | None
) -> int:
    """Print what a scene file may hold."""
    if example + general + reference + materials + (expand is not None) != 1:
        raise click.UsageError(
            "choose one of --example, --general, --reference, --materials and --expand"
        )
    from archord.scene import reference as pages
    from archord.scene.file import load_scene, parse_any, resolved

    if expand is not None:
        print(resolved(parse_any(load_scene(expand).general())), end="")
    elif materials:
        print(pages.materials(), end="")
    else:
        print(pages.reference() if reference else pages.example(general), end="")
    return 0


@click.command()
@argument(
    "file", "FILE", "mesh (.msh, .inp, .xdmf, .npz), CAD (.step, .stp, .brep), or scene (.toml)"
)
@output("picture to draw [<name>.png]")
@overrides()
@pictures("the mesh with its named sets")
def mesh(file: Path, output: Path | None, overrides: Names, pictures: bool) -> int:
    """Print what is in a mesh: kind and order of its cells, named sets, circles and warnings; and
    draw it.

    Keys of [mesh] may be set of a mesh file, too: --set mesh.scale=1000.
    """
    from mpi4py import MPI

    from archord.geometry.meshes.fenicsx import gathered
    from archord.output.user_file import check_target
    from archord.postprocess.pictures.mesh import draw_mesh, mesh_text
    from archord.presets.problem import as_input_error, mesh_name, scene_mesh
    from archord.scene.file import load_scene, override_key, parse_any
    from archord.scene.problem import MeshScene

    if file.suffix == ".toml":
        loaded = load_scene(file, overrides)
        loaded.require_mesh()
        scene: Any = parse_any(loaded.general(), str(file))
    else:
        given: Any = {"mesh": {"file": str(file)}}
        make: Any = MeshScene
        scene = make(str(file), {override_key(given, o): f"--set {o}" for o in overrides}, **given)
    with as_input_error(mesh_name(scene)):
        whole = gathered(scene_mesh(scene, MPI.COMM_SELF))
    assert whole is not None  # this is rank 0
    print(mesh_text(str(file), whole))
    if pictures:
        target = output or Path(f"{file.stem}.png")
        check_target(target, [file])
        print(f"\n{draw_mesh(whole, target)}")
    return 0

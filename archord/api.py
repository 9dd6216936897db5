"""archord from Python: load results, load scenes, solve them. The names are those of the package:
``archord.load``."""

from __future__ import annotations

import logging
import signal
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from archord.output.folder import is_sweep
from archord.postprocess.run import Run
from archord.postprocess.sweep import Sweep
from archord.scene import file as scene_file
from archord.scene.errors import InputError, toml_value
from archord.scene.faults import shortened
from archord.scene.file import ABSENT, AnyScene
from archord.scene.parts import Mesh
from archord.scene.problem import GIVEN, LIVE, ProblemScene
from archord.scene.scene import plain

if TYPE_CHECKING:
    from mpi4py import MPI


def load(folder: str | Path) -> Any:
    """The results in ``folder``: a `Run`, or a `Sweep` if it is a sweep's folder. Raises
    `InputError` for neither."""
    if not Path(folder).is_dir():
        raise InputError(f"{folder}: is not a folder; give the folder of a run or of a sweep.")
    return Sweep(folder) if is_sweep(folder) else Run(folder)


def load_scene(path: str | Path, changes: Mapping[str, Any] | None = None) -> AnyScene:
    """Read a scene file with ``changes`` like ``{"joint.clearance": 0.01}``; None or "none" drops a
    key. Raises `InputError`."""
    given = (
        (key, ABSENT if value is None else toml_value(plain(value)))
        for key, value in (changes or {}).items()
    )
    return scene_file.load_scene(path, [f"{key}={value}" for key, value in given])


def Problem(
    mesh: Any,
    *,
    bodies: Sequence[Any] = (),
    loads: Sequence[Any] = (),
    interactions: Sequence[Any] = (),
    couplings: Sequence[Any] = (),
    supports: Sequence[Any] = (),
    **sections: Any,
) -> ProblemScene:
    """A general scene in the words of scene files: parts are of the classes `Body`, `Load` and so
    on, or tables.

    ``mesh`` is a mesh file, gmsh with a model (meshed or not), a dolfinx mesh with tags ``(mesh,
    cells, facets)``, or a `Mesh` or its table. Other ``sections`` are those of a scene: ``path``,
    ``analysis``, ... Raises `InputError`.
    """
    if isinstance(mesh, (str, Path, Mapping, Mesh)):
        mesh = {"file": str(mesh)} if isinstance(mesh, (str, Path)) else plain(mesh)
        scene_file.find_mesh(mesh, Path())
    else:
        if not isinstance(mesh, (tuple, ModuleType)) and not hasattr(mesh, "facet_sets"):
            kinds = "a mesh file, gmsh with a model, (mesh, cells, facets) of dolfinx, or a Mesh"
            raise InputError(f"archord.Problem: mesh must be {kinds}, not {shortened(repr(mesh))}.")
        name = f"mesh {len(LIVE) + 1}{GIVEN}"
        LIVE[name], mesh = mesh, {"file": name}
    parts = {
        "body": bodies,
        "interaction": interactions,
        "coupling": couplings,
        "support": supports,
        "load": loads,
    }
    for name, part in parts.items():
        if not isinstance(part, (list, tuple)):
            raise InputError(
                f"archord.Problem: {name} must be a list of parts, not {shortened(repr(part))}."
            )
    sections |= {"mesh": mesh, **{name: list(part) for name, part in parts.items()}}
    return ProblemScene(**sections)


def _scene_of(given: Any) -> AnyScene:
    """A scene that is one already, a file with one, or the table of such a file. Raises
    `InputError`."""
    if isinstance(given, (str, Path)):
        return load_scene(given)
    if isinstance(given, Mapping):
        return scene_file.parse_any(plain(given))
    if not isinstance(given, AnyScene):
        said = "scene must be a scene, a scene file or its table"
        raise InputError(f"archord.solve: {said}, not {shortened(repr(given))}.")
    return given


def solve(
    scene: AnyScene | str | Path | Mapping[str, Any],
    folder: str | Path,
    *,
    force: bool = False,
    progress: bool = False,
    comm: MPI.Comm | None = None,
) -> Run:
    """Solve ``scene`` (or the scene file of that name, or the table of such a file) into
    ``folder``, and give back the run. Collective over ``comm`` (all ranks).

    An occupied folder is refused without ``force``. ``progress`` reports steps on rank 0 as
    ``archord solve`` does. Of a run that could not reach its end (status "stopped") the logger
    "archord" warns. Raises `InputError` on all ranks, and KeyboardInterrupt for Ctrl-C (SystemExit
    for SIGTERM and SIGHUP) once the accepted steps are on disk.
    """
    from mpi4py import MPI

    from archord.progress import solve_and_report

    checked: Callable[[], AnyScene] = partial(_scene_of, scene)
    comm = MPI.COMM_WORLD if comm is None else comm
    _, outcome = solve_and_report(checked, Path(folder), comm, force=force, silent=not progress)
    if outcome.status == "interrupted":
        by_user = outcome.signal == signal.SIGINT
        raise KeyboardInterrupt(outcome.message) if by_user else SystemExit(128 + outcome.signal)
    if outcome.status == "stopped" and comm.rank == 0:
        # not warnings.warn: importing ffcx sends warnings to a logger that shows nothing
        logging.getLogger("archord").warning("archord: %s: %s.", folder, outcome.message)
    return Run(folder)

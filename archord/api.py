"""archord from Python: load results, load scenes, solve problems and scenes, write their decks. The
names are names of the package: ``archord.load``."""

from __future__ import annotations

import logging
import signal
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from archord.output.folder import CHECKPOINT, MESH, is_sweep
from archord.postprocess.run import Run
from archord.postprocess.sweep import Sweep
from archord.report.by_name import ByName
from archord.report.errors import InputError
from archord.scene import file as scene_file
from archord.scene.file import ABSENT, AnyScene
from archord.scene.sections.errors import toml_value
from archord.scene.sections.faults import shortened
from archord.scene.sections.keys import plain

if TYPE_CHECKING:
    from mpi4py import MPI

    from archord.output.restart import Plan
    from archord.solver.problem import Problem


def load(folder: str | Path) -> Any:
    """Load the results in a folder.

    Parameters
    ----------
    folder : str or Path
        The folder of a run or of a sweep.

    Returns
    -------
    Run or Sweep

    Raises
    ------
    InputError
        For a folder that is neither.

    Examples
    --------
    >>> import archord
    >>> try:
    ...     archord.load("runs/nothing")
    ... except archord.InputError as error:
    ...     print(error)
    runs/nothing: is not a folder; give the folder of a run or of a sweep.
    """
    if not Path(folder).is_dir():
        raise InputError(f"{folder}: is not a folder; give the folder of a run or of a sweep.")
    return Sweep(folder) if is_sweep(folder) else Run(folder)


def load_scene(path: str | Path, changes: Mapping[str, Any] | None = None) -> AnyScene:
    """Read a scene file.

    Parameters
    ----------
    path : str or Path
        The TOML file.
    changes : dict
        Values by their keys, ``{"joint.clearance": 0.01}``; None or "none" drops a key.

    Returns
    -------
    Scene or ProblemScene

    Raises
    ------
    InputError
        One sentence for each fault: file, key, value and what is allowed.

    Examples
    --------
    >>> import archord
    >>> scene = archord.load_scene("scenes/steel_pin.toml", {"load.steps": 5})
    >>> len(scene.targets)
    5
    """
    given = (
        (key, ABSENT if value is None else toml_value(plain(value)))
        for key, value in (changes or {}).items()
    )
    return scene_file.load_scene(path, [f"{key}={value}" for key, value in given])


def solve(
    problem: Problem | AnyScene | str | Path | Mapping[str, Any],
    folder: str | Path,
    *,
    force: bool = False,
    restart: bool = False,
    fields: str | bool = "nodes",
    own_fields: Mapping[str, Callable[[Any], Any]] | None = None,
    progress: bool = False,
    comm: MPI.Comm | None = None,
) -> Run:
    """Solve a problem into a run folder.

    All ranks of ``comm`` take part. Of a run that could not reach its end (status "stopped") the
    logger "archord" warns; `Run.warnings` has what else there is to warn of.

    Parameters
    ----------
    problem : Problem, Scene, ProblemScene, str, Path or dict
        The problem, or a scene, its file, or the table of such a file.
    folder : str or Path
        The run folder, which is made. It is refused if it holds anything.
    force : bool
        Overwrite what the folder holds.
    restart : bool
        Go on after the last accepted step in the folder. The problem must be the run's own, but
        that its loads may go further.
    fields : {"cells", "nodes", "points"} or False
        Of a `Problem`: where the run has stress and plastic strain, as means of cells, also at the
        nodes, or also at the integration points. A scene says it itself.
    own_fields : dict
        More fields of the cells by name, functions of the state at a body's integration points,
        ``lambda at: at.stress[..., 0]``, which return an array ``(n, q)``: the run has the mean of
        each cell. `PointFields` in archord/solver/bulk/body_points.py says what ``at`` has. A
        restart takes them again.
    progress : bool
        Report steps as ``archord solve`` does.
    comm : MPI.Comm
        The communicator, by default all ranks.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        On all ranks, for a problem that contradicts itself or its mesh, and for the folder.
    KeyboardInterrupt, SystemExit
        For Ctrl-C, and for SIGTERM and SIGHUP, once the accepted steps are on disk.

    Examples
    --------
    >>> import archord
    >>> joint = {"radius": 10.0, "clearance": 0.1, "relative_element_size": 0.2}
    >>> steel = {"E": 210e3, "nu": 0.3}
    >>> load = {"displacement": 0.5, "steps": 1}
    >>> scene = archord.Scene(joint=joint, pin=steel, block=steel, load=load)
    >>> archord.solve(scene, "runs/doctest", force=True).status
    'done'
    """
    from mpi4py import MPI

    from archord.commands.progress import solve_and_report
    from archord.output.cell_fields import own_rows

    folder = Path(folder)
    comm = MPI.COMM_WORLD if comm is None else comm
    if force and restart:
        raise InputError("archord.solve: force and restart do not go together; give one of them.")
    if own_fields and not fields:
        raise InputError("archord.solve: own_fields need fields, which False leaves out.")
    given = _problem_of(problem)
    if given is None:
        checked: Callable[[], AnyScene] = partial(_scene_of, problem)
    else:
        checked = partial(_words_of, given, folder, fields)
    options: ByName = {"force": force}
    if restart:
        planned = _plan(checked, folder, comm)
        if planned.finished:
            if given is not None and not given.mesh_file:
                _require_own_mesh(given, planned, folder, comm)
            return Run(folder)
        checked = partial(_scene_of, planned.scene)
        options = {"force": True, "start": planned.start}
    if given is not None:
        options["problem"] = given
    if own_fields is not None:
        options["own_fields"] = own_rows(own_fields)
    _, outcome = solve_and_report(checked, folder, comm, silent=not progress, **options)
    if outcome.status == "interrupted":
        by_user = outcome.signal == signal.SIGINT
        raise KeyboardInterrupt(outcome.message) if by_user else SystemExit(128 + outcome.signal)
    if outcome.status == "stopped" and comm.rank == 0:
        # not warnings.warn: importing ffcx sends warnings to a logger that shows nothing
        logging.getLogger("archord").warning("archord: %s: %s.", folder, outcome.message)
    return Run(folder)


def export_deck(
    problem: Problem | AnyScene | str | Path | Mapping[str, Any],
    path: str | Path,
    *,
    force: bool = False,
) -> Path:
    """Write an input deck for CalculiX, and but for lines that say so for Abaqus.

    Collective: rank 0 writes.

    Parameters
    ----------
    problem : Problem, Scene, ProblemScene, str, Path or dict
        As for `solve`. Its elements are of second order in the deck.
    path : str or Path
        The file to write.
    force : bool
        Overwrite a file that is there.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        For what a deck cannot say, as own laws and own materials, for a mesh that is on several
        ranks, and for the file.

    Examples
    --------
    >>> from archord import Body, Elastic, Load, Problem, Support, export_deck, rectangles
    >>> problem = Problem(
    ...     rectangles({"block": (0.0, 0.0, 2.0, 1.0)}, size=0.5),
    ...     bodies=[Body("block", Elastic(210e3, 0.3))],
    ...     supports=[Support("block bottom")],
    ...     loads=[Load("pull", on="block top", direction="y", displacement=0.01)],
    ...     kinematics="axisymmetric",
    ... )
    >>> "TYPE=CAX6" in export_deck(problem, "block.inp", force=True).read_text()
    True
    """
    from mpi4py import MPI

    from archord.output.ranks import agreed
    from archord.output.user_file import check_target
    from archord.postprocess.decks.deck import write_deck

    path = Path(path)

    def write() -> Path:
        check_target(path, force=force)
        given = _problem_of(problem)
        if given is None:
            scene = _scene_of(problem, "archord.export_deck")
        else:
            scene = _words_of(given, path.parent, "nodes")
        write_deck(scene, path, path.stem, given)
        return path

    return agreed(MPI.COMM_WORLD, write)


def _problem_of(given: Any) -> Problem | None:
    """The problem, None where something else is given."""
    if isinstance(given, (str, Path, Mapping, AnyScene)):
        return None
    from archord.solver.problem import Problem

    return given if isinstance(given, Problem) else None


def _words_of(problem: Problem, folder: Path, fields: str | bool) -> AnyScene:
    """The scene that tells of ``problem`` in a run ``folder``. Raises `InputError`."""
    from archord.presets.words import words_of

    return words_of(problem, str(folder.absolute() / MESH), fields)


def _scene_of(given: Any, caller: str = "archord.solve") -> AnyScene:
    """A scene that is one already, a file with one, or the table of such a file. Raises
    `InputError`, which names the ``caller``."""
    if isinstance(given, (str, Path)):
        return load_scene(given)
    if isinstance(given, Mapping):
        return scene_file.parse_any(plain(given))
    if not isinstance(given, AnyScene):
        said = "problem must be a Problem, a scene, a scene file or its table"
        raise InputError(f"{caller}: {said}, not {shortened(repr(given))}.")
    in_space: Any = given
    if getattr(in_space, "space", None) is not None:
        return scene_file.parse_any(in_space.general(), caller)
    return given


def _require_own_mesh(problem: Problem, planned: Plan, folder: Path, comm: MPI.Comm) -> None:
    """Raise `InputError` unless the mesh of the ``problem``, which no file tells, is the one of the
    finished run in ``folder``. Collective."""
    from archord.output.checkpoint import require_same_mesh
    from archord.presets.account import account_of
    from archord.solver.path.mesh_order import MeshOrder

    system = account_of(planned.scene, comm, given=problem).system
    checkpoint = planned.start.checkpoint if planned.start else None
    require_same_mesh(MeshOrder(system), folder / CHECKPOINT, checkpoint)


def _plan(checked: Callable[[], AnyScene], folder: Path, comm: MPI.Comm) -> Plan:
    """From where to go on in ``folder``. Collective; raises `InputError`."""
    from archord.output.ranks import agreed
    from archord.output.restart import plan_restart

    return agreed(comm, lambda: plan_restart(folder, checked()))

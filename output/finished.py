"""Whether a run that says that it is done is a finished run of a scene: whether its files agree
with run.json."""

from __future__ import annotations

from pathlib import Path

from archord.output.files.seal import faults_of
from archord.output.history import fault_of_history, read_history
from archord.report.by_name import ByName
from archord.scene.file import AnyScene, load_scene, resolved
from archord.scene.mesh_digests import digests
from archord.scene.problem import ProblemScene


def fault_of_run(folder: Path, scene: AnyScene, report: ByName) -> str:
    """Why the run in ``folder`` with the run.json ``report`` is no finished run of ``scene``, in
    words; nothing where its files agree. Of large files only the size is read."""
    if not _is_of(folder, scene):
        return "scene.toml is of another scene"
    fault = fault_of_mesh(scene, report)
    if fault:
        return fault
    faults = faults_of(folder, report.get("files", {}))
    if faults:
        return "; ".join(f"{name} {fault}" for name, fault in faults.items())
    fault = history_fault(folder, report)
    return f"history.csv {fault}" if fault else ""


def fault_of_mesh(scene: AnyScene, report: ByName) -> str:
    """What happened to the mesh file of ``scene`` since the run with this ``report`` read it, in
    words; nothing where it is the same or gone, or nothing tells."""
    file = scene.mesh.file if isinstance(scene, ProblemScene) else None
    mesh = report.get("mesh", {})
    if not file or "sha256" not in mesh:
        return ""
    read = {"": mesh["sha256"]} | mesh.get("beside", {})
    try:
        now = digests(Path(file))
    except OSError:
        return ""
    changed = [name for name in read if name in now and now[name] != read[name]]
    if not changed:
        return ""
    names = f" with {changed[0]}" * bool(changed[0])
    return f"mesh {file}{names} was changed after the run: its sha256 is not the one in run.json"


def history_fault(folder: Path, report: ByName) -> str:
    """What is wrong with the history.csv in ``folder``, in words; nothing where it agrees with the
    ``report``."""
    path = folder / "history.csv"
    try:
        if not path.read_bytes().endswith(b"\n"):
            return "was cut short"
        return fault_of_history(read_history(path), report)
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    except (AttributeError, KeyError, TypeError, ValueError):
        return "is no table of the run's steps"


def _is_of(folder: Path, scene: AnyScene) -> bool:
    """Whether scene.toml holds ``scene``; of one that leaves the mesh to an accuracy it holds
    another mesh."""
    if scene.analysis.accuracy is not None:
        return True
    wanted = resolved(scene)
    path = folder / "scene.toml"
    try:
        return path.read_text(encoding="utf-8") == wanted or resolved(load_scene(path)) == wanted
    except (OSError, ValueError):  # an InputError is a ValueError
        return False

"""What benchmarks share: a named scene with what is expected of it, the joint that most of them
vary, and tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, TypeVar

from mpi4py import MPI

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import mesh_joint
from archord.geometry.shapes.sketch import Sketch
from archord.output.folder import claim_folder
from archord.output.run import Outcome
from archord.report.by_name import ByName
from archord.report.files import Row, read_json, write_report
from archord.report.table import Table
from archord.scene.file import parse_scene, resolved
from archord.scene.presets.joint import Scene
from archord.studies.accuracy import solve_to_accuracy

E = 2 * (1 - 0.3**2)  # E* = 1 for two like bodies in plane strain
Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Expected:
    """``quantity`` (a key of the view's `quantities`) at the last step must be ``value`` within the
    relative ``tolerance``.

    ``value`` is a number or, times ``factor``, the value of another case by name. ``source`` says
    where it comes from.
    """

    quantity: str
    value: float | str
    tolerance: float
    source: str
    factor: float = 1.0


@dataclass(frozen=True)
class Case:
    """A scene by name, in a ``group`` of its benchmark, and how its run must end.

    With ``stops``, a part of the sentence that the run must end with (exit code 3); with ``warns``,
    a part of one of its warnings. At most ``budget`` Newton iterations, failed attempts included,
    where the benchmark limits them.
    """

    name: str
    scene: Any  # `AnyScene`
    group: str = ""
    expected: tuple[Expected, ...] = ()
    stops: str = ""
    warns: str = ""
    budget: int = 300

    def folder(self, parent: Path) -> Path:
        """The case's run folder below ``parent``."""
        return parent / slug(self.name)

    def is_done(self, parent: Path) -> bool:
        """Whether the folder below ``parent`` holds this scene, solved to the end."""
        try:
            report = read_json(self.folder(parent) / "run.json")
            scene = (self.folder(parent) / "scene.toml").read_text(encoding="utf-8")
        except (OSError, ValueError):
            return False
        return report.get("status") == "done" and scene == resolved(self.scene)

    def attempt(self, parent: Path, **hooks: Any) -> Outcome:
        """Solve into the folder below ``parent``, on this rank alone; ``hooks`` are hooks of
        `solve_scene`.

        Raises KeyboardInterrupt if a signal interrupted the run, and `InputError` if the folder
        cannot be written.
        """
        claim_folder(self.folder(parent), force=True)
        outcome = solve_to_accuracy(self.scene, self.folder(parent), MPI.COMM_SELF, **hooks)
        if outcome.status == "interrupted":
            raise KeyboardInterrupt
        return outcome

    def solve(self, parent: Path, **hooks: Any) -> Outcome:
        """`attempt`, to the end. Raises RuntimeError with a sentence if the run stopped before."""
        outcome = self.attempt(parent, **hooks)
        if outcome.status != "done":
            raise RuntimeError(f"{self.name}: {outcome.message}")
        return outcome


def paper_joint(
    element_size: float = 0.04, steps: int = 4, yield_stress: float | None = None, **sections: dict
) -> Scene:
    """Plane strain, like bodies, nu = 0.3, dR/R = 0.5 %, block 100 R, delta = 2 dR, with R = E* =
    1.

    ``sections`` override keys of the scene's sections, as in ``joint={"clearance": 0.01}``; None
    drops a key.
    """
    solid = {"E": E, "nu": 0.3} | ({"yield_stress": yield_stress} if yield_stress else {})
    data = {
        "joint": {"radius": 1.0, "clearance": 0.005, "element_size": element_size},
        "pin": solid,
        "block": solid,
        "load": {"displacement": 2.0, "steps": steps},
    }
    return parse_scene(_overridden(data, sections))


def varied(scene: Scene, **sections: dict) -> Scene:
    """``scene`` with other keys in its ``sections``; None drops a key."""
    return parse_scene(_overridden(scene.model_dump(exclude_unset=True), sections))


def _overridden(data: ByName, sections: dict[str, dict]) -> ByName:
    """``data`` with the keys of ``sections``, without those that are None; a rigid pin has no
    other."""
    merged = dict(data)
    for name, keys in sections.items():
        merged[name] = keys if keys.get("rigid") else data.get(name, {}) | keys
    return {name: _without_none(keys) for name, keys in merged.items()}


def _without_none(keys: Any) -> Any:
    if not isinstance(keys, dict):
        return keys
    return {key: value for key, value in keys.items() if value is not None}


def meshed(sketch: Sketch) -> TaggedMesh:
    """The mesh of a ``sketch``, of this rank alone."""
    return mesh_joint(MPI.COMM_SELF, sketch, radius=1.0)


def named(words: Sequence[str], known: Container[str]) -> tuple[list[str], list[float]]:
    """Of the ``words`` of a command those that are ``known``, and the others as numbers."""
    names = [word for word in words if word in known]
    return names, [float(word) for word in words if word not in known]


def slug(name: str) -> str:
    """``name`` as the name of a folder."""
    return re.sub(r"[^\w.+-]+", "_", name.replace("%", "pc")).strip("_")


def matches(pattern: str, *names: str) -> bool:
    """Whether ``pattern`` (with * and ?) is one of ``names``, or part of one, in any case of
    letters."""
    lower = pattern.lower()
    return any(lower in name.lower() or fnmatch(name.lower(), lower) for name in names)


def side_by_side(
    comm: MPI.Comm, items: Sequence[Item], function: Callable[[Item], Result]
) -> list[Result]:
    """``function`` of every item, in order, the ranks taking turns; the same list on all ranks.
    Collective."""
    parts = comm.allgather([function(item) for item in items[comm.rank :: comm.size]])
    return [parts[k % comm.size][k // comm.size] for k in range(len(items))]


def write_table(
    folder: Path,
    name: str,
    rows: Sequence[Row],
    below: str = "",
    draw: Callable[[Path], object] | None = None,
) -> tuple[str, list[Path]]:
    """`write_report` of a table with a text ``below``; returns the Markdown and the files, nothing
    without rows."""
    if not rows:
        return "", []
    text = Table.of(rows).markdown() + below
    return text, write_report(folder, name, rows, text, draw)

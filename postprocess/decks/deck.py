"""A problem as an input deck for CalculiX, and but for lines that say so for Abaqus: ``archord
export-deck`` and `archord.export_deck`.

The deck is the modelled part: plane elements in unit thickness or, in plane stress, a thin slice;
or axisymmetric elements. Contact acts on the deformed curves by a stiff linear penalty, and there
is one ``*STEP`` per load on the path. A rigid disc is a ring of elements that moves as a whole.
What a force drives hangs on a node of its own, which the force pulls.

CalculiX makes a wedge of two degrees of axisymmetric elements. Its ``*CLOAD`` are forces on the
whole ring, but the forces that it prints, and the stiffness of its springs, are of the wedge: a
180th. (CalculiX CrunchiX 2.20, found with a tube under tension; src/cloads.f divides ``*CLOAD``
by 180. Forces of Abaqus are all of the whole ring.)
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from mpi4py import MPI

from archord.geometry.meshes.formats.source import Mesh
from archord.output.user_file import writing
from archord.postprocess.decks.mesh import DeckMesh, deck_mesh, label
from archord.postprocess.decks.mesh_lines import ALL_NODES, DRIVES, mesh_lines
from archord.postprocess.decks.model import DeckModel
from archord.postprocess.decks.model_lines import model_lines
from archord.postprocess.decks.step_lines import step_lines
from archord.presets.account import account_of
from archord.report.errors import InputError
from archord.scene.file import AnyScene
from archord.solver.path.system import System
from archord.solver.problem import Problem


def system_of(scene: AnyScene, given: Problem | None = None) -> System:
    """The problem of ``scene`` with nodes of quadratic elements, on this rank alone; or the problem
    that was ``given`` from Python, which the scene tells about. Raises `InputError`."""
    analysis = scene.analysis.model_copy(update={"degree": 2})
    scene = scene.model_copy(update={"analysis": analysis})
    if given is not None:
        n_ranks = Mesh.of(given.mesh).n_ranks
        if n_ranks > 1:
            raise InputError(
                f"archord.export_deck: the mesh is on {n_ranks} ranks, and a deck is made from the "
                "whole mesh on one rank: make the mesh on MPI.COMM_SELF, or write the deck without "
                "mpirun."
            )
        given = replace(given, degree=2)
    return account_of(scene, MPI.COMM_SELF, given=given).system


def write_deck(scene: AnyScene, path: Path, name: str, given: Problem | None = None) -> None:
    """Write the deck of ``scene``, or of the problem that was ``given`` from Python, to ``path``;
    messages call it by this ``name``. Raises `InputError`."""
    system = system_of(scene, given)
    heading = f"{Path(name).stem} in {scene.units.length}"
    try:
        text = deck(system, deck_mesh(system), scene.targets, heading)
    except ValueError as error:
        raise InputError(name, f"{error}.") from error
    with writing(path) as new:
        new.write_text(text, encoding="utf-8")


def deck(system: System, mesh: DeckMesh, targets: Sequence[float], heading: str = "") -> str:
    """The input deck of the problem of ``system`` on ``mesh`` with a step to each of the
    ``targets`` on the path. Raises ValueError for what a deck cannot say."""
    _require_labels({*mesh.elements, *mesh.node_sets, *mesh.surfaces}, (ALL_NODES, DRIVES))
    _require_labels({interaction.name for interaction in system.problem.interactions})
    model = DeckModel(system, mesh)
    lines = [*mesh_lines(model, heading), *model_lines(model)]
    for k, target in enumerate(targets, 1):
        lines += step_lines(model, target, first=k == 1, last=k == len(targets))
    return "\n".join(lines) + "\n"


def _require_labels(names: Iterable[str], taken: Sequence[str] = ()) -> None:
    """Raise ValueError where two of the ``names`` have one label, or a label is ``taken``."""
    labels = [*taken, *map(label, names)]
    if len(set(labels)) < len(labels):
        own = f" and from its own {' and '.join(taken)}" if taken else ""
        listed = ", ".join(sorted(names))
        raise ValueError(f"names must differ in more than case and signs for a deck{own}: {listed}")

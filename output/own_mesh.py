"""The mesh of a run that was given from Python: the run folder keeps it, and the run's scene.toml
names it there."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

from archord.geometry.meshes.formats.source import Mesh
from archord.output.files.disk import replace_file
from archord.output.folder import MESH
from archord.scene.file import AnyScene, resolved
from archord.scene.problem import ProblemScene
from archord.solver.problem import Problem

if TYPE_CHECKING:
    from archord.geometry.meshes.mesh_arrays import MeshArrays


def scene_text(scene: AnyScene, folder: Path) -> str:
    """The TOML of ``scene`` in a run's ``folder``: a mesh that lies there is named without it, so
    that it may move."""
    return resolved(scene, folder.absolute() / MESH)


def mesh_in_use(scene: AnyScene, folder: Path) -> str:
    """`MESH` if ``scene`` reads that file of the ``folder``, else nothing."""
    file = scene.mesh.file if isinstance(scene, ProblemScene) else None
    in_use = file is not None and Path(file).resolve() == (folder / MESH).resolve()
    return MESH if in_use else ""


def given_mesh(problem: Problem | None, comm: MPI.Comm) -> MeshArrays | None:
    """The mesh that a ``problem`` from Python has in no file: on rank 0, None elsewhere.
    Collective."""
    if problem is None or problem.mesh_file:
        return None
    return Mesh.of(problem.mesh).plain(comm)


def write_mesh(mesh: MeshArrays, folder: Path) -> None:
    """Write ``mesh`` to the run's ``folder``. Raises `OSError`."""
    from archord.geometry.meshes.stored import store_mesh

    content = io.BytesIO()
    store_mesh(mesh, content)
    replace_file(folder / MESH, content.getvalue())

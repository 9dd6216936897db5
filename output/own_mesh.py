"""The mesh of a run that was given from Python: the run folder keeps it, and the run's scene.toml
names it there."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

from archord.output.files.disk import replace_file
from archord.output.folder import MESH
from archord.scene.file import AnyScene, resolved
from archord.scene.problem import LIVE, ProblemScene

if TYPE_CHECKING:
    from archord.geometry.meshes.plane_mesh import PlaneMesh


def is_given(scene: AnyScene) -> bool:
    """Whether the mesh of ``scene`` was given from Python, and is in no file."""
    return isinstance(scene, ProblemScene) and scene.mesh.file in LIVE


def scene_text(scene: AnyScene, folder: Path) -> str:
    """The TOML of ``scene`` in a run's ``folder``: a mesh that lies there is named without it, so
    that it may move."""
    own = folder.absolute() / MESH
    if is_given(scene):
        mesh = scene.mesh.model_copy(update={"file": str(own)})  # type: ignore[union-attr]
        scene = scene.model_copy(update={"mesh": mesh})
    return resolved(scene, own)


def mesh_in_use(scene: AnyScene, folder: Path) -> str:
    """`MESH` if ``scene`` reads that file of the ``folder``, else nothing."""
    file = scene.mesh.file if isinstance(scene, ProblemScene) else None
    in_use = file is not None and Path(file).resolve() == (folder / MESH).resolve()
    return MESH if in_use else ""


def given_mesh(scene: AnyScene, comm: MPI.Comm) -> PlaneMesh | None:
    """The mesh given from Python, if ``scene`` has one: on rank 0, None elsewhere. Collective."""
    if not isinstance(scene, ProblemScene) or not is_given(scene):
        return None
    from archord.presets.problem import given_mesh as mesh_of

    return mesh_of(scene, comm)


def write_mesh(mesh: PlaneMesh, folder: Path) -> None:
    """Write ``mesh`` to the run's ``folder``. Raises `OSError`."""
    from archord.geometry.meshes.stored import store_mesh

    content = io.BytesIO()
    store_mesh(mesh, content)
    replace_file(folder / MESH, content.getvalue())

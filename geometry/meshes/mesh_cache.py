"""Meshes kept in the user's cache for the next joint of the same shape: to load gmsh and to mesh
takes a fifth of a small solve."""

from __future__ import annotations

import hashlib
import importlib.util
import os
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path

from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.stored import store_mesh, stored_mesh
from archord.kernels.compiled import cache_folder, is_private

_MOST = 100  # meshes kept
_LARGEST = 200_000  # triangles: larger ones take long to solve, and space


def kept_mesh(key: tuple, make: Callable[[], MeshArrays]) -> MeshArrays:
    """The mesh that ``key`` determines: the kept one, or what ``make`` returns.

    A mesh is made where another version of gmsh or of this code made the kept one, where the kept
    one cannot be read, where another user may have written it, and where the environment says
    ``ARCHORD_KEEP_MESHES=0``.
    """
    if os.environ.get("ARCHORD_KEEP_MESHES") == "0":
        return make()
    digest = hashlib.sha256(repr(key).encode() + _makers())
    folder = cache_folder() / "meshes"
    path = folder / f"{digest.hexdigest()[:32]}.mesh"
    with suppress(Exception):  # whatever a damaged file makes of it
        if is_private(folder) and is_private(path):
            mesh = stored_mesh(path)
            os.utime(path)
            return mesh
    mesh = make()
    if len(mesh.cells) <= _LARGEST:
        with suppress(OSError):
            _keep(mesh, path)
    return mesh


@cache
def _makers() -> bytes:
    """A digest of gmsh and of the code that meshes."""
    gmsh = importlib.util.find_spec("gmsh")
    library = Path(gmsh.origin).stat().st_mtime_ns if gmsh and gmsh.origin else 0
    digest = hashlib.sha256(repr(library).encode())
    for source in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.digest()


def _keep(mesh: MeshArrays, path: Path) -> None:
    """Write ``mesh`` to ``path``, and remove the meshes that were not used for longest. Raises
    `OSError`."""
    folder = path.parent
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not is_private(folder):
        return
    new = path.with_suffix(f".{os.getpid()}.mesh")
    new.unlink(missing_ok=True)
    with open(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        store_mesh(mesh, file)
    os.replace(new, path)
    for old in sorted(folder.glob("*.mesh"), key=os.path.getmtime)[:-_MOST]:
        old.unlink()

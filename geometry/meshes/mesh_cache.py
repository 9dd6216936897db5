"""Meshes kept in the user's cache for the next joint of the same shape: to load gmsh and to mesh takes a fifth of a
small solve."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from archord.geometry.meshes.plane_mesh import PlaneMesh
from archord.kernels.compiled import cache_folder

_MOST = 100  # meshes kept
_LARGEST = 200_000  # triangles: larger ones take long to solve, and space


def kept_mesh(key: tuple, make: Callable[[], PlaneMesh]) -> PlaneMesh:
    """The mesh that ``key`` says all about: the kept one, or what ``make`` returns.

    Other versions of gmsh or of the code that meshes make meshes of their own. A mesh that cannot be read or written
    is made, and so are all where the environment says ``ARCHORD_KEEP_MESHES=0``.
    """
    if os.environ.get("ARCHORD_KEEP_MESHES") == "0":
        return make()
    gmsh = importlib.util.find_spec("gmsh")
    library = Path(gmsh.origin).stat().st_mtime_ns if gmsh and gmsh.origin else 0
    sources = [source.read_bytes() for source in sorted(Path(__file__).parents[1].rglob("*.py"))]
    digest = hashlib.sha256(b"".join([repr((key, library)).encode(), *sources])).hexdigest()
    folder = cache_folder() / "meshes"
    path = folder / f"{digest[:32]}.mesh"
    with suppress(Exception):  # whatever a damaged file makes of it
        mesh = pickle.loads(path.read_bytes())
        os.utime(path)
        return mesh
    mesh = make()
    if len(mesh.cells) <= _LARGEST:
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            new = path.with_suffix(f".{os.getpid()}.mesh")
            new.write_bytes(pickle.dumps(mesh))
            os.replace(new, path)
            for old in sorted(folder.glob("*.mesh"), key=os.path.getmtime)[:-_MOST]:
                old.unlink()
    return mesh

"""A force that is spread over cells within a circle, less and less outward."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import basix
import numpy as np

from archord.geometry.basis import Array, cell_basis
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.solver.loads import LOAD_DEGREE

_FEWEST = 6  # integration points in a core: half the points of a triangle


def core_density(centre: Sequence[float], radius: float) -> Callable[[Array], Array]:
    """Density of a force, as `DeadLoad` takes it: a paraboloid within a circle."""

    def density(x: Array) -> Array:
        squares = sum((at - middle) ** 2 for at, middle in zip(x, centre, strict=True))
        return np.maximum(1 - squares / radius**2, 0)

    return density


def require_core(
    mesh: TaggedMesh, cells: str, centre: Sequence[float], radius: float, key: str
) -> None:
    """Raise ValueError, which names the ``key`` of the radius, where the circle has so few
    integration points of these ``cells`` that the force on it is not what `core_density` says.
    Collective."""
    owned = mesh.mesh.topology.index_map(mesh.dimension).size_local
    inside = np.unique(mesh.cells_in(cells))
    X, _ = basix.make_quadrature(mesh.mesh.basix_cell(), LOAD_DEGREE)
    place = cell_basis(mesh.mesh, 1, inside[inside < owned], X).point
    apart = np.linalg.norm(place - np.asarray(centre), axis=2)
    found = mesh.mesh.comm.allreduce(int((apart < radius).sum()))
    if found < _FEWEST:
        raise ValueError(
            f"{key} = {radius:g} about {tuple(centre)} has {found} integration points of the cells "
            f"{cells!r}, and must have {_FEWEST}: choose a larger radius, smaller elements there, "
            "or a centre within these cells"
        )

"""Boxes of tetrahedra and hexahedra, and their materials, for tests in space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from dolfinx.mesh import CellType, create_box, locate_entities_boundary, meshtags
from mpi4py import MPI

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.elasticity import Elastic
from archord.materials.finite import LargeStrain
from archord.materials.hardening import LinearHardening, VoceHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematic import KinematicMaterial

E = 210e3
NU = 0.3
MATERIALS = {
    "elastic": Elastic(E, NU),
    "linear": J2Material(E, NU, hardening=LinearHardening(300.0, 0.01 * E)),
    "Voce": J2Material(E, NU, hardening=VoceHardening(300.0, 400.0, 20.0)),
    "back stress": KinematicMaterial(
        E, NU, hardening=LinearHardening(300.0), back_stresses=((20e3, 0.0),)
    ),
}
KINDS = pytest.mark.parametrize(
    "kind", [CellType.tetrahedron, CellType.hexahedron], ids=["tetrahedra", "hexahedra"]
)
LARGE = {f"{name}, large": LargeStrain(material) for name, material in MATERIALS.items()}
small_and_large = pytest.mark.parametrize(
    "material", [*MATERIALS.values(), *LARGE.values()], ids=[*MATERIALS, *LARGE]
)
every_material = pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
SIDES = ("x0", "x1", "y0", "y1", "z0", "z1")  # of a box, by the axis, at its beginning and its end


def box(
    comm: MPI.Comm,
    cells: Sequence[int] = (2, 2, 2),
    size: Sequence[float] = (1.0, 1.0, 1.0),
    kind: CellType = CellType.tetrahedron,
) -> TaggedMesh:
    """The body "box" of one ``size`` from the origin, in so many ``cells``, with its six sides."""
    mesh = create_box(comm, [np.zeros(3), np.array(size)], list(cells), kind)
    topology = mesh.topology
    index_map = topology.index_map(3)
    every = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    of_cells = meshtags(mesh, 3, every, np.ones_like(every))
    on_side = [
        locate_entities_boundary(mesh, 2, lambda x, a=axis, e=end: np.isclose(x[a], e * size[a]))
        for axis in range(3)
        for end in (0, 1)
    ]
    facets = np.concatenate(on_side)
    tags = np.repeat(np.arange(1, 7, dtype=np.int32), [len(side) for side in on_side])
    order = np.argsort(facets)
    of_facets = meshtags(mesh, 2, facets[order], tags[order])
    sets = {name: (k,) for k, name in enumerate(SIDES, 1)}
    return TaggedMesh(mesh, of_cells, of_facets, {"box": (1,)}, sets)

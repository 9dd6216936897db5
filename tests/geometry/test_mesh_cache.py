"""Kept meshes: the same to the last bit as new ones, on any number of ranks, told apart by all that shapes them."""

import numpy as np
import pytest

from archord.geometry import mesh_cache
from archord.geometry.half_ring import half_ring
from archord.geometry.mesh_cache import MeshCache
from archord.geometry.quarter_joint import quarter_joint
from archord.geometry.tagged_mesh import TaggedMesh

QUARTER = {"radius": 2.0, "clearance": 0.02, "block_size": 20.0, "element_size": 0.6, "growth": 1.0}
RING = {"radius": 2.0, "clearance": 0.02, "outer_radius": 20.0, "element_size": 0.6, "growth": 1.0, "core_radius": 0.2}


@pytest.fixture
def meshes(monkeypatch) -> MeshCache:
    """A cache of its own for a test, with room for two."""
    cache = MeshCache(2)
    monkeypatch.setattr("archord.geometry.fenicsx.MESHES", cache)
    return cache


def content(model: TaggedMesh) -> list[np.ndarray]:
    mesh = model.mesh
    tags = [array for tag in (model.cells, model.facets) for array in (tag.indices, tag.values)]
    return [mesh.geometry.x, mesh.geometry.dofmap, mesh.topology.connectivity(2, 0).array, *tags]


@pytest.mark.mpi
@pytest.mark.parametrize(("make", "sizes"), [(quarter_joint, QUARTER), (half_ring, RING)])
@pytest.mark.parametrize("degree", [2, 3])
def test_a_kept_mesh_is_the_one_made_anew(comm, meshes, make, sizes, degree):
    """Every array of it, twice over, as dolfinx may have worked in what it was given; on rank 0 gmsh ran once. Nothing
    is kept unless asked."""
    assert mesh_cache.MESHES.capacity == meshes.made == 0
    meshes.capacity = 0
    anew = content(make(comm, **sizes, degree=degree))
    assert (meshes.made, meshes.reused) == (0, 0)
    meshes.capacity = 2
    for _ in range(3):
        for a, b in zip(anew, content(make(comm, **sizes, degree=degree)), strict=True):
            assert (a == b).all()
    assert (meshes.made, meshes.reused) == ((1, 2) if comm.rank == 0 else (0, 0))


def test_the_size_of_a_joint_does_not_matter_but_all_its_ratios_do(comm, meshes):
    """In other units it is the same mesh; any other shape or size of elements is another."""
    meshes.capacity = 100
    first = quarter_joint(comm, **QUARTER).mesh.geometry.x
    twice = quarter_joint(comm, **{k: 2 * v if k != "growth" else v for k, v in QUARTER.items()}).mesh.geometry.x
    assert (twice == 2 * first).all()
    assert (meshes.made, meshes.reused) == (1, 1)
    for key in ("clearance", "block_size", "element_size", "growth"):
        quarter_joint(comm, **(QUARTER | {key: 1.1 * QUARTER[key]}))
    for options in (
        {"size_ratio": 0.9},
        {"degree": 3},
        {"edge": (1.0, 0.3)},
        {"edge": (1.0, 0.2)},
        {"rigid_pin": True},
    ):
        quarter_joint(comm, **QUARTER, **options)
    for key in RING:
        half_ring(comm, **(RING | {key: 1.1 * RING[key]}))
    assert (meshes.made, meshes.reused) == (16, 1)


def test_the_mesh_not_used_for_longest_is_forgotten(comm, meshes):
    sizes = [QUARTER | {"element_size": size} for size in (0.6, 0.7, 0.8)]
    made = []
    for number in (0, 1, 0, 2, 0, 1):
        before = meshes.made
        quarter_joint(comm, **sizes[number])
        made.append(meshes.made > before)
    assert made == [True, True, False, True, False, True]

"""Kept meshes: the same to the last bit as new ones, on any number of ranks, told apart by all that
shapes them."""

import pickle
import time

import numpy as np
import pytest

from archord.geometry.meshes import fenicsx, mesh_cache
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.pin_in_block import half_ring, quarter_joint

QUARTER = {"radius": 2.0, "clearance": 0.02, "block_size": 20.0, "element_size": 0.6, "growth": 1.0}
RING = {
    "radius": 2.0,
    "clearance": 0.02,
    "outer_radius": 20.0,
    "element_size": 0.6,
    "growth": 1.0,
    "core_radius": 0.2,
}


@pytest.fixture
def made(monkeypatch, tmp_path) -> list[tuple]:
    """A cache of its own for a test; what gmsh made on this rank."""
    made = []
    make = fenicsx._made
    monkeypatch.setattr(mesh_cache, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(fenicsx, "_made", lambda *drawn: made.append(drawn) or make(*drawn))
    return made


def content(model: TaggedMesh) -> list[np.ndarray]:
    mesh = model.mesh
    tags = [array for tag in (model.cells, model.facets) for array in (tag.indices, tag.values)]
    return [mesh.geometry.x, mesh.geometry.dofmap, mesh.topology.connectivity(2, 0).array, *tags]


@pytest.mark.mpi
@pytest.mark.parametrize(("mesh", "sizes"), [(quarter_joint, QUARTER), (half_ring, RING)])
@pytest.mark.parametrize("degree", [2, 3])
def test_a_kept_mesh_is_the_one_that_was_made(comm, made, monkeypatch, mesh, sizes, degree):
    """Every array and name of it; on rank 0 gmsh ran once, and each time where no mesh is to be
    kept."""
    monkeypatch.setenv("ARCHORD_KEEP_MESHES", "0")
    first = mesh(comm, **sizes, degree=degree)
    mesh(comm, **sizes, degree=degree)
    assert len(made) == (2 if comm.rank == 0 else 0)
    monkeypatch.delenv("ARCHORD_KEEP_MESHES")
    for _ in range(3):
        kept = mesh(comm, **sizes, degree=degree)
        assert (kept.cell_sets, kept.facet_sets) == (first.cell_sets, first.facet_sets)
        for a, b in zip(content(first), content(kept), strict=True):
            assert (a == b).all()
    assert len(made) == (3 if comm.rank == 0 else 0)


def test_the_size_of_a_joint_does_not_matter_but_all_its_ratios_do(comm, made):
    """In other units it is the same mesh; any other shape or size of elements is another."""
    first = quarter_joint(comm, **QUARTER).mesh.geometry.x
    twice = quarter_joint(
        comm, **{k: 2 * v if k != "growth" else v for k, v in QUARTER.items()}
    ).mesh.geometry.x
    assert (twice == 2 * first).all()
    assert len(made) == 1
    for key in ("clearance", "block_size", "element_size", "growth"):
        quarter_joint(comm, **(QUARTER | {key: 1.1 * QUARTER[key]}))
    for option, values in {
        "size_ratio": [0.9],
        "degree": [3],
        "edge": [(1, 0.3), (1, 0.2)],
        "rigid_pin": [True],
    }.items():
        for value in values:
            quarter_joint(comm, **QUARTER, **{option: value})
    for key in RING:
        half_ring(comm, **(RING | {key: 1.1 * RING[key]}))
    assert len(made) == 16


def test_the_mesh_not_used_for_longest_is_forgotten(comm, made, monkeypatch):
    monkeypatch.setattr(mesh_cache, "_MOST", 2)
    gmsh_ran = []
    for size in (0.6, 0.7, 0.6, 0.8, 0.6, 0.7):
        calls = len(made)
        quarter_joint(comm, **(QUARTER | {"element_size": size}))
        gmsh_ran.append(len(made) > calls)
        time.sleep(0.01)  # for a clock that tells these calls apart
    assert gmsh_ran == [True, True, False, True, False, True]


@pytest.mark.parametrize(
    "spoil",
    [lambda path: path.write_bytes(b"x"), lambda path: path.write_bytes(path.read_bytes()[:300])],
)
def test_a_file_that_is_no_mesh_is_made_again(comm, made, tmp_path, spoil):
    first = content(quarter_joint(comm, **QUARTER))
    (path,) = tmp_path.glob("meshes/*.mesh")
    spoil(path)
    for a, b in zip(first, content(quarter_joint(comm, **QUARTER)), strict=True):
        assert (a == b).all()
    assert len(made) == 2


class Planted:
    """A pickle that runs something when it is read."""

    def __reduce__(self):
        return pytest.fail, ("a pickle of the cache was run",)


@pytest.mark.parametrize("mode", [0o600, 0o666])
def test_nothing_in_the_cache_is_run(comm, made, tmp_path, mode):
    """A planted pickle is no mesh; a mesh that others may write is made again, and kept for this
    user alone."""
    first = content(quarter_joint(comm, **QUARTER))
    (path,) = tmp_path.glob("meshes/*.mesh")
    if mode == 0o600:
        path.write_bytes(pickle.dumps(Planted()))
    path.chmod(mode)
    for a, b in zip(first, content(quarter_joint(comm, **QUARTER)), strict=True):
        assert (a == b).all()
    assert len(made) == 2
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_folder_of_others_is_not_used(comm, made, tmp_path):
    quarter_joint(comm, **QUARTER)
    (tmp_path / "meshes").chmod(0o777)
    quarter_joint(comm, **QUARTER)
    assert len(made) == 2


def test_a_folder_that_cannot_be_written_keeps_nothing(comm, made, tmp_path):
    (tmp_path / "meshes").write_text("a file in its place")
    for _ in range(2):
        quarter_joint(comm, **QUARTER)
    assert len(made) == 2

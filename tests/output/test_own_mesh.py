"""A run of a mesh given from Python: its folder holds all that it takes to go on, and to solve it
again."""

import json
import shutil
import signal
from dataclasses import replace

import basix.ufl
import numpy as np
import pytest
from dolfinx.mesh import create_mesh, create_unit_square, locate_entities_boundary, meshtags
from mpi4py import MPI

import archord
from archord.commands.progress import Progress
from archord.geometry.basis import TRIANGLE
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.formats.read import read_mesh, tagged
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.stored import store_mesh, stored_mesh

CURVED = np.array(
    [[0, 0], [1, 0], [0, 1], [0.55, 0.6], [0, 0.5], [0.5, 0], [1, 1], [0.45, 1], [1, 0.55]],
    dtype=float,
)


def square(comm):
    """Squares of triangles with tags of its left (3) and right (8) side."""
    mesh = create_unit_square(comm, 4, 4)
    sides = [
        locate_entities_boundary(mesh, 1, lambda x, at=at: np.isclose(x[0], at)) for at in (0, 1)
    ]
    facets = np.concatenate(sides)
    order = np.argsort(np.concatenate(sides))
    values = np.repeat([3, 8], [len(side) for side in sides]).astype(np.int32)
    every = np.arange(
        mesh.topology.index_map(2).size_local + mesh.topology.index_map(2).num_ghosts,
        dtype=np.int32,
    )
    return (
        mesh,
        meshtags(mesh, 2, every, np.ones_like(every)),
        meshtags(mesh, 1, facets[order], values[order]),
    )


def problem(mesh, **changes):
    lead = archord.J2Material(1000.0, 0.3, "strain", archord.LinearHardening(5.0, 10.0))
    return archord.Problem(
        mesh,
        bodies=[archord.Body("plate", lead, cells="1")],
        supports=[archord.Support("clamp", on="3")],
        loads=[archord.Load("pull", on="8", direction="x", displacement=[0.02, 0.0])],
        **({"steps": [3, 1]} | changes),
    )


def forces(folder):
    return archord.load(folder).columns["pull force"]


@pytest.mark.mpi
@pytest.mark.parametrize("keys", [{}, {"scale": 2.0, "order": 2, "refine": 1}])
def test_the_run_goes_on_and_is_solved_again_from_its_folder(comm, tmp_path, keys):
    """To the same numbers, also elsewhere, and into the folder itself."""
    folder = comm.bcast(tmp_path)
    first = archord.solve(problem(archord.Mesh(square(comm), **keys)), folder / "first", comm=comm)
    said = (first.folder / "scene.toml").read_text()
    assert 'file = "mesh.npz"' in said
    expected = forces(first.folder)
    comm.barrier()
    if comm.rank == 0:
        shutil.move(folder / "first", folder / "moved")
    comm.barrier()
    again = archord.solve(folder / "moved" / "scene.toml", folder / "again", comm=comm)
    assert again.columns["pull force"] == pytest.approx(expected, rel=1e-10)
    assert not (folder / "again" / "mesh.npz").exists()
    into_itself = archord.solve(
        folder / "moved" / "scene.toml", folder / "moved", force=True, comm=comm
    )
    assert into_itself.columns["pull force"] == pytest.approx(expected, rel=1e-10)
    assert (folder / "moved" / "mesh.npz").exists()
    assert (folder / "moved" / "scene.toml").read_text() == said


def interrupted(problem, folder, monkeypatch, step):
    """A run of ``problem`` that Ctrl-C ends after this ``step``."""

    def stop(self, m):
        if m.step == step:
            signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(Progress, "step", stop)
        with pytest.raises(KeyboardInterrupt):
            archord.solve(problem, folder)


def test_the_run_is_extended_and_restarted(tmp_path, monkeypatch):
    """A run moved after two of its steps goes on as if nothing had been, with the problem and with
    what its folder tells of it."""
    stated = problem(square(MPI.COMM_SELF))
    whole = forces(archord.solve(stated, tmp_path / "whole").folder)
    interrupted(stated, tmp_path / "short", monkeypatch, 2)
    shutil.move(tmp_path / "short", tmp_path / "moved")
    shutil.copytree(tmp_path / "moved", tmp_path / "words")
    problem_again = problem(square(MPI.COMM_SELF))
    words = archord.load_scene(tmp_path / "words" / "scene.toml")
    for folder, given in (("moved", problem_again), ("words", words)):
        run = archord.solve(given, tmp_path / folder, restart=True)
        assert forces(run.folder) == pytest.approx(whole, rel=1e-10)
        assert run.summary["restarts"][0]["after_step"] == 2
        assert run.status == "done"
    with pytest.raises(archord.InputError, match="only"):
        archord.solve(problem(square(MPI.COMM_SELF), tolerance=1e-6), run.folder, restart=True)


def test_a_stored_mesh_is_the_mesh_to_the_last_bit(tmp_path):
    """Curved cells, the names of sets in their order, points."""
    cells = np.array([[0, 1, 2, 3, 4, 5], [1, 6, 2, 7, 3, 8]])
    sets = {"b": np.array([1]), "a": np.array([0]), "both": np.array([0, 1])}
    made = MeshArrays.of_sets(
        TRIANGLE,
        CURVED,
        cells,
        sets,
        {"z": np.array([[0, 1]]), "é": np.array([[0, 2]])},
        {"p": np.array([6])},
    )
    with (tmp_path / "mesh.npz").open("wb") as file:
        store_mesh(made, file)
    found = stored_mesh(tmp_path / "mesh.npz")
    for name in ("x", "cells", "bodies", "facets", "tags"):
        np.testing.assert_array_equal(getattr(found, name), getattr(made, name))
    assert list(found.cell_sets.items()) == list(made.cell_sets.items())
    assert list(found.facet_sets.items()) == list(made.facet_sets.items())
    assert found.point_sets["p"].tolist() == made.point_sets["p"].tolist()
    assert gathered(read_mesh(tmp_path / "mesh.npz", MPI.COMM_SELF)).x.tolist() == made.x.tolist()


@pytest.mark.mpi
def test_curved_meshes_of_dolfinx_stay_curved(comm, tmp_path):
    folder = comm.bcast(tmp_path)
    element = basix.ufl.element("P", "triangle", 2, shape=(2,))
    cells = (
        np.array([[0, 1, 2, 3, 4, 5], [1, 6, 2, 7, 3, 8]])
        if comm.rank == 0
        else np.zeros((0, 6), dtype=int)
    )
    mesh = create_mesh(comm, cells=cells, x=CURVED if comm.rank == 0 else CURVED[:0], e=element)
    whole = gathered(tagged(mesh))
    if comm.rank == 0:
        with (folder / "mesh.npz").open("wb") as file:
            store_mesh(whole, file)
        assert sorted(map(tuple, stored_mesh(folder / "mesh.npz").x)) == sorted(map(tuple, CURVED))


def test_a_mesh_of_archord_0_2_is_read(tmp_path):
    """Its file does not name the kind of its cells."""
    cells = np.array([[0, 1, 2, 3, 4, 5], [1, 6, 2, 7, 3, 8]])
    path = tmp_path / "mesh.npz"
    made = MeshArrays.of_sets(TRIANGLE, CURVED, cells, {}, {"z": np.array([[0, 1]])}, {})
    with path.open("wb") as file:
        store_mesh(made, file)
    arrays = dict(np.load(path))
    words = json.loads(arrays["sets"].tobytes())
    assert words.pop("kind") == "triangle"
    sets = np.frombuffer(json.dumps(words).encode(), dtype=np.uint8)
    np.savez(path, **(arrays | {"sets": sets}))
    assert stored_mesh(path).kind == TRIANGLE
    assert stored_mesh(path).facets.tolist() == made.facets.tolist()


@pytest.mark.parametrize("name", ["x", "cells", "edges", "tags", "bodies", "sets"])
def test_a_damaged_mesh_is_refused(tmp_path, name):
    cells = np.array([[0, 1, 2, 3, 4, 5], [1, 6, 2, 7, 3, 8]])
    path = tmp_path / "mesh.npz"
    with path.open("wb") as file:
        store_mesh(
            MeshArrays.of_sets(TRIANGLE, CURVED, cells, {}, {"z": np.array([[0, 1]])}, {}), file
        )
    arrays = dict(np.load(path))
    lowered = [] if name in ("tags", "bodies") else [arrays[name] * 0 - 1]
    for wrong in (arrays[name][:-1], arrays[name].astype(complex), *lowered):
        np.savez(path, **(arrays | {name: wrong}))
        with pytest.raises(ValueError, match=str(path)):
            read_mesh(path, MPI.COMM_SELF)


@pytest.mark.parametrize("kind", ["rectangles", "boxes"])
def test_a_run_of_a_file_named_from_the_current_folder_goes_on(tmp_path, monkeypatch, kind):
    """Its scene names the file wherever the run folder is; in a plane and in space."""
    monkeypatch.chdir(tmp_path)
    place = (0.0, 0.0, 2.0, 1.0) if kind == "rectangles" else (0.0, 0.0, 0.0, 2.0, 1.0, 1.0)
    mesh = getattr(archord, kind)({"bar": place}, 1.0, comm=MPI.COMM_SELF)
    with open("bar.npz", "wb") as file:
        store_mesh(gathered(mesh), file)

    def pulled(*displacement):
        return archord.Problem(
            "bar.npz",
            bodies=[archord.Body("bar", archord.Elastic(210e3, 0.3))],
            supports=[archord.Support("bar left")],
            loads=[archord.Load("pull", "bar right", "x", displacement=displacement)],
            steps=2,
        )

    archord.solve(pulled(0.01), "run")
    run = archord.solve(pulled(0.01, 0.02), "run", restart=True)
    assert len(forces("run")) == 2 * 2
    assert run.status == "done"
    assert archord.load_scene("run/scene.toml").mesh.file == str(tmp_path / "bar.npz")


def test_other_sets_of_the_same_mesh_do_not_continue_a_run(tmp_path):
    """The same triangles, held and pulled at the other sides: cells and coordinates are equal."""
    mesh, cells, facets = square(MPI.COMM_SELF)
    other = meshtags(mesh, 1, facets.indices, np.where(facets.values == 3, 8, 3).astype(np.int32))
    archord.solve(problem((mesh, cells, facets)), tmp_path / "run")
    pull = archord.Load("pull", on="8", direction="x", displacement=[0.02, 0.0, 0.01])

    def longer(tags):
        return replace(problem((mesh, cells, tags), steps=[3, 1, 1]), loads=[pull])

    with pytest.raises(archord.InputError, match="its sets differ, so that the run cannot be"):
        archord.solve(longer(other), tmp_path / "run", restart=True)
    assert archord.solve(longer(facets), tmp_path / "run", restart=True).steps == 5


def test_a_finished_run_is_not_taken_for_one_on_another_mesh(tmp_path):
    """A block of height 2 under 2 % has 20 MPa; the run on it told 20 MPa of height 2.5, too."""

    def pressed(height):
        block = {"block": (0.0, 0.0, 4.0, height)}
        return archord.Problem(
            archord.rectangles(block, 1.0, MPI.COMM_SELF),
            bodies=[archord.Body("block", archord.Elastic(1000.0, 0.0))],
            supports=[archord.Support("block bottom")],
            loads=[archord.Load("press", "block top", "y", displacement=-0.04)],
            steps=1,
        )

    run = archord.solve(pressed(2.0), tmp_path / "run")
    before = (run.folder / "run.json").read_bytes()
    assert archord.solve(pressed(2.0), run.folder, restart=True).status == "done"
    with pytest.raises(archord.InputError, match="belongs to another mesh"):
        archord.solve(pressed(2.5), run.folder, restart=True)
    assert (run.folder / "run.json").read_bytes() == before

"""fields.vtkhdf, read by VTK's own reader: every step, on the curves and with the values of the
run."""

import os

import h5py
import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.output.files import vtkhdf
from archord.output.files.vtkhdf import LAGRANGE, VERTEX, Grid, VtkHdf, times
from archord.output.run import solve_scene
from archord.postprocess.run import Run
from archord.scene.errors import InputError
from tests.output.test_step_file import file_size_limit
from tests.output.vtk_reader import VtkFile, only
from tests.solver.solving import scene

X = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.6, 0.6], [0, 0.5]])
GRID = Grid(
    np.pad(X, ((0, 0), (0, 1))), [(LAGRANGE[3], np.arange(6)[None]), (VERTEX, np.array([[4]]))]
)


def values(step: int) -> dict[str, np.ndarray]:
    random = np.random.default_rng(step)
    return {
        "PointData/u": random.normal(size=(6, 3)),
        "CellData/stress": random.normal(size=(2, 6)),
    }


def holds(path, at: list[float], steps: list[int]) -> None:
    """The arrays of ``steps`` at the times ``at``, read by VTK."""
    file = VtkFile(path)
    assert file.times == pytest.approx(at)
    for k, step in enumerate(steps, 1):
        grid = file.at(k)
        for name, array in values(step).items():
            np.testing.assert_array_equal(grid[name.partition("/")[2]], array)
    assert not list(path.parent.glob("*.new"))


def test_steps_are_kept_and_continued(tmp_path):
    """With room to spare, after fewer steps than are there, with more or too little room; the
    length is that of it all from the first step on, on a disk that holds little of it."""
    path, loads = tmp_path / "x.vtkhdf", [0.1, 0.2, 0.3, 0.4]
    file = VtkHdf(path, GRID, 5000)
    for k in (1, 2, 3):
        file.write(loads[:k], values(k))
        holds(path, loads[:k], [1, 2, 3][:k])
    assert path.stat().st_blocks * 512 < path.stat().st_size / 4
    VtkHdf(path, GRID, 2).write([0.1, 0.2, 0.5], values(7))
    holds(path, [0.1, 0.2, 0.5], [1, 2, 7])
    again = VtkHdf(path, GRID, 9)
    again.write([1, 2, 3, 4], values(4))
    size = path.stat().st_size
    again.end()
    assert path.stat().st_size < size
    holds(path, [1, 2, 3, 4], [1, 2, 7, 4])


@pytest.mark.parametrize("total", [3, 3000])
def test_a_step_counts_by_one_write_within_a_page(tmp_path, total, monkeypatch):
    """Cut off after any of its writes, the file holds the steps before; after the last one this
    step."""
    path, put, written = tmp_path / "x.vtkhdf", vtkhdf._put, []
    file = VtkHdf(path, GRID, total)
    file.write([0.5], values(1))

    def watched(to, place, content):
        holds(path, [0.5], [1])
        put(to, place, content)
        written.append((int(place), len(memoryview(content).cast("B"))))

    monkeypatch.setattr(vtkhdf, "_put", watched)
    file.write([0.5, 0.7], values(2))
    holds(path, [0.5, 0.7], [1, 2])
    place, length = written[-1]
    assert place // 4096 == (place + length) // 4096 == 0
    assert len(written) <= 4


def test_a_full_disk_costs_the_step_in_progress(tmp_path):
    """The error names the file, which stays as it was."""
    path = tmp_path / "x.vtkhdf"
    with file_size_limit(10_000), pytest.raises(OSError, match=r"x\.vtkhdf"):
        VtkHdf(path, GRID, 5000).write([0.1], values(1))
    assert not list(tmp_path.iterdir())
    file = VtkHdf(path, GRID, 2)
    file.write([0.1], values(1))
    with (
        file_size_limit(file._places["PointData/u"] + 200),
        pytest.raises(OSError, match=r"x\.vtkhdf"),
    ):
        file.write([0.1, 0.2], values(2))
    holds(path, [0.1], [1])


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda path: path.unlink(), "is missing or damaged"),
        (lambda path: os.truncate(path, 3000), "is missing or damaged"),
        (
            lambda path: VtkHdf(path, GRID, 1).write([0.1], values(1)),
            "does not hold the first 2 steps",
        ),
        (
            lambda path: VtkHdf(path, Grid(X, GRID.cells[:1]), 2).write([1], values(1)),
            "does not hold the first 2",
        ),
    ],
)
def test_a_file_that_cannot_go_on_is_refused(tmp_path, damage, said):
    """Missing, cut short, fewer steps, another grid; nothing is left behind."""
    path = tmp_path / "x.vtkhdf"
    file = VtkHdf(path, GRID, 3)
    for k in (1, 2):
        file.write([0.1, 0.2][:k], values(k))
    damage(path)
    with pytest.raises(InputError, match=rf"x\.vtkhdf: .*{said}"):
        VtkHdf(path, GRID, 3).write([0.1, 0.2, 0.3], values(3))
    assert not list(tmp_path.glob("*.new"))


def test_times_are_numbers_of_steps_where_loads_do_not_only_grow():
    """As in XDMF."""
    assert times([0.1, 0.2]) == [0.1, 0.2]
    assert times([0.1, 0.2, 0.2]) == [1.0, 2.0, 3.0]


@pytest.fixture(scope="module", params=[2, 3])
def run(request, tmp_path_factory):
    """A plastic joint under forces, with everything written, of second and third degree."""
    folder = tmp_path_factory.mktemp(f"degree{request.param}")
    load = {"displacement": None, "relative_force": [0.002, 0.004], "steps": 1}
    joint = scene(
        0.25,
        2,
        yield_stress=0.002,
        analysis={"degree": request.param},
        load=load,
        output={"fields": "points"},
    )
    assert solve_scene(joint, folder, MPI.COMM_SELF).status == "done"
    return Run(folder)


def test_bodies_are_lagrange_cells_of_the_displacements_degree(run):
    """Every step at its delta, though the load is a force; curved areas, and the values of
    fields.h5."""
    file, degree = VtkFile(run.folder / "fields.vtkhdf"), run.scene.analysis.degree
    assert file.times == pytest.approx(run.columns["delta"], rel=1e-12)
    grid, fields = file.at(2), run.fields(2)
    bodies = only(grid, 2)
    assert set(bodies.celltypes) == {69}
    assert len(bodies.cell_connectivity) == len(fields.cells) * (degree + 1) * (degree + 2) // 2
    np.testing.assert_array_equal(bodies.cell_data["body"], fields.body)
    for name in ("von_mises", "mean_stress", "peeq", "contact_pressure", "contact_state"):
        np.testing.assert_array_equal(bodies.cell_data[name], getattr(fields, name))
    first = bodies.cell_connectivity.reshape(bodies.n_cells, -1)[:, :3]
    vertices = fields.cells[:, :3]
    np.testing.assert_allclose(
        bodies.points[first][..., :2], fields.coordinates[vertices], atol=1e-15
    )
    np.testing.assert_allclose(
        bodies["displacement"][first][..., :2], fields.displacement[vertices], atol=1e-15
    )
    for name, values in (("stress", fields.stress), ("plastic_strain", fields.plastic_strain)):
        np.testing.assert_allclose(
            bodies.point_data[name][first][..., :4], values[vertices], atol=1e-15
        )
        assert not bodies.point_data[name][:, 4:].any()
    np.testing.assert_allclose(
        bodies.point_data["peeq"][first], fields.peeq_nodal[vertices], atol=1e-15
    )
    pin = bodies.extract_cells(np.flatnonzero(fields.body == 1)).extract_surface(
        nonlinear_subdivision=3
    )
    area = pin.triangulate().compute_cell_sizes()["Area"].sum()
    assert area == pytest.approx(np.pi / 4, rel=3e-3 if degree == 2 else 1e-3)
    on_hole = np.abs(np.hypot(*bodies.points[:, :2].T) - 1 - run.scene.joint.dR) < 1e-6
    assert on_hole.sum() >= 6 * degree + 1  # all nodes of the curved edges


def test_contact_pressure_is_a_field_on_the_edge(run):
    """Lines along the facets have the mean pressures, which add up to the force; so do the values
    of the nodes."""
    grid = VtkFile(run.folder / "fields.vtkhdf").at(2)
    lines, degree = only(grid, 1), run.scene.analysis.degree
    x = lines.points[lines.cell_connectivity.reshape(lines.n_cells, degree + 1)][..., :2]
    for name, arc in run.contact(2).items():
        mine = lines.cell_data["body"] == run.bodies[{"pin": "pin", "hole": "block"}[name]]
        assert mine.sum() == len(arc.weight)
        means = lines.cell_data["contact_pressure"][mine]
        np.testing.assert_allclose(np.sort(means), np.sort(arc.facet_force / arc.width), rtol=1e-9)
        ends = lines.cell_connectivity.reshape(lines.n_cells, -1)[mine][:, :2]
        nodal = lines.point_data["contact_pressure"][ends]
        assert nodal.max() == pytest.approx(arc.pressure.max(), rel=0.1)
        chord = x[mine][:, 1] - x[mine][:, 0]
        upward = nodal.mean(axis=1) @ np.abs(chord[:, 0])
        assert 2 * upward == pytest.approx(run.columns["P"][1], rel=0.05)


def test_integration_points_are_vertices_with_their_values(run):
    """Where they are, moved as the cells around; stress and PEEQ as the solver has them."""
    grid, points = VtkFile(run.folder / "fields.vtkhdf").at(2), run.points(2)
    vertices, bodies = only(grid, 0), only(grid, 2)
    np.testing.assert_array_equal(vertices.points[:, :2], points["coordinates"].reshape(-1, 2))
    for data in (vertices.point_data, vertices.cell_data):
        np.testing.assert_array_equal(data["stress"][:, :4], points["stress"].reshape(-1, 4))
        np.testing.assert_array_equal(data["peeq"], points["peeq"].ravel())
    u = vertices["displacement"][:, :2].reshape(bodies.n_cells, -1, 2).mean(axis=1)
    around = bodies["displacement"][bodies.cell_connectivity.reshape(bodies.n_cells, -1)][..., :2]
    assert (u >= around.min(axis=1) - 1e-5).all()
    assert (u <= around.max(axis=1) + 1e-5).all()


def test_keys_of_older_scenes_mean_the_same():
    """stress and points, which fields has taken the place of; together with it they are unknown."""

    def level(**output):
        return scene(0.25, 1, output=output).output.fields

    assert [level(), level(fields=True), level(fields=False), level(stress=True)] == [
        "cells",
        "cells",
        False,
        "nodes",
    ]
    assert [level(points=True), level(stress=False, points=False, fields=True)] == [
        "points",
        "cells",
    ]
    with pytest.raises(
        archord.InputError, match=r"output\.stress = true is not a known key; .*fields"
    ):
        level(fields="cells", stress=True)
    with pytest.raises(
        archord.InputError,
        match=r"output\.fields = \"all\" must be false, 'cells', 'nodes' or 'points'",
    ):
        level(fields="all")


@pytest.mark.mpi
def test_the_file_does_not_depend_on_the_ranks(comm, tmp_path_factory):
    """Grid and values of a run on all ranks and on one."""
    folders = [
        comm.bcast(tmp_path_factory.mktemp("run") if comm.rank == 0 else None) for _ in range(2)
    ]
    for folder, c in zip(folders, (comm, MPI.COMM_SELF), strict=True):
        if c == comm or comm.rank == 0:
            solve_scene(scene(0.25, 1, output={"fields": "points"}), folder, c)
    if comm.rank == 0:
        whole, alone = (h5py.File(folder / "fields.vtkhdf")["VTKHDF"] for folder in folders)
        for name in (
            "Points",
            "Connectivity",
            "Types",
            "PointData/contact_pressure",
            "CellData/stress",
        ):
            np.testing.assert_allclose(
                whole[name], alone[name], atol=1e-9 * np.abs(alone[name]).max()
            )

"""Exported .vtkhdf files, read by VTK's own reader: every step, on the curves and with the values
of the run."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.cli import run as command
from archord.output.files.step_file import times
from archord.output.files.vtkhdf import SECOND_ORDER, Grid, write_vtkhdf
from archord.output.run import solve_scene
from archord.postprocess.export import export_vtk
from archord.postprocess.run import Run
from tests.output.test_step_file import file_size_limit
from tests.postprocess.vtk_reader import VtkFile
from tests.solver.solving import scene

X = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.6, 0.6], [0, 0.5], [1, 1], [1, 0.5], [0.5, 1]])
CELLS = np.array([[0, 1, 2, 3, 4, 5], [1, 6, 2, 7, 8, 4]])
GRID = Grid(
    np.pad(X, ((0, 0), (0, 1))), CELLS, SECOND_ORDER[6], {"CellData/body": np.array([1, 2])}
)


def values(step: int) -> dict[str, np.ndarray]:
    random = np.random.default_rng(step)
    return {
        "PointData/u": random.normal(size=(9, 3)),
        "CellData/stress": random.normal(size=(2, 6)),
    }


def test_every_step_is_read_back(tmp_path):
    """At its time, with its own values and those that do not change."""
    path = tmp_path / "x.vtkhdf"
    write_vtkhdf(path, GRID, {3: 0.1, 4: 0.2, 5: 0.4}, values)
    file = VtkFile(path)
    assert file.times == [0.1, 0.2, 0.4]
    for k, step in enumerate((3, 4, 5), 1):
        grid = file.at(k)
        np.testing.assert_array_equal(grid.points, GRID.points)
        np.testing.assert_array_equal(grid.cells.reshape(2, 7)[:, 1:], CELLS)
        np.testing.assert_array_equal(grid["body"], [1, 2])
        for name, array in values(step).items():
            np.testing.assert_array_equal(grid[name.partition("/")[2]], array)


def test_times_are_numbers_of_steps_where_loads_do_not_only_grow():
    """As in XDMF."""
    assert times([0.1, 0.2]) == [0.1, 0.2]
    assert times([0.1, 0.2, 0.2]) == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("room", [1000, 30_000, 60_000])
def test_a_full_disk_is_told_and_leaves_the_old_file(runs, tmp_path, refused, room):
    """Wherever it happens, HDF5 neither crashes nor is silent."""
    target = tmp_path / "bodies.vtkhdf"
    target.write_text("old")
    with file_size_limit(room):
        said = refused(["export", str(runs["coarse"]), "--vtk", str(tmp_path), "--force"])
    assert said == f"{target}: cannot be written: File too large.\n"
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


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


def test_tensors_have_the_components_of_vtk(run, tmp_path):
    """At the nodes and as means of the cells, which agree; at delta, though the load is a force."""
    assert command(["export", str(run.folder), "--vtk", str(tmp_path)]) == 0
    file = VtkFile(tmp_path / "bodies.vtkhdf")
    assert file.times == pytest.approx(run.columns["delta"], rel=1e-12)
    grid = file.at(2)
    fields = run.fields(2)
    for name in ("stress", "plastic_strain"):
        nodal = grid.point_data[name]
        means = grid.cell_data[name]
        np.testing.assert_array_equal(nodal[:, :4], getattr(fields, name))
        assert not nodal[:, 4:].any()
        assert not means[:, 4:].any()
        away = nodal[fields.cells].mean(axis=1) - means
        assert np.abs(away).mean() < 0.2 * np.abs(means).max()
    xx, yy, zz, xy = grid.cell_data["stress"][:, :4].T
    np.testing.assert_allclose((xx + yy + zz) / 3, fields.mean_stress, rtol=1e-12)
    assert np.abs(xy).max() > 0
    np.testing.assert_array_equal(grid.point_data["peeq"], fields.peeq_nodal)


def test_integration_points_are_vertices_with_their_values(run, tmp_path):
    """Where they are, moved as the cells around; stress and PEEQ as the solver has them."""
    files = export_vtk(run, tmp_path, 2)
    assert [file.name for file in files] == ["bodies.vtkhdf", "contact.vtkhdf", "points.vtkhdf"]
    grid = VtkFile(files[2]).at(1)
    points = run.points(2)
    fields = run.fields(2)
    np.testing.assert_array_equal(grid.points[:, :2], points["coordinates"].reshape(-1, 2))
    np.testing.assert_array_equal(grid["stress"][:, :4], points["stress"].reshape(-1, 4))
    np.testing.assert_array_equal(grid["peeq"], points["peeq"].ravel())
    of_cells = grid["displacement"][:, :2].reshape(len(fields.cells), -1, 2)
    around = fields.displacement[fields.cells]
    assert (of_cells.mean(axis=1) >= around.min(axis=1) - 1e-5).all()
    assert (of_cells.mean(axis=1) <= around.max(axis=1) + 1e-5).all()
    at_points = points["coordinates"].mean(axis=1)
    middles = fields.coordinates[fields.cells]
    assert np.abs(at_points - middles.mean(axis=1)).max() < 0.15

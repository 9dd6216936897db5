"""Runs of problems in space: what their folders hold, on any number of ranks, and after a kill."""

from __future__ import annotations

import signal
import time
from dataclasses import replace

import h5py
import numpy as np
import pytest
from dolfinx.mesh import CellType
from vtkmodules.vtkCommonCore import reference

import archord
from archord import Body, Coupling, Elastic, Interaction, Load, Problem, Support, boxes
from archord.commands.progress import Progress
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.output.files.step_file import all_arrays
from archord.postprocess.export import export_vtk
from archord.postprocess.pictures.pictures import panels_of
from archord.postprocess.pictures.report import write_report
from archord.postprocess.pictures.solids import skin_of
from archord.postprocess.probes.located import located
from tests import forked
from tests.forked import Run
from tests.output.run_files import accepted_steps
from tests.postprocess.vtk_reader import VtkFile
from tests.solver.contact.blocks_in_space import bodies, tagged
from tests.solver.space import KINDS

STEEL = J2Material(210e3, 0.3, hardening=LinearHardening(300.0, 2100.0))
SOFT = Elastic(70e3, 0.3)


def pressed(comm, kind=CellType.tetrahedron, friction=0.2, down=-0.01) -> Problem:
    """A soft block that is pressed on a block of steel, which yields."""
    return Problem(
        tagged(bodies(comm, kind=kind)),
        [Body("lower", STEEL), Body("upper", SOFT)],
        [Interaction("joint", ("lower", "upper"), friction=friction)],
        supports=[
            Support("base", fixed=["x", "y", "z"]),
            Support("left", fixed="x"),
            Support("front", fixed="y"),
        ],
        loads=[Load("press", on="lid", direction="z", displacement=down)],
        steps=2,
        kinematics="space",
    )


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """The runs of tetrahedra and of hexahedra on one rank, by the kind."""
    from mpi4py import MPI

    found = {}
    for kind in (CellType.tetrahedron, CellType.hexahedron):
        found[kind] = tmp_path_factory.mktemp("space") / kind.name
        problem = pressed(MPI.COMM_SELF, kind)
        archord.solve(problem, found[kind], fields="points", comm=MPI.COMM_SELF)
    return found


@KINDS
def test_the_history_has_forces_and_moments_about_three_axes(folders, kind):
    """They balance: what the lid presses, the joint carries and the base takes up."""
    run = archord.load(folders[kind])
    assert run.status == "done"
    last = {name: values[-1] for name, values in run.columns.items()}
    assert run.units["joint moment x"] == "N mm"
    assert run.units["joint force z"] == run.units["press force"] == "N"
    assert run.units["joint contact area"] == "mm2"
    assert "joint contact length" not in last
    force = last["press force"]
    assert force < -50
    assert last["base z"] == pytest.approx(-force, rel=1e-8)
    joint = np.array([last[f"joint force {axis}"] for axis in "xyz"])
    assert joint[2] == pytest.approx(-force, rel=1e-6)
    moment = np.array([last[f"joint moment {axis}"] for axis in "xyz"])
    held = ["left", "front"]
    assert moment[0] > 0 > moment[1]
    assert np.abs(moment[:2]).max() < np.abs(joint[2])
    assert {f"{name} moment z" for name in held} <= last.keys()
    assert 0 < last["joint contact area"] <= 1 + 1e-9
    assert last["joint contact fraction"] == pytest.approx(last["joint contact area"], rel=1e-9)
    assert last["lower peeq_max"] > 1e-3
    assert all(0 <= last[f"lower at {axis}"] <= 1 for axis in "xy")
    assert last["joint largest shear"] <= 0.2 * last["joint largest pressure"] * (1 + 1e-2)


@KINDS
def test_contact_holds_points_facets_and_vectors(folders, kind):
    """The pressure is the force of the history, the shears lie in the surface."""
    run = archord.load(folders[kind])
    contact = run.contact()
    assert [*contact] == ["lower", "upper"]
    carried = {}
    for name, profile in contact.items():
        n, q = profile.weight.shape
        assert profile.X.shape == profile.normal.shape == profile.shear.shape == (n, q, 3)
        assert profile.corners.shape == (n, 4 if kind == CellType.hexahedron else 3, 3)
        np.testing.assert_allclose(profile.X[..., 2], 0.0, rtol=0, atol=1e-12)
        assert profile.width.sum() == pytest.approx(1.0)
        outward = 1.0 if name == "lower" else -1.0
        np.testing.assert_allclose(profile.normal[..., 2], outward)
        carried[name] = (profile.facet_pressure * profile.width).sum()
        projected = (profile.weight * profile.pressure).sum(axis=1)
        of_facets = [np.bincount(profile.facet, of) for of in (projected, profile.facet_force)]
        np.testing.assert_allclose(*of_facets, rtol=0, atol=1e-10)
        along = np.abs(profile.shear[..., 2])
        assert along.max() < 0.1 * profile.largest_shear
    force = run.columns["joint force z"][-1]
    shares = run.summary["model"]["contact_shares"]["joint"]
    assert np.dot(shares, [*carried.values()]) == pytest.approx(force, rel=1e-4)
    a, b = (profile.shear.sum(axis=(0, 1)) for profile in contact.values())
    assert a @ b < 0  # action and reaction


@KINDS
def test_fields_have_six_components_on_quadratic_cells(folders, kind, tmp_path):
    """As VTK reads them: the volume, and the displacement between the nodes, are the run's."""
    run = archord.load(folders[kind])
    fields = run.fields()
    nodes = 27 if kind == CellType.hexahedron else 10
    assert fields.cells.shape[1] == nodes
    assert fields.components == ("xx", "yy", "zz", "xy", "yz", "zx")
    assert fields.stress.shape == (len(fields.coordinates), 6)
    assert fields.cell["stress"].shape == (len(fields.cells), 6)
    assert fields.peeq.max() > 1e-3
    assert fields.edges["lower"].shape[1] == {10: 6, 27: 9}[nodes]
    files = export_vtk(run, tmp_path)
    grid = VtkFile(files[0]).at(run.steps)
    assert (grid.celltypes == {10: 24, 27: 29}[nodes]).all()
    lid = fields.coordinates[:, 2] > 1 - 1e-9
    np.testing.assert_allclose(grid["displacement"][lid, 2], -0.01, rtol=1e-12)
    smooth = quadratic(fields.coordinates)
    volume = 0.0
    for k in range(grid.n_cells):
        cell = grid.GetCell(k)
        ids = grid.get_cell(k).point_ids
        at = [
            in_vtk(cell, place) for place in np.vstack([np.full((1, 3), 0.2), 0.2 + np.eye(3) / 4])
        ]
        for x, weights in at:
            assert weights @ smooth[ids] == pytest.approx(quadratic(x), abs=1e-9)
        x = np.array([place for place, _ in at])
        volume += np.abs(np.linalg.det(4 * (x[1:] - x[0]))) / {10: 6, 27: 1}[nodes]
    assert volume == pytest.approx(2.0, rel=1e-9)


def quadratic(x):
    return x[..., 0] ** 2 + 2 * x[..., 1] * x[..., 2] - x[..., 2] ** 2 + 0.3 * x[..., 1]


def in_vtk(cell, place):
    """Where VTK has a ``place`` of the reference cell, and the weights of the cell's nodes."""
    x = [0.0] * 3
    weights = [0.0] * cell.GetNumberOfPoints()
    cell.EvaluateLocation(reference(0), place, x, weights)
    return np.array(x), np.array(weights)


@pytest.mark.mpi
@KINDS
def test_the_numbers_are_the_same_on_any_number_of_ranks(kind, comm, tmp_path_factory):
    """All tables, contact and fields, in the same order."""
    shared = comm.bcast(str(tmp_path_factory.mktemp("ranks")) if comm.rank == 0 else None)
    archord.solve(pressed(comm, kind), f"{shared}/all", comm=comm, fields="points")
    if comm.rank == 0:
        from mpi4py import MPI

        archord.solve(
            pressed(MPI.COMM_SELF, kind), f"{shared}/one", comm=MPI.COMM_SELF, fields="points"
        )
        same(f"{shared}/all", f"{shared}/one", 1e-8)
    comm.barrier()


def same(one, other, tolerance, at_points=0.0):
    """All numbers of two runs agree, relative to the largest of their kind; those of points maybe
    only to another tolerance."""
    a, b = archord.load(one).columns, archord.load(other).columns
    assert a.keys() == b.keys()
    for name in a.keys() - {"seconds", "force_balance"}:
        close(name, a[name], b[name], tolerance)
    for name in ("fields", "contact"):
        with h5py.File(f"{one}/{name}.h5") as first, h5py.File(f"{other}/{name}.h5") as second:
            arrays = [dict(all_arrays(file)) for file in (first, second)]
        assert arrays[0].keys() == arrays[1].keys()
        for key, values in arrays[0].items():
            close(key, values, arrays[1][key], at_points or tolerance)


def close(name, a, b, tolerance):
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    np.testing.assert_array_equal(np.isnan(a), np.isnan(b))
    off = np.nanmax(np.abs(a - b), initial=0.0)
    assert off <= tolerance * np.nanmax(np.abs(a), initial=0.0), (name, off)


@KINDS
def test_a_restart_is_bit_identical(kind, tmp_path, monkeypatch):
    """After an interruption behind the first step."""
    from mpi4py import MPI

    def problem():
        return pressed(MPI.COMM_SELF, kind)

    archord.solve(problem(), tmp_path / "whole", comm=MPI.COMM_SELF)

    def stop(progress, record):
        signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(Progress, "step", stop)
        with pytest.raises(KeyboardInterrupt):
            archord.solve(problem(), tmp_path / "halted", comm=MPI.COMM_SELF, progress=True)
    archord.solve(problem(), tmp_path / "halted", restart=True, comm=MPI.COMM_SELF)
    same(tmp_path / "whole", tmp_path / "halted", 0.0, 1e-14)


def test_a_run_is_solved_again_and_extended_by_its_own_scene(folders, tmp_path):
    """On the mesh that its folder keeps; killed between two steps, it goes on."""
    whole = folders[CellType.tetrahedron]
    assert (
        forked.archord("solve", f"{whole}/scene.toml", "-o", "again", cwd=tmp_path).returncode == 0
    )
    same(whole, tmp_path / "again", 0.0)
    killed = Run(tmp_path, f"{whole}/scene.toml", "-o", "killed")
    checkpoint = tmp_path / "killed" / "checkpoint.h5"
    while killed.process.is_alive() and not checkpoint.exists():
        time.sleep(0.001)
    killed.end(0.0)
    assert accepted_steps(tmp_path / "killed") >= 1
    assert forked.archord("solve", "killed", "--restart", cwd=tmp_path).returncode == 0
    same(whole, tmp_path / "killed", 0.0, 1e-14)


def test_pictures_show_bodies_pressures_and_forces(folders, tmp_path):
    """Bodies may be cut open by a plane that meets them; a report has a picture, too."""
    for folder in folders.values():
        run = archord.load(folder)
        assert len(panels_of(run)) == 3
        assert archord.draw_run(run, tmp_path / "all.png").stat().st_size > 1000
    options = {"field": "uz", "steps": [1], "cut": "x=0.4"}
    assert archord.draw_run(run, tmp_path / "cut.png", **options).stat().st_size > 1000
    assert write_report(run, tmp_path / "run.pdf").stat().st_size > 1000
    for wrong, said in (
        ({"cut": "q=1"}, r'cut = "q=1" must name a plane, as "z=0"'),
        ({"cut": "z=99"}, r"must lie within the bodies: .* < z < "),
        ({"edges": ["lid"]}, "is in space, and has no edges to draw a field along"),
        ({"field": "strain"}, "has no field 'strain'"),
    ):
        with pytest.raises(archord.InputError, match=said):
            archord.draw_run(run, tmp_path / "no.png", **wrong)
    assert not (tmp_path / "no.png").exists()


@pytest.mark.parametrize("kind", [CellType.tetrahedron, CellType.hexahedron])
def test_the_skin_of_bodies_encloses_their_volume(folders, kind):
    """Triangles are seen from outside; a cut ends at its plane, where it has a face without holes.
    A field of the nodes has its values at the corners."""
    run = archord.load(folders[kind])
    fields = run.fields()
    still = replace(fields, displacement=0 * fields.displacement)
    skin = skin_of(run, still, fields.von_mises)
    low = fields.coordinates.min(axis=0)
    size = np.ptp(fields.coordinates, axis=0)
    volume = np.linalg.det(skin.corners).sum() / 6
    assert volume == pytest.approx(size.prod(), rel=1e-5)
    assert np.isin(skin.values, fields.von_mises).all()
    at_nodes = skin_of(run, still, fields.coordinates[:, 0], "x=0.4")
    x = at_nodes.corners[..., 0]
    np.testing.assert_allclose(at_nodes.values, x, atol=1e-7)
    assert x.max() == pytest.approx(0.4)
    assert np.isclose(x, 0.4).all(axis=1).any()
    z = fields.coordinates[:, 2]
    heights, n_nodes = np.unique(z.round(9), return_counts=True)
    through_nodes = heights[n_nodes > 5][1:-1]
    assert len(through_nodes) > 3
    for cut, share in [("x=0.4", (0.4 - low[0]) / size[0])] + [
        (f"z={height}", (height - low[2]) / size[2]) for height in through_nodes
    ]:
        left = np.linalg.det(skin_of(run, still, z, cut).corners).sum() / 6
        assert left == pytest.approx(share * volume, rel=1e-3), cut


@pytest.mark.mpi
def test_a_distributing_coupling_tells_how_its_facets_move_on_average(comm, tmp_path_factory):
    """The end of a cantilever: its deflection and slope by Bernoulli and Timoshenko, and the motion
    of another point of the same faces."""
    L, E, force = 10.0, 210e3, 100.0
    mesh = boxes({"beam": (0.0, 0.0, 0.0, L, 1.0, 1.0)}, size=0.5, kind="hexahedra", comm=comm)
    middle, beyond = (L, 0.5, 0.5), (L + 2.0, 0.5, 0.5)
    problem = Problem(
        mesh,
        [Body("beam", Elastic(E, 0.0))],
        supports=[Support("wall", on="beam left", fixed=["x", "y", "z"])],
        couplings=[
            Coupling("end", "beam right", middle, "distributing"),
            Coupling("far", "beam right", beyond, "distributing"),
        ],
        loads=[Load("bend", on="end", direction="z", force=force)],
        steps=1,
    )
    folder = comm.bcast(tmp_path_factory.mktemp("beam") if comm.rank == 0 else None)
    last = {name: v[-1] for name, v in archord.solve(problem, folder, comm=comm).columns.items()}
    inertia = 1 / 12
    slope = force * L**2 / (2 * E * inertia)
    deflection = force * L**3 / (3 * E * inertia) + 1.2 * force * L / (E / 2)
    assert last["end displacement z"] == pytest.approx(last["bend displacement"], rel=1e-9)
    assert last["end displacement z"] == pytest.approx(deflection, rel=2e-3)
    assert last["end rotation y"] == pytest.approx(-slope, rel=2e-3)
    assert last["far rotation y"] == pytest.approx(last["end rotation y"], rel=1e-9)
    farther = last["end displacement z"] - 2.0 * last["end rotation y"]
    assert last["far displacement z"] == pytest.approx(farther, rel=1e-9)
    assert abs(last["end rotation x"]) + abs(last["end rotation z"]) < 1e-6 * slope


@KINDS
def test_line_loads_add_up_to_the_force_of_the_history(folders, kind):
    """Along both axes of the surface; and so do the pressures of the unrolled facets."""
    run = archord.load(folders[kind])
    force = [run.columns[f"joint force {axis}"][-1] for axis in "xyz"]
    for direction in np.eye(3)[:2]:
        found = run.line_load("joint", direction=direction, point=(0.0, 0.0, -1.0))
        whole = np.diff(found.along) @ found.load
        np.testing.assert_allclose(whole, force, rtol=0, atol=1e-9 * np.abs(force).max())
    flat = run.unrolled("lower", direction=(1.0, 0.0, 0.0), point=(0.0, 0.5, -1.0))
    carried = run.contact()["lower"].facet_force.sum()
    assert flat.pressure @ flat.area == pytest.approx(carried, rel=1e-12)
    assert (flat.angle > 0).all()  # above the axis, counted from y
    with pytest.raises(archord.InputError, match="has no interaction 'weld'"):
        run.line_load("weld")


@KINDS
def test_fields_are_probed_along_lines_and_edges(folders, kind):
    """A quadratic field is reproduced; an edge is where two surfaces meet, with its stress."""
    run = archord.load(folders[kind])
    fields = run.fields()
    x = np.random.default_rng(2).uniform([0, 0, -1], [1, 1, 1], (60, 3))
    cell, nodes, weights = located(fields, np.vstack([x, [[2.0, 0.5, 0.5]]]))
    assert (cell[:-1] >= 0).all()
    assert cell[-1] == -1
    found = np.einsum("ka,ka->k", weights[:-1], quadratic(fields.coordinates)[nodes[:-1]])
    np.testing.assert_allclose(found, quadratic(x), atol=1e-8)
    border = np.random.default_rng(3).uniform([0, 0, 0], [1, 1, 0], (60, 3))
    cell, _, _ = located(fields, border)
    assert set(fields.body[cell]) == {fields.bodies["lower"]}  # the first body
    down = run.probe(quantity="uz", line=(0.3, 0.4, 1.0, 0.3, 0.4, -1.0))
    assert down.values[0] == pytest.approx(-0.01)
    assert down.values[-1] == pytest.approx(0.0, abs=1e-9)
    assert down.s[-1] == pytest.approx(2.0)
    assert (down.unit, down.axes, down.per) == ("mm", ("x", "y", "z"), "on the whole")
    stress = run.probe(line=(0.3, 0.4, 1.0, 0.3, 0.4, -1.0))
    assert stress.values.max() > 100
    edge = run.probe("lid & left")
    np.testing.assert_allclose(edge.x[:, [0, 2]], np.tile([0.0, 1.0], (len(edge.x), 1)), atol=1e-9)
    np.testing.assert_allclose(np.abs(np.diff(edge.x[:, 1])), np.diff(edge.s), atol=1e-9)
    along = run.probe("lid & left", "stress_yy")
    np.testing.assert_allclose(edge.values, along.values, atol=1e-9 * np.abs(edge.values).max())
    for place, said in (("left & front", "one curve"), ("left", 'an edge is "A & B"')):
        with pytest.raises(archord.InputError, match=said):
            run.probe(place)
    with pytest.raises(archord.InputError, match="a line here is x0, y0, z0, x1, y1, z1, not 4"):
        run.probe(line=(0, 0, 1, 1))
    with pytest.raises(archord.InputError, match=r"is no curve; Run\.unrolled"):
        run.probe("lower", "pressure")

"""What is exported is what the run holds."""

import h5py
import numpy as np
import pandas as pd
import pytest

from archord.cli import run as command
from archord.postprocess.export import export_vtk
from archord.postprocess.run import Run
from tests.postprocess.vtk_reader import VtkFile

_QUADRATIC_TRIANGLE = 22  # VTK's number


def test_vtk_reads_back_fields_and_contact(runs, tmp_path):
    """pyvista finds every step at its delta: nodes, curved triangles, displacement, stress and PEEQ
    of fields.h5; and lines along both arcs, which warped by their displacement are where contact.h5
    has them."""
    run = Run(runs["plastic"])
    export_vtk(run, tmp_path)
    bodies, contact = (VtkFile(tmp_path / f"{name}.vtkhdf") for name in ("bodies", "contact"))
    assert bodies.times == contact.times == run.columns["delta"]
    for step in (1, run.steps):
        (mesh, arcs) = (bodies.at(step), contact.at(step))
        fields = run.fields(step)
        assert set(mesh.celltypes) == {_QUADRATIC_TRIANGLE}
        np.testing.assert_array_equal(mesh.cells.reshape(-1, 7)[:, 1:], fields.cells)
        np.testing.assert_array_equal(mesh.points[:, :2], fields.coordinates)
        np.testing.assert_array_equal(mesh["displacement"][:, :2], fields.displacement)
        with h5py.File(runs["plastic"] / "fields.h5") as file:
            for name in ("peeq", "von_mises", "mean_stress", "contact_pressure"):
                np.testing.assert_array_equal(mesh[name], file[f"{name}/{step:04d}"][()])
    assert mesh["peeq"].max() > 0
    # the curved quarters: the area of the pin is that of a quarter circle, which straight triangles
    # miss by 1.7e-3
    pin = mesh.threshold([1, 1], scalars="body").triangulate().compute_cell_sizes()["Area"].sum()
    assert pin == pytest.approx(np.pi / 4, rel=6e-4)
    for number, arc in enumerate(run.contact().values(), 1):
        chosen = arcs["side"] == number
        deformed = (arcs.points + arcs["displacement"])[chosen, :2]
        np.testing.assert_allclose(deformed, arc.coordinates.reshape(-1, 2), atol=1e-14)
        np.testing.assert_array_equal(arcs["pressure"][chosen], arc.pressure.ravel())
    assert arcs.n_cells == sum(arc.angle[:, 1:].size for arc in run.contact().values())


def test_csv_reads_back_the_tables(runs, tmp_path):
    """history.csv number by number; the contact to the digits written; units in the headings."""
    assert command(["export", str(runs["plastic"]), "--csv", str(tmp_path / "csv")]) == 0
    run = Run(runs["plastic"])
    history = pd.read_csv(tmp_path / "csv" / "history.csv")
    pd.testing.assert_frame_equal(history, pd.read_csv(runs["plastic"] / "history.csv"))
    contact = pd.read_csv(tmp_path / "csv" / "contact.csv")
    assert contact.groupby("step").size().tolist() == [len(run.pressure())] * run.steps
    third = contact[contact["step"] == 3]
    np.testing.assert_allclose(third["delta [mm]"], run.columns["delta"][2], rtol=1e-12)
    np.testing.assert_allclose(
        third["pressure [MPa]"], run.pressure(3)["pressure"], rtol=1e-11, atol=1e-300
    )


def test_a_step_alone_and_nothing_overwritten_without_force(runs, tmp_path, capsys, refused):
    """Two files, which are printed; a file in the way is named, and none changed."""
    folder = tmp_path / "new" / "vtk"
    arguments = ["export", str(runs["coarse"]), "--vtk", str(folder), "--step", "4"]
    assert command(arguments) == 0
    assert capsys.readouterr().out == f"{folder}/bodies.vtkhdf\n{folder}/contact.vtkhdf\n"
    assert {file.name for file in folder.iterdir()} == {"bodies.vtkhdf", "contact.vtkhdf"}
    (folder / "contact.vtkhdf").write_text("mine")
    said = (
        f"{folder}/bodies.vtkhdf: is there already; choose another file, or overwrite it with "
        "--force.\n"
    )
    assert refused(arguments) == said
    assert (folder / "contact.vtkhdf").read_text() == "mine"
    assert command([*arguments[:-2], "--force"]) == 0
    assert len(VtkFile(folder / "contact.vtkhdf").times) == 6

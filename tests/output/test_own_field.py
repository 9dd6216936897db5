"""A field of one's own, as a row of the house's table or given to `archord.solve`: it is written,
read, drawn, probed and exported by all who know no names of fields."""

import xml.etree.ElementTree as ET

import h5py
import numpy as np
import pytest
from matplotlib.image import imread

import archord
from archord.cli import run as command
from archord.materials.elasticity import mean_stress, von_mises
from archord.output.cell_fields import CELL_FIELDS, CellField, own_rows
from archord.postprocess.pictures.problems import _NAMED, OF_EDGES, field_words
from archord.postprocess.probes import ask
from tests.postprocess.vtk_reader import VtkFile


def triaxiality(at):
    """Mean stress over von Mises stress, 0 where there is none."""
    equivalent = von_mises(at.stress)
    return np.divide(
        mean_stress(at.stress), equivalent, out=np.zeros_like(equivalent), where=equivalent > 0
    )


def bar():
    """A bar in plane stress, 2 long and 1 high, that is pulled and yields."""
    lead = archord.J2Material(1000.0, 0.3, "stress", archord.LinearHardening(5.0, 10.0))
    return archord.Problem(
        archord.rectangles({"bar": (0, 0, 2, 1)}, size=0.5),
        bodies=[archord.Body("bar", lead)],
        supports=[
            archord.Support("wall", on="bar left", fixed="x"),
            archord.Support("floor", on="bar bottom", fixed="y"),
        ],
        loads=[archord.Load("pull", on="bar right", direction="x", displacement=0.02)],
        kinematics="plane stress",
        steps=2,
    )


def _xdmf_names(folder):
    return {item.get("Name") for item in ET.parse(folder / "fields.xdmf").iter("Attribute")}


def test_a_row_of_the_table_is_written_read_drawn_probed_and_exported(tmp_path, monkeypatch):
    """Of a bar under tension a third, in each cell, at each node and along each line."""
    row = CellField("triaxiality", "stress triaxiality", "-", triaxiality, nodal=True)
    monkeypatch.setattr("archord.output.fields.CELL_FIELDS", [*CELL_FIELDS, row])
    monkeypatch.setattr("archord.output.cell_fields.CELL_FIELDS", [*CELL_FIELDS, row])
    run = archord.solve(bar(), tmp_path / "run", fields="points")
    fields = run.fields()
    np.testing.assert_allclose(fields.cell["triaxiality"], 1 / 3, rtol=1e-8)
    np.testing.assert_allclose(fields.nodal["triaxiality"], 1 / 3, rtol=1e-8)
    np.testing.assert_allclose(run.points()["triaxiality"], 1 / 3, rtol=1e-8)
    for probe in (
        run.probe("bar right", "triaxiality"),
        run.probe(line=(0, 0.5, 2, 0.5), quantity="triaxiality"),
    ):
        np.testing.assert_allclose(probe.values, 1 / 3, rtol=1e-8)
        assert probe.unit == ""
    assert field_words(run, "triaxiality") == ("stress triaxiality [-]", 1.0)
    archord.draw_run(run, tmp_path / "run.png", field="triaxiality")
    assert _xdmf_names(run.folder) >= {"triaxiality", "triaxiality_nodal"}


def test_a_function_is_enough_from_python(tmp_path, capsys):
    """Of stress, history and tensors; the files are read where nothing knows of it."""
    own = {
        "stored energy": lambda at: at.material.energy(at.stress.reshape(-1, 4)).reshape(
            at.weight.shape
        ),
        "back to zero": lambda at: -at.stress,
        "hardened": lambda at: at.state.peeq.reshape(at.weight.shape),
    }
    run = archord.solve(bar(), tmp_path / "run", own_fields=own)
    fields = run.fields()
    energy = run.columns["elastic_energy"][-1]
    assert fields.cell["stored energy"] == pytest.approx(energy / 2, rel=1e-8)
    np.testing.assert_allclose(fields.cell["back to zero"], -fields.cell["stress"])
    np.testing.assert_array_equal(fields.cell["hardened"], fields.peeq)
    with h5py.File(run.folder / "fields.h5") as file:
        np.testing.assert_array_equal(file["stored energy/0002"][()], fields.cell["stored energy"])
    assert _xdmf_names(run.folder) >= {"stored energy", "hardened", "von_mises"}
    assert run.probe(line=(0, 0.5, 2, 0.5), quantity="hardened").values == pytest.approx(
        fields.peeq[0], rel=1e-8
    )
    assert field_words(run, "stored energy") == ("stored energy", 1.0)
    picture = tmp_path / "own.png"
    asked = [str(run.folder), "--field", "stored energy", "-o", str(picture)]
    assert command(["picture", *asked]) == 0
    assert imread(picture).std() > 0
    assert command(["export", str(run.folder), "--vtk", str(tmp_path / "vtk")]) == 0
    exported = VtkFile(tmp_path / "vtk" / "bodies.vtkhdf").at(2).cell_data
    np.testing.assert_array_equal(exported["hardened"], fields.peeq)
    np.testing.assert_array_equal(exported["back to zero"][:, :4], fields.cell["back to zero"])
    capsys.readouterr()


@pytest.mark.mpi
def test_all_ranks_together_write_what_one_writes(comm, tmp_path):
    folder = comm.bcast(tmp_path)
    own = {"triaxiality": triaxiality, "far": lambda at: at.coordinates[..., 0]}
    run = archord.solve(bar(), folder / "run", own_fields=own, comm=comm)
    fields = run.fields()
    np.testing.assert_allclose(fields.cell["triaxiality"], 1 / 3, rtol=1e-8)
    middle = fields.coordinates[fields.cells[:, :3], 0].mean(axis=1)
    np.testing.assert_allclose(fields.cell["far"], middle, rtol=1e-10)


def test_names_that_probes_and_pictures_know_are_refused(tmp_path):
    """A probe told what archord calls so, not the field of the user."""
    known = {*ask._OF_LENGTH, *ask._OF_STRESS, *OF_EDGES, *_NAMED, *archord_names(tmp_path)}
    for name in known:
        with pytest.raises(archord.InputError, match=f"'{name}' is the name of another field"):
            own_rows({name: triaxiality})


def archord_names(folder):
    """The fields of the nodes of a run."""
    return archord.solve(bar(), folder / "run", fields="nodes").fields().nodal_fields()


@pytest.mark.parametrize("name", ["peeq", "stress_xx", "displacement", "a/b", ""])
def test_a_name_that_is_taken_or_none_is_refused(tmp_path, name):
    with pytest.raises(archord.InputError, match="own_fields: "):
        archord.solve(bar(), tmp_path / "run", own_fields={name: triaxiality})
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (lambda at: at.stress.sum(), "has values"),
        (lambda at: at.peeq * 1j, "must have real numbers at all points, not complex128"),
        (lambda at: np.ma.masked_less(at.peeq, 1.0), "must have real numbers at all points"),
    ],
)
def test_values_that_are_not_at_the_points_are_refused(values, said, tmp_path):
    """The imaginary part and the mask of an array were left out without a word."""
    with pytest.raises(archord.InputError, match=f"field 'own': {said}"):
        archord.solve(bar(), tmp_path / "run", own_fields={"own": values})


def test_a_field_has_one_shape_in_all_bodies(tmp_path):
    """Four values in cells of one body were spread over the components of the other's tensors."""
    mesh = archord.rectangles({"one": (0, 0, 1, 1), "two": (2, 0, 1, 1)}, size=1.0)
    bodies = [
        archord.Body(name, archord.Elastic(1.0, nu))
        for name, nu in zip(("one", "two"), (0.1, 0.2), strict=True)
    ]
    held = [
        archord.Support(f"{name} {side}") for name in ("one", "two") for side in ("bottom", "top")
    ]
    press = archord.Load("press", on="one", direction="x", force=1e-3)
    problem = archord.Problem(mesh, bodies, [], held, [press])

    def of_one(at):
        return at.stress if at.material.nu == 0.1 else at.peeq

    said = r"field 'own': has values \(4,\) in one body and \(\) in another"
    with pytest.raises(archord.InputError, match=said):
        archord.solve(problem, tmp_path / "run", own_fields={"own": of_one})

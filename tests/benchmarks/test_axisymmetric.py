"""Axisymmetric problems against closed forms, the spheres and the cylinder on coarse meshes."""

import shutil

import pytest

import archord
from archord.benchmarks.axisymmetric import __main__ as table
from archord.benchmarks.axisymmetric import thick_walls
from archord.postprocess.tables import peaks_of


@pytest.mark.parametrize(
    ("name", "within"),
    [
        ("thick sphere, elastic", 1e-3),
        ("thick sphere, plastic", 2e-3),
        ("thick cylinder, elastic", 1e-3),
        ("elastic ball on a half-space", 5e-3),
        ("ring pressed on a shaft", 5e-3),
    ],
)
def test_a_case_gives_its_reference(name, within, monkeypatch, tmp_path):
    for mesh, size in (("sphere_mesh", 0.2), ("cylinder_mesh", 0.1)):
        draw = getattr(thick_walls, mesh)
        monkeypatch.setattr(thick_walls, mesh, lambda draw=draw, size=size: draw(size))
    (case,) = (case for case in table.CASES if case.name == name)
    run = archord.solve(case.problem(), tmp_path / "run")
    for compared in case.compare(run):
        assert compared.ours == pytest.approx(compared.reference, rel=within)
    assert len(run.fields().coordinates) <= 3000
    assert (", r = " in peaks_of(run)) == ("body peeq_max" in run.columns)


@pytest.mark.skipif(
    shutil.which("ccx") is None, reason="CalculiX is not installed (image target peers)"
)
def test_calculix_gives_the_displacements_of_the_ring():
    (study, _) = table.STUDIES
    for *_, off in table.study_rows(study, 1):
        assert abs(off) < 0.005

"""Axisymmetric problems against closed forms, the spheres and the cylinder on coarse meshes."""

import pytest

import archord
from archord.benchmarks import axisymmetric
from archord.postprocess.tables import peaks_of


@pytest.mark.parametrize(
    ("name", "within"),
    [
        ("thick sphere, elastic", 1e-3),
        ("thick sphere, plastic", 2e-3),
        ("thick cylinder, elastic", 1e-3),
        ("elastic ball on a half-space", 5e-3),
    ],
)
def test_a_case_gives_its_reference(name, within, monkeypatch, tmp_path):
    for mesh, size in (("sphere_mesh", 0.2), ("cylinder_mesh", 0.1)):
        draw = getattr(axisymmetric, mesh)
        monkeypatch.setattr(axisymmetric, mesh, lambda draw=draw, size=size: draw(size))
    (case,) = (case for case in axisymmetric.CASES if case.name == name)
    run = archord.solve(case.problem(), tmp_path / "run")
    for compared in case.compare(run):
        assert compared.ours == pytest.approx(compared.reference, rel=within)
    assert len(run.fields().coordinates) <= 3000
    assert (", r = " in peaks_of(run)) == ("body peeq_max" in run.columns)

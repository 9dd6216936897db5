"""Closed forms in space on coarse meshes, and error over seconds."""

import csv

import pytest

from archord.benchmarks.space.closed_forms import FORMS
from archord.benchmarks.space.equal_error import Point, add_panel, quickest
from archord.benchmarks.space.sockets import layer

# element sizes, and what they leave
COARSE = {"elastic sphere": (0.4, 5e-3), "balls": (0.35, 0.02)}


@pytest.mark.parametrize("name", COARSE)
def test_solids_come_near_closed_forms(name):
    size, within = COARSE[name]
    for found in FORMS[name].compare(size):
        assert found.ours == pytest.approx(found.reference, rel=within)


@pytest.mark.parametrize(("size", "friction"), [(10.0, 0.0), (6.0, 0.2)])
def test_a_layer_is_plane_strain(size, friction):
    """To round-off with the contact points and the trace constants of the plane, by its own up to
    the error of the coarse mesh."""
    alike, own = layer(size, friction)
    assert alike.ours == pytest.approx(alike.reference, rel=1e-9)
    assert own.ours == pytest.approx(own.reference, rel=0.02)


def test_the_quickest_mesh_within_an_error_counts():
    """Errors may have either sign; where none is within, more than the most is needed."""
    points = [
        Point(3.0, 100, seconds=1.0, error=0.02),
        Point(2.0, 200, seconds=3.0, error=-0.004),
        Point(1.0, 800, seconds=9.0, error=0.001),
        Point(0.5, 6400),
    ]
    assert quickest(5e-3, points) == ("", 3.0)
    assert quickest(1e-4, points) == (">", 9.0)


def test_points_become_a_panel_of_the_work_precision_picture(tmp_path):
    ours = [Point(3.0, 100, 0.9, 2e-3, wall=1.0, memory=2e8)]
    theirs = [Point(3.0, 100, failure="more than the 600 s allowed")]
    add_panel("elastic", {"archord": ours, "CalculiX": theirs}, tmp_path)
    assert (tmp_path / "work_precision.png").stat().st_size > 1000
    with (tmp_path / "work_precision_space_elastic.csv").open() as file:
        first, second = csv.DictReader(file)
    assert (first["seconds"], first["MB"], first["error of P"]) == ("1", "200", "2.00e-03")
    assert (second["seconds"], second["failure"]) == ("", "more than the 600 s allowed")

"""Joints in space as gmsh draws and meshes them: volumes, sets, nodes on cylinders, quality."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.jacobian import smallest_determinants
from archord.geometry.meshes.quality import measures
from archord.geometry.shapes import solids
from archord.geometry.shapes.bushing import bushing
from archord.geometry.shapes.lug import lug
from archord.geometry.shapes.pin_in_block import half_ring, quarter_joint
from archord.geometry.shapes.solid_clevis import solid_clevis

R = 10.0
T = 12.0  # of the plates, half of it modelled
LONG = 18.0  # of the pin
CHAMFER = 0.5
LUG = (R, 0.1, 40.0, 20.0, 60.0, 2.5, 0.4)
PLANE_SETS = {"pin", "hole", "flat", "clamp", "axis", "end", "sides"}


def made(shape, *sizes, comm=MPI.COMM_SELF, **options):
    """A shape with its depths, on all ranks."""
    names = ("thickness", "pin_length", "chamfer", "fillet", "rim_ratio")
    space = {name: options.pop(name) for name in names if name in options}
    lengths = {"thickness": T, "pin_length": LONG, "chamfer": CHAMFER, "fillet": 0.0}
    return shape(comm, *sizes, space={"rim_ratio": 1.0} | lengths | space, **options)


def volume(mesh, body):
    """The volume of a body, half of it being modelled."""
    return measures(mesh)[np.isin(mesh.bodies, mesh.cell_sets[body])].sum()


def nodes_of(mesh, name):
    """Coordinates ``(n, 3)`` of the nodes of a facet set."""
    return mesh.x[np.unique(mesh.facets_of(name))]


def off(mesh, name, centre, radius):
    """How far nodes of a set are off a cylinder, but for its rim."""
    of_rim = np.unique(mesh.facets_of("rim"))
    nodes = np.setdiff1d(mesh.facets_of(name), of_rim)
    x = mesh.x[nodes]
    return np.abs(np.hypot(x[:, 0] - centre, x[:, 1]) - radius).max()


def removed(hole):
    """The volume that a chamfer takes from half a plate with half a hole."""
    cone = np.pi * ((hole + CHAMFER) ** 3 - hole**3) / 3
    return (cone - np.pi * hole**2 * CHAMFER) / 2


@pytest.mark.mpi
@pytest.mark.parametrize("half", [True, False], ids=["half", "whole"])
def test_a_lug_has_its_volumes_and_sets(half, comm):
    """The plane's areas times the lengths, less what the chamfer takes; all sets of the plane."""
    joint = made(lug, *LUG, half=half, pin="whole", comm=comm)
    assert set(joint.facet_sets) == PLANE_SETS | {"mid-plane", "faces", "rim"}
    assert joint.point_sets["centre"] == pytest.approx(np.array([[0.1, 0.0, 0.0]]))
    mesh = gathered(joint)
    if mesh is None:
        return
    share = 1 if half else 2
    hole = 10.1
    area = (60 * 40 + np.pi * 20**2 / 2 - np.pi * hole**2) / 2
    plate = share * (area * T / 2 - removed(hole))
    assert volume(mesh, "lug") == pytest.approx(plate, rel=1e-4)
    assert volume(mesh, "pin") == pytest.approx(share * np.pi * R**2 * LONG / 4, rel=1e-4)
    for name, axis, place in (("mid-plane", 2, 0.0), ("clamp", 0, -60.0), ("flat", 0, 0.1)):
        assert nodes_of(mesh, name)[:, axis] == pytest.approx(place, abs=1e-12)
    assert set(nodes_of(mesh, "faces")[:, 2].round(9)) == {T / 2, LONG / 2}


def test_nodes_lie_on_their_cylinders():
    """To round-off, as the clearance is a small difference of radii."""
    mesh = gathered(made(lug, *LUG, wall=3.0, interference=0.02, fillet=0.4, chamfer=0.0))
    circles = {"pin": R, "bushing inside": 10.1, "bushing outside": 13.1, "hole": 13.08}
    for name, radius in circles.items():
        centre = 0.1 if name == "pin" else 0.0
        assert off(mesh, name, centre, radius) < 1e-12 * R


SHAPES = {
    lug: LUG,
    bushing: (R, [(10.05, 13.0), (12.98, 25.0)], 2.0, 0.4),
    quarter_joint: (R, 0.05, 40.0, 2.0, 0.4),
    half_ring: (R, 0.05, 40.0, 2.0, 0.4, 0.2),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_cells_are_sound(shape):
    """No cell is nearly folded, however coarse."""
    smallest, largest = smallest_determinants(gathered(made(shape, *SHAPES[shape])))
    assert (smallest / largest).min() > 0.2


SHORT = R / 2
# half as many elements at fillets, of which the smallest take most of the time
SHORTER = {
    lug: (SHORT, 0.1, 20.0, 10.0, 30.0, 2.5, 0.4),
    bushing: (SHORT, [(5.05, 8.0), (7.98, 14.0)], 2.0, 0.4),
    quarter_joint: (SHORT, 0.05, 20.0, 2.0, 0.4),
    half_ring: (SHORT, 0.05, 20.0, 2.0, 0.4, 0.2),
}


@pytest.mark.parametrize("fillet", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("shape", SHORTER)
def test_cells_at_fillets_are_not_folded(shape, fillet):
    """However small they are beside the other elements; where a fillet ends it is tangent to a
    face, so that the corners of cells are flat there, and no more than flat."""
    sizes = (SHORTER if fillet == 0.1 else SHAPES)[shape]
    mesh = gathered(made(shape, *sizes, chamfer=0.0, fillet=fillet))
    smallest, largest = smallest_determinants(mesh)
    assert (smallest / largest).min() > -0.01


@pytest.mark.mpi
def test_folded_elements_are_refused(monkeypatch, comm):
    """The elements at a fillet, were they as large as the others; on every rank."""
    monkeypatch.setenv("ARCHORD_KEEP_MESHES", "0")
    monkeypatch.setattr(solids, "_OF_FILLET", 100.0)
    with pytest.raises(ValueError, match="are folded; choose a smaller element size"):
        made(lug, *LUG, chamfer=0.0, fillet=0.1, comm=comm)


def test_elements_shrink_toward_the_rim():
    """By the ratio that is asked for."""

    def nodes_at_rim(ratio):
        mesh = gathered(made(lug, *LUG, chamfer=0.0, rim_ratio=ratio))
        z = nodes_of(mesh, "hole")[:, 2]
        return (np.abs(z - T / 2) < 1e-9).sum()

    assert nodes_at_rim(0.4) == pytest.approx(2.5 * nodes_at_rim(1.0), rel=0.15)


def test_a_clevis_has_its_volumes():
    """Of plates, bushings and a hollow pin that reaches beyond the outer plates."""
    plate = {"width": 40.0, "edge_distance": 20.0, "length": 50.0, "end": "square"}
    inner, outer = ({**plate, "thickness": thickness} for thickness in (12.0, 7.0))
    space = {"gap": 0.5, "overhang": 2.0, "bore": 4.0, "wall": 3.0}
    space |= {"chamfer": 0.0, "fillet": 0.0, "rim_ratio": 1.0}
    mesh = gathered(solid_clevis(MPI.COMM_SELF, R, 0.1, inner, outer, 2.5, 0.4, space=space))
    area = (70 * 40 - np.pi * 13.1**2) / 2
    assert volume(mesh, "inner") == pytest.approx(6 * area, rel=1e-4)
    assert volume(mesh, "outer") == pytest.approx(7 * area, rel=1e-4)
    ring = np.pi * (13.1**2 - 10.1**2) / 2
    assert volume(mesh, "outer bushing") == pytest.approx(7 * ring, rel=1e-4)
    pin = np.pi * (R**2 - 4.0**2) / 2
    assert volume(mesh, "pin") == pytest.approx((6 + 0.5 + 7 + 2) * pin, rel=1e-4)
    pinned = {name: nodes_of(mesh, name)[:, 2] for name in ("inner pin", "outer pin")}
    assert pinned["inner pin"].max() == pytest.approx(6.25)
    assert pinned["outer pin"].min() == pytest.approx(6.25)


@pytest.mark.parametrize("unit", [1e-3, 1e3, 1 / 25.4])
def test_meshes_do_not_depend_on_units(unit):
    """Of lengths that are no round parts of the radius: in another last bit gmsh would make other
    tetrahedra."""
    lengths = [9.9, 0.1, 40.0, 20.0, 60.0, 3.4]
    depths = {"thickness": T, "pin_length": LONG, "chamfer": CHAMFER}
    one = gathered(made(lug, *lengths, 0.4, **depths))
    scaled = {name: depth * unit for name, depth in depths.items()}
    other = gathered(made(lug, *(length * unit for length in lengths), 0.4, **scaled))
    np.testing.assert_array_equal(other.cells, one.cells)
    np.testing.assert_allclose(other.x / unit, one.x, rtol=0, atol=1e-11)

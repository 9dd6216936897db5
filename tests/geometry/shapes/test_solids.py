"""Joints in space as gmsh draws and meshes them: volumes, sets, nodes on cylinders, quality."""

from __future__ import annotations

import numpy as np
import pytest

from archord.geometry.meshes.fenicsx import own_gmsh
from archord.geometry.shapes import joint_mesh
from archord.geometry.shapes.bushing import bushing
from archord.geometry.shapes.lug import lug
from archord.geometry.shapes.pin_in_block import half_ring, quarter_joint
from archord.geometry.shapes.solids import draw_solids

R = 10.0
T = 12.0  # of the plates, half of it modelled
LONG = 18.0  # of the pin
CHAMFER = 0.5
_TETRAHEDRON = 11  # gmsh's number for 10 nodes


class Drawn:
    """What gmsh made of the slabs of a joint; lengths are in radii of the pin."""

    def __init__(self, comm, sketch, slabs, depths, **_):
        with own_gmsh() as gmsh:
            draw_solids(sketch, slabs, depths, gmsh)
            gmsh.model.mesh.generate(3)
            self.mass = {}
            self.nodes = {}
            for dim, tag in gmsh.model.getPhysicalGroups():
                name = gmsh.model.getPhysicalName(dim, tag)
                parts = gmsh.model.getEntitiesForPhysicalGroup(dim, tag)
                mass = sum(gmsh.model.occ.getMass(dim, part) for part in parts)
                self.mass[dim, name] = mass
                x = gmsh.model.mesh.getNodesForPhysicalGroup(dim, tag)[1].reshape(-1, 3)
                self.nodes[dim, name] = x
            cells, _ = gmsh.model.mesh.getElementsByType(_TETRAHEDRON)
            quality = gmsh.model.mesh.getElementQualities
            self.quality = quality(cells, "minSJ").min()
            self.volume = quality(cells, "volume").sum()

    def off(self, name, centre, radius):
        """How far the nodes of a set, but for its rim, are off a cylinder."""
        x = self.nodes[2, name]
        x = x[np.isclose(x[:, 2], 0) | (x[:, 2] < (T / 2 - CHAMFER) / R - 1e-6)]
        return np.abs(np.hypot(x[:, 0] - centre, x[:, 1]) - radius).max()


@pytest.fixture
def drawn(monkeypatch):
    """What draws a joint in space instead of distributing its mesh."""
    monkeypatch.setattr(joint_mesh, "mesh_solids", Drawn)

    def draw(shape, *sizes, chamfer=CHAMFER, **options):
        space = {"thickness": T, "pin_length": LONG, "chamfer": chamfer}
        return shape(None, R, *sizes, space=space, **options)

    return draw


def chamfered(hole):
    """The volume that a chamfer takes from half a plate with half a hole."""
    cone = np.pi * ((hole + CHAMFER) ** 3 - hole**3) / 3
    return (cone - np.pi * hole**2 * CHAMFER) / 2


@pytest.mark.parametrize("half", [True, False], ids=["half", "whole"])
def test_a_lug_has_its_volumes_and_sets(drawn, half):
    """The plane's areas times the lengths, less what the chamfer takes; all sets of the plane."""
    hole = 10.1
    made = drawn(lug, 0.1, 40.0, 20.0, 60.0, 2.5, 0.4, half=half, pin="whole")
    share = 1 if half else 2
    area = (60 * 40 + np.pi * 20**2 / 2 - np.pi * hole**2) / 2
    plate = share * (area * T / 2 - chamfered(hole))
    assert made.mass[3, "lug"] * R**3 == pytest.approx(plate, rel=1e-9)
    pin = share * np.pi * R**2 / 2 * LONG / 2
    assert made.mass[3, "pin"] * R**3 == pytest.approx(pin, rel=1e-9)
    assert made.volume * R**3 == pytest.approx(plate + pin, rel=5e-3)  # of chords
    sets = {name for dim, name in made.mass if dim == 2}
    plane = {"pin", "hole", "flat", "clamp", "axis", "end", "sides"}
    assert sets == plane | {"mid-plane", "faces", "rim"}
    assert made.mass[2, "clamp"] * R**2 == pytest.approx(share * 20 * T / 2, rel=1e-9)
    assert made.mass[2, "flat"] * R**2 == pytest.approx(share * R * LONG / 2, rel=1e-9)
    assert made.mass[2, "mid-plane"] * R**2 == pytest.approx(
        share * (area + np.pi * R**2 / 2), rel=1e-9
    )


def test_nodes_lie_on_their_cylinders(drawn):
    """To round-off, as the clearance is a small difference of radii."""
    made = drawn(lug, 0.1, 40.0, 20.0, 60.0, 2.5, 0.4, wall=3.0, interference=0.02)
    assert made.off("pin", 0.01, 1.0) < 1e-12
    assert made.off("bushing inside", 0.0, 1.01) < 1e-12
    assert made.off("bushing outside", 0.0, 1.31) < 1e-12
    assert made.off("hole", 0.0, 1.308) < 1e-12


@pytest.mark.parametrize("shape", [lug, bushing, quarter_joint, half_ring])
def test_cells_are_sound(drawn, shape):
    """No cell is folded, however thin or coarse."""
    sizes = {
        lug: (0.1, 40.0, 20.0, 60.0, 2.0, 0.4),
        bushing: ([(10.05, 13.0), (12.98, 25.0)], 2.0, 0.4),
        quarter_joint: (0.05, 40.0, 2.0, 0.4),
        half_ring: (0.05, 40.0, 2.0, 0.4, 0.2),
    }
    assert drawn(shape, *sizes[shape]).quality > 0.3


def test_elements_shrink_toward_the_rim(drawn):
    """By the ratio that is asked for."""

    def nodes_at_rim(ratio):
        space = {"thickness": T, "pin_length": T, "rim_ratio": ratio}
        made = lug(None, R, 0.1, 40.0, 20.0, 60.0, 2.0, 0.5, space=space)
        x = made.nodes[2, "hole"]
        return (np.abs(x[:, 2] - T / 2 / R) < 1e-9).sum()

    assert nodes_at_rim(0.4) == pytest.approx(2.5 * nodes_at_rim(1.0), rel=0.1)

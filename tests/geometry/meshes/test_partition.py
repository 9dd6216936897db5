"""The cut of a mesh over the ranks: even, in sectors, the same every time."""

import numpy as np
import pytest
from dolfinx.mesh import entities_to_geometry

from archord.geometry.meshes.fenicsx import boxes, sectors, slices, usual_cut
from archord.geometry.shapes.pin_in_block import half_ring, quarter_joint
from tests.geometry.shapes.measures import Facets


@pytest.mark.parametrize("n_parts", [1, 2, 3, 64])
def test_parts_have_as_many_cells_each_and_lie_in_order_of_their_angle(n_parts):
    """In whatever order the cells come; also for no cells, and fewer than parts."""
    rng = np.random.default_rng(1)
    x = rng.uniform(0, 1, (300, 2))
    cells = rng.integers(0, 300, (1001, 3))
    part = sectors(x, cells, n_parts)
    assert np.ptp(np.bincount(part, minlength=n_parts)) <= 1
    middle = x[cells].mean(axis=1)
    angle = np.arctan2(middle[:, 1], middle[:, 0])
    assert (np.diff(part[np.argsort(angle)]) >= 0).all()
    order = rng.permutation(len(cells))
    assert (sectors(x, cells[order], n_parts) == part[order]).all()
    assert sectors(x, cells[:0], n_parts).shape == (0,)
    assert sectors(x, cells[:1], n_parts).tolist() == [0]


@pytest.mark.parametrize("n_parts", [1, 3, 8, 27])
def test_boxes_of_a_cube_have_as_many_cells_each_and_short_sides(n_parts):
    """In whatever order the cells come; also for no cells, and fewer than parts."""
    n = 12
    x = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.arange(len(x))[:, None]
    part = boxes(x, cells, n_parts)
    assert np.ptp(np.bincount(part, minlength=n_parts)) <= 2
    extents = [np.ptp(x[part == k], axis=0).max() for k in range(n_parts)]
    assert max(extents) < 2 * n / np.cbrt(n_parts)
    order = np.random.default_rng(1).permutation(len(cells))
    again = boxes(x[order], np.argsort(order)[:, None], n_parts)
    assert np.ptp(np.bincount(again, minlength=n_parts)) <= 2
    assert boxes(x, cells[:0], n_parts).shape == (0,)
    assert boxes(x, cells[:1], n_parts).tolist() in ([0], [n_parts - 1])


def test_boxes_are_of_many_parts_in_space():
    assert usual_cut(3, 16) is boxes
    assert usual_cut(3, 2) is usual_cut(2, 16) is sectors


@pytest.mark.parametrize("n_parts", [2, 3])
@pytest.mark.parametrize("n_cells", [1000, 20_000])
def test_two_parts_of_many_cells_are_slices_across_z(n_parts, n_cells):
    """As many cells each, one below the other; few cells, and more parts, are cut in sectors."""
    rng = np.random.default_rng(1)
    x = rng.uniform(0, 1, (300, 3))
    cells = rng.integers(0, 300, (n_cells, 4))
    part = slices(x, cells, n_parts)
    if n_parts > 2 or n_cells == 1000:
        assert (part == sectors(x, cells, n_parts)).all()
        return
    assert np.bincount(part).tolist() == [n_cells / 2, n_cells / 2]
    z = x[cells].mean(axis=1)[:, 2]
    assert z[part == 0].max() <= z[part == 1].min()


@pytest.mark.mpi
@pytest.mark.parametrize("make", ["quarter", "ring"])
def test_pin_and_hole_are_cut_at_the_same_angle(comm, make):
    """Facets of both sides on a rank cover the same angles, but for about an element."""
    size = 0.05
    if make == "quarter":
        joint = quarter_joint(comm, 1.0, 0.005, 6.0, size, 0.5)
    else:
        joint = half_ring(comm, 1.0, 0.005, 3.0, size, 0.5, 0.1)
    mesh = joint.mesh
    mesh.topology.create_connectivity(1, 2)
    ends = []
    for side in (Facets.PIN_ARC, Facets.HOLE_ARC):
        x = mesh.geometry.x[entities_to_geometry(mesh, 1, joint.facets.find(side))]
        angles = np.arctan2(x[..., 1], x[..., 0])
        ends.append((angles.min(), angles.max()) if angles.size else (np.nan, np.nan))
    assert np.abs(np.subtract(*ends)).max() < 2 * size

"""The mesh of the quarter joint."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI

from archord.geometry.basis import TRIANGLE, bulk_quadrature, cell_basis
from archord.geometry.shapes.pin_in_block import half_ring, quarter_joint
from archord.scene.presets.joint_geometry import JointGeometry
from tests.geometry.shapes.measures import Cells, Facets

R = 1.0
DR = 0.005
W = 10.0
SIZE = 0.2
GROWTH = 0.4


def made(size=SIZE, growth=GROWTH, width=W, ring=False, comm=MPI.COMM_SELF, **options):
    """A quarter joint, or a half ring with a core of half the radius."""
    if ring:
        return half_ring(comm, R, DR, width, size, growth, 0.5, **options)
    return quarter_joint(comm, R, DR, width, size, growth, **options)


@pytest.fixture(scope="module")
def joint():
    return made()


def facet_nodes(joint, tag):
    """Coordinates ``(n, 3, 2)`` of the nodes of the tagged facets: two vertices and the
    midpoint."""
    mesh = joint.mesh
    mesh.topology.create_connectivity(1, 2)
    return mesh.geometry.x[dolfinx_mesh.entities_to_geometry(mesh, 1, joint.facets.find(tag))][
        ..., :2
    ]


def edge_lengths(joint, tag):
    x = facet_nodes(joint, tag)
    return np.linalg.norm(x[:, 0] - x[:, 1], axis=1)


def area(joint, tag, comm=MPI.COMM_SELF):
    n_owned = joint.mesh.topology.index_map(2).size_local
    cells = joint.cells.find(tag)
    X, w = bulk_quadrature(TRIANGLE, 2)
    return comm.allreduce(
        float((cell_basis(joint.mesh, 2, cells[cells < n_owned], X).measure @ w).sum())
    )


def sector(radius, n):
    """Area of a quarter disc whose arc consists of ``n`` parabolas through points of the circle."""
    half = np.pi / 4 / n
    chord = 2 * np.sin(half)
    height = 1 - np.cos(half)
    return radius**2 * n * (np.sin(half) * np.cos(half) + 2 / 3 * chord * height)


def test_elements_shrink_toward_the_edge_of_the_contact():
    """Edges of both arcs are a quarter as long at the given angle, and elsewhere no longer than
    without it."""
    angle = 1.1
    fine = SIZE / 4
    joint = made(edge=(angle, fine))
    for tag, centre in ((Facets.PIN_ARC, -DR), (Facets.HOLE_ARC, 0.0)):
        x = facet_nodes(joint, tag) - [0, centre]
        length = edge_lengths(joint, tag)
        middle = x.mean(axis=1)
        away = np.abs(np.arctan2(middle[:, 0], -middle[:, 1]) - angle)
        assert length[away.argmin()] == pytest.approx(fine, rel=0.35)
        assert length.max() < 1.2 * SIZE
        assert length[away > 0.6].mean() > 2 * fine


def test_arcs_are_where_they_belong(joint):
    """All nodes on their radius to the last bit but one, as the clearance is a small difference of
    large numbers; from the symmetry axis to the height of the centre, with equal edges (to gmsh's
    1e-8); touching at (0, -R - dR) alone."""
    for tag, radius, centre in ((Facets.PIN_ARC, R, -DR), (Facets.HOLE_ARC, R + DR, 0.0)):
        x = facet_nodes(joint, tag) - [0, centre]
        assert np.abs(np.linalg.norm(x, axis=-1) - radius).max() < 1e-15
        angle = np.arctan2(x[..., 0], -x[..., 1])
        assert angle.min() == pytest.approx(0, abs=1e-15)
        assert angle.max() == pytest.approx(np.pi / 2, abs=1e-14)
        np.testing.assert_allclose(np.abs(angle[:, 1] - angle[:, 0]), np.pi / 2 / len(x), rtol=1e-7)
        np.testing.assert_allclose(angle[:, 2], angle[:, :2].mean(axis=1), atol=1e-8)
        lowest = x.reshape(-1, 2)[x[..., 1].argmin()] + np.array([0, centre])
        np.testing.assert_allclose(lowest, [0, -R - DR], rtol=0, atol=1e-15)


@pytest.mark.mpi
@pytest.mark.parametrize("size", [0.2, 0.1])
def test_areas_and_edges(size, comm):
    """A quarter disc, and a square without one: exact for parabolic arcs, whose edges are no longer
    than the element size, and no shorter than a whole number of them asks for."""
    joint = made(size, comm=comm)
    n = int(np.ceil(np.pi / 2 / size))
    for tag in (Facets.PIN_ARC, Facets.HOLE_ARC):
        lengths = edge_lengths(joint, tag)
        assert lengths.max(initial=0) <= size * (1 + DR)
        assert lengths.min(initial=1) >= size * (1 - 1 / n) * 0.99
    pin = area(joint, Cells.PIN, comm)
    block = area(joint, Cells.BLOCK, comm)
    assert pin == pytest.approx(sector(R, n), rel=1e-12)
    assert block == pytest.approx(W**2 - sector(R + DR, n), rel=1e-12)


@pytest.mark.parametrize("ring", [False, True], ids=["quarter joint", "half ring"])
@pytest.mark.parametrize(("size", "size_ratio"), [(0.2, 0.05), (0.01, 20.0)])
def test_pin_and_block_can_have_elements_of_their_own(ring, size, size_ratio):
    """1:20 and 20:1: each arc has its own edges, each body its own number of triangles, none of
    them a sliver."""
    joint = made(size, ring=ring, size_ratio=size_ratio)
    for tag, longest in ((Facets.HOLE_ARC, size), (Facets.PIN_ARC, size_ratio * size)):
        lengths = edge_lengths(joint, tag)
        assert 0.85 * longest < lengths.min() < lengths.max() <= longest * (1 + DR)
    numbers = [len(joint.cells.find(body)) for body in Cells]
    assert (numbers[0] > 4 * numbers[1]) == (size_ratio < 1)
    corners = joint.mesh.geometry.x[joint.mesh.geometry.dofmap[:, :3], :2]
    edge, following = (np.roll(corners, -i, axis=1) - corners for i in (1, 2))
    cosine = (
        (edge * following).sum(axis=-1)
        / np.linalg.norm(edge, axis=-1)
        / np.linalg.norm(following, axis=-1)
    )
    assert np.degrees(np.arccos(cosine)).min() > 15


def test_edges_grow_with_the_distance(joint):
    """Around element_size + growth * distance, to the accuracy gmsh keeps: within a factor 2, 25 %
    in the mean."""
    corners = joint.mesh.geometry.x[joint.mesh.geometry.dofmap[:, :3], :2]
    following = np.roll(corners, 1, axis=1)
    distance = np.abs(np.linalg.norm((corners + following) / 2, axis=-1) - R - DR)
    ratio = np.linalg.norm(corners - following, axis=-1) / (SIZE + GROWTH * distance)
    assert 0.5 < ratio.min() < ratio.max() < 2
    assert ratio.mean() == pytest.approx(1, abs=0.25)


def test_a_rigid_pin_is_not_meshed(joint):
    """No cells and no facets of a pin; the block is the same to the area."""
    rigid = made(rigid_pin=True)
    assert set(rigid.cells.values) == {Cells.BLOCK}
    assert set(rigid.facets.values) == {Facets.HOLE_ARC, Facets.BLOCK_HELD, Facets.SYMMETRY}
    assert area(rigid, Cells.BLOCK) == pytest.approx(area(joint, Cells.BLOCK), rel=1e-12)


def test_a_whole_pin_has_a_free_half_above(joint):
    """The pressed line lies inside of it then; block and arcs in contact stay where they are."""
    whole = made(whole_pin=True)
    assert area(whole, Cells.PIN) == pytest.approx(2 * area(joint, Cells.PIN), rel=1e-9)
    assert area(whole, Cells.BLOCK) == pytest.approx(area(joint, Cells.BLOCK), rel=1e-12)
    for tag in (Facets.PIN_ARC, Facets.HOLE_ARC, Facets.PIN_TOP, Facets.BLOCK_HELD):
        assert edge_lengths(whole, tag).sum() == pytest.approx(
            edge_lengths(joint, tag).sum(), rel=1e-12
        )
    x = facet_nodes(whole, whole.facet_sets["pin back"][0]) - [0, -DR]
    np.testing.assert_allclose(np.linalg.norm(x, axis=-1), R, rtol=1e-15)
    assert x[..., 1].min() > -1e-15


def test_tagged_edges_are_where_their_names_say(joint):
    """Tops on y = 0 and y = -dR, symmetry on x = 0 along pin and block, each with its full
    length."""
    for tag, axis, place in (
        (Facets.PIN_TOP, 1, -DR),
        (Facets.BLOCK_HELD, 1, 0),
        (Facets.SYMMETRY, 0, 0),
    ):
        np.testing.assert_allclose(facet_nodes(joint, tag)[..., axis], place, atol=1e-15)
    assert edge_lengths(joint, Facets.PIN_TOP).sum() == pytest.approx(R)
    assert edge_lengths(joint, Facets.BLOCK_HELD).sum() == pytest.approx(W - R - DR)
    assert edge_lengths(joint, Facets.SYMMETRY).sum() == pytest.approx(R + W - R - DR)


@pytest.mark.parametrize(
    ("size", "growth", "width"),
    [(0.2, 0.4, 10.0), (0.02, 0.25, 100.0), (0.1, 0.05, 20.0), (0.01, 1.0, 3.0)],
)
def test_the_expected_number_of_triangles_is_about_what_the_mesh_has(size, growth, width):
    """The scene model refuses meshes by this estimate before they are made."""
    keys = {
        "radius": R,
        "clearance": DR,
        "block_size": width,
        "relative_element_size": size,
        "growth": growth,
    }
    cells = made(size, growth, width).mesh.topology.index_map(2).size_global
    assert 0.5 < JointGeometry(**keys).expected_cells / cells < 1.5


@pytest.mark.parametrize(
    ("ring", "degree"), [(False, 3), (True, 2)], ids=["quarter joint", "half ring"]
)
def test_a_mesh_made_by_cutting_is_like_one_made_at_once(ring, degree):
    """The same edges on the arcs, nodes on their circles to the last digits, few more triangles,
    the same areas."""
    at_once, cut = (made(0.02, 0.05, ring=ring, degree=degree, refinements=k) for k in (0, 2))
    for tag, radius, centre in (
        (Facets.HOLE_ARC, R + DR, 0.0),
        (Facets.PIN_ARC, R, 0.0 if ring else -DR),
    ):
        assert len(cut.facets.find(tag)) == pytest.approx(len(at_once.facets.find(tag)), abs=6)
        assert edge_lengths(cut, tag).max() <= 0.02 * (1 + DR)
        x = facet_nodes(cut, tag).reshape(-1, 2) - [0, centre]
        np.testing.assert_allclose(np.linalg.norm(x, axis=1), radius, rtol=1e-14)
    for body in Cells:
        assert 0.95 < len(cut.cells.find(body)) / len(at_once.cells.find(body)) < 1.2
        assert area(cut, body) == pytest.approx(area(at_once, body), rel=1e-6)

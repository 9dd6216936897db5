"""One side of a contact: its facets on this rank, and its whole curve on every rank."""

from __future__ import annotations

from dataclasses import replace

import basix.ufl
import numpy as np
import pytest
from dolfinx.mesh import (
    CellType,
    compute_midpoints,
    create_mesh,
    create_rectangle,
    exterior_facet_indices,
    locate_entities,
)
from mpi4py import MPI

from archord.geometry.basis import TRIANGLE, bulk_quadrature, cell_basis
from archord.geometry.curve import in_pieces
from archord.geometry.strain import PointStrain
from archord.materials.kinematics import PLANE_STRAIN
from archord.solver.contact.surface import Surface
from tests.geometry.shapes.measures import Facets
from tests.solver.parts import (
    DR,
    ELASTIC,
    PERFECT,
    PLANE_STRESS,
    R,
    coordinates,
    joint_parts,
    space,
)

SIDES = {"pin": (0, R, np.array([0.0, -DR])), "hole": (1, R + DR, np.array([0.0, 0.0]))}
BOTTOM = np.array([0.0, -R - DR])
both_sides = pytest.mark.parametrize(
    ("number", "radius", "centre"), SIDES.values(), ids=SIDES.keys()
)
MATERIALS = {"elastic": ELASTIC, "plastic": PERFECT, "plane stress": PLANE_STRESS}
every_material = pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS.keys())


def trace_forms(side):
    """Both sides of the trace inequality, ``(n, 12, 12)`` each, from strains of unit displacements
    of the cell's nodes.

    The integral over the facet of sigma_n^2, and twice the elastic energy of the cell under the
    bulk's rule.
    """
    X, w = bulk_quadrature(TRIANGLE, 2)
    basis = cell_basis(side.V.mesh, 2, side.cells, X)
    C = side.material.elastic_tangent
    units = np.eye(12).reshape(12, 6, 2)
    n = side.outward
    sigma_n = []
    eps = []
    for unit in units:
        u = unit.copy()
        nodes = np.tile(np.arange(6, dtype=np.int32), (len(side.cells), 1))
        s = side.small_strain.matrix() @ unit.ravel() @ C
        sigma_n.append(
            n[..., 0] ** 2 * s[..., 0]
            + n[..., 1] ** 2 * s[..., 1]
            + 2 * n[..., 0] * n[..., 1] * s[..., 2]
        )
        eps.append(PointStrain(PLANE_STRAIN, basis, nodes)(u))
    sigma_n = np.stack(sigma_n, axis=1)
    eps = np.stack(eps, axis=1)
    trace = np.einsum("nq,naq,nbq->nab", side.weight, sigma_n, sigma_n)
    return trace, np.einsum("nq,naqi,ij,nbqj->nab", basis.measure * w, eps, C, eps)


@every_material
def test_gamma_bounds_the_traction_by_the_energy(material):
    """Integral over the facet of sigma_n^2 <= gamma a(v, v), for random displacements of every
    contact cell."""
    parts = joint_parts(pin=material, block=material)
    rng = np.random.default_rng(0)
    for side in parts.sides:
        trace, energy = trace_forms(side)
        v = rng.normal(size=(len(side.cells), 500, 12))
        left, right = (np.einsum("nka,nab,nkb->nk", v, form, v) for form in (trace, energy))
        assert np.all(left <= side.gamma[:, None] * right)


@every_material
def test_gamma_is_sharp(material):
    """On every contact cell some displacement attains the bound: power iteration finds it."""
    parts = joint_parts(pin=material, block=material)
    for side in parts.sides:
        trace, energy = trace_forms(side)
        step = np.linalg.pinv(energy, rcond=1e-10, hermitian=True) @ trace
        v = np.random.default_rng(0).normal(size=(len(side.cells), 12))
        for _ in range(300):
            v = np.einsum("nab,nb->na", step, v)
            v /= np.linalg.norm(v, axis=1)[:, None]
        left, right = (np.einsum("na,nab,nb->n", v, form, v) for form in (trace, energy))
        np.testing.assert_allclose(left / right, side.gamma, rtol=1e-6)


def test_gamma_scales_as_stress_per_length():
    """Ten times the modulus gives ten times gamma, half the cells about twice."""
    soft = joint_parts()
    stiff = joint_parts(pin=replace(ELASTIC, E=10 * ELASTIC.E))
    np.testing.assert_allclose(stiff.sides[0].gamma, 10 * soft.sides[0].gamma, rtol=1e-12)
    np.testing.assert_allclose(stiff.sides[1].gamma, soft.sides[1].gamma, rtol=1e-12)
    fine = joint_parts(size=0.1)
    assert np.median(fine.sides[1].gamma) / np.median(soft.sides[1].gamma) == pytest.approx(
        2, rel=0.2
    )


@pytest.mark.mpi
@both_sides
def test_points_normals_and_weights(number, radius, centre, comm):
    """Points on the arc, normals along the radius, weights that sum to its length: to the order of
    the geometry."""
    side = joint_parts(comm).sides[number]
    ray = side.point - centre
    distance = np.linalg.norm(ray, axis=-1)
    out = 1 if number == 0 else -1
    assert np.abs(distance / radius - 1).max(initial=0) < 1e-5
    assert np.abs(side.outward - out * ray / distance[..., None]).max(initial=0) < 1e-3
    np.testing.assert_allclose(np.linalg.norm(side.outward, axis=-1), 1, rtol=1e-14)
    total = comm.allreduce(side.weight.sum())
    assert total == pytest.approx(side.curve.arc_length(np.array([1.0]))[-1, 0], rel=1e-8)
    assert total == pytest.approx(np.pi / 2 * radius, rel=1e-5)


@pytest.mark.mpi
@both_sides
def test_arc_position(number, radius, centre, comm):
    """Angle from the bottom times radius, growing along the curve, whichever way it runs; the other
    end counts back."""
    side = joint_parts(comm).sides[number]
    s = side.arc_position(BOTTOM)
    order = s.ravel() if s[0, 0] < s[-1, -1] else s.ravel()[::-1]
    assert np.all(np.diff(order) > 0)
    ray = side.point - centre
    angle = np.arctan2(ray[..., 0], -ray[..., 1])
    np.testing.assert_allclose(s[side.facet], radius * angle, rtol=0, atol=1e-5)
    other = side.arc_position(centre + np.array([radius, 0.0]))
    np.testing.assert_allclose(s + other, np.pi / 2 * radius, rtol=1e-5)


@pytest.mark.mpi
@both_sides
def test_every_rank_holds_the_same_curve(number, radius, centre, comm):
    """Nodes and their dofs; each facet belongs to one rank, and its points lie where the curve has
    it."""
    side = joint_parts(comm).sides[number]
    for item in (side.curve.X, side.curve_dofs):
        for other in comm.allgather(item):
            np.testing.assert_array_equal(other, item)
    facets = np.sort(np.concatenate(comm.allgather(side.facet)))
    np.testing.assert_array_equal(facets, np.arange(side.n_facets))
    N, _ = side.curve.shapes(side.curve_xi[side.facet])
    on_curve = np.einsum("nqa,nai->nqi", N, side.curve.X[side.curve.connectivity[side.facet]])
    np.testing.assert_allclose(side.point, on_curve, rtol=0, atol=1e-14)
    step = np.diff(side.curve.X, axis=0)
    normal = np.stack([step[:, 1], -step[:, 0]], axis=1)
    out = 1 if number == 0 else -1
    assert np.all(out * (normal * (side.curve.X[:-1] - centre)).sum(axis=1) > 0)


@pytest.mark.mpi
@both_sides
def test_curve_displacement_collects_the_nodes_of_all_ranks(number, radius, centre, comm):
    """The field u = x gives the coordinates of the curve's nodes; forces go back to the rank that
    owns the node."""
    parts = joint_parts(comm)
    side = parts.sides[number]
    np.testing.assert_allclose(
        side.curve_displacement(coordinates(parts.V)), side.curve.X, rtol=0, atol=1e-15
    )
    force = np.zeros((parts.V.dofmap.index_map.size_local, 2))
    side.add_to_owned(side.curve.X, force)
    assert comm.allreduce((force**2).sum()) == pytest.approx((side.curve.X**2).sum(), rel=1e-13)


@every_material
def test_points_see_the_strain_of_their_own_cell(material):
    """A linear displacement gives its constant strain's stress at every point, and itself as
    displacement."""
    side = joint_parts(pin=material, block=material).sides[1]
    A = 1e-3 * np.array([[1.0, 0.4], [-0.2, -0.5]])
    displacement, force, moduli = side.deform(coordinates(side.V) @ A.T)
    np.testing.assert_allclose(displacement, side.point.reshape(-1, 2) @ A.T, rtol=0, atol=1e-15)
    xx, yy, xy = side.material.elastic_tangent @ [A[0, 0], A[1, 1], A[0, 1] + A[1, 0]]
    expected = side.outward.reshape(-1, 2) @ np.array([[xx, xy], [xy, yy]])
    np.testing.assert_allclose(force, expected, atol=1e-13)
    np.testing.assert_allclose(moduli @ [A[0, 0], A[1, 1], A[0, 1], A[1, 0]], expected, atol=1e-13)


def test_a_gap_leaves_twoin_pieces():
    """Of which each has its own arc length; neighbours and partners are found on both."""
    parts = joint_parts()
    hole = np.sort(parts.facets.find(Facets.HOLE_ARC))
    x = compute_midpoints(parts.V.mesh, 1, hole)
    cut = np.argmin(np.abs(np.arctan2(x[:, 0], -x[:, 1]) - np.pi / 4))
    whole, torn = (Surface(parts.V, facets, ELASTIC) for facets in (hole, np.delete(hole, cut)))
    assert torn.curve.n_pieces == 2
    assert torn.n_facets == whole.n_facets - 1
    assert (torn.curve.before < 0).sum() == (torn.curve.after < 0).sum() == 2
    s = torn.curve.arc_length(np.array([0.0, 1.0]))
    np.testing.assert_allclose(s[torn.curve.before < 0, 0], 0, atol=1e-15)
    assert s[torn.curve.after < 0, 1].sum() == pytest.approx(
        whole.facet_lengths().sum() * (1 - 1 / whole.n_facets)
    )
    vertices, normal = torn.curve.vertices()
    assert len(vertices) == torn.n_facets + 2
    assert np.all((normal * vertices).sum(axis=1) < 0)
    first = int(np.flatnonzero(torn.curve.after < 0)[0])
    place, near = torn.curve.neighbours(np.array([first, first + 1]), 1)
    assert sorted(zip(place, near, strict=True)) == [
        (0, first - 1),
        (0, first),
        (1, first + 1),
        (1, first + 2),
    ]
    y = torn.curve.X[torn.curve.connectivity[:, 1]]
    found = torn.curve.closest_point(
        0.99 * y, y, np.zeros_like(torn.curve.X), np.zeros(len(y), dtype=int)
    )
    np.testing.assert_array_equal(found.facet, np.arange(torn.n_facets))
    assert found.found.all()


@pytest.mark.mpi
def test_a_surface_lies_on_the_boundary(comm):
    """A line within a body, between ranks too, and none at all, are refused."""
    V = space(
        create_rectangle(comm, [[0, 0], [2.0, 3.0]], [4, 6], cell_type=CellType.quadrilateral)
    )
    V.mesh.topology.create_connectivity(1, 2)
    for x, y in ((1.0, None), (None, 1.0), (None, 1.5), (None, 2.0), (5.0, None)):
        facets = locate_entities(
            V.mesh, 1, lambda p, x=x, y=y: np.isclose(p[0] if y is None else p[1], y or x)
        )
        with pytest.raises(
            ValueError,
            match="'hole' has no facets" if x == 5 else "'hole' has facets within its body",
        ):
            Surface(V, facets, ELASTIC, "hole")


@pytest.mark.parametrize(
    ("start", "end", "order"),
    [
        ([30, 10, 20], [40, 20, 30], [1, 2, 0]),
        ([3, 1, 2], [1, 2, 3], [0, 1, 2]),
        ([7, 1, 2], [8, 2, 3], [0, 1, 2]),
        ([9, 1, 8, 7, 2], [7, 2, 9, 8, 3], [1, 4, 0, 3, 2]),
        ([3, 7, 8, 1, 9, 2], [1, 8, 9, 2, 7, 3], [0, 3, 5, 1, 2, 4]),
    ],
    ids=["a chain", "a ring", "two pieces", "a piece and a ring", "two rings"],
)
def test_facets_are_ordered_end_to_start_byin_pieces(start, end, order):
    """Open ones first, and of each kind the lowest; a ring starts at its lowest."""
    found = in_pieces(np.array(start), np.array(end), np.arange(len(start), dtype=float))
    np.testing.assert_array_equal(found, order)


def test_a_fork_is_an_error():
    """Two squares that touch at a corner: four facets meet there."""
    x = np.array([[i, j] for j in range(3) for i in range(3)], dtype=float)
    element = basix.ufl.element("P", "quadrilateral", 1, shape=(2,))
    mesh = create_mesh(MPI.COMM_SELF, cells=np.array([[0, 1, 3, 4], [4, 5, 7, 8]]), x=x, e=element)
    mesh.topology.create_connectivity(1, 2)
    with pytest.raises(ValueError, match=r"branches at \(1, 1\)"):
        Surface(space(mesh), exterior_facet_indices(mesh.topology), ELASTIC)

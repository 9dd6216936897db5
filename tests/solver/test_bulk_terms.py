"""Internal forces and stiffness of the bulk."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.materials.elasticity import mean_stress, von_mises
from archord.solver.bulk.assembly import assemble, matrix
from archord.solver.bulk.bulk import Bulk
from tests.solver.parts import (
    ELASTIC,
    HARDENING,
    INNER,
    ON_X,
    ON_Y,
    OUTER,
    PERFECT,
    PLANE_STRESS,
    YIELD_STRESS,
    E,
    commit,
    coordinates,
    edge_nodes,
    internal_force,
    n_nodes,
    quarter_annulus,
    scipy_matrix,
    space,
)

MATERIALS = {
    "elastic": ELASTIC,
    "perfect": PERFECT,
    "hardening": HARDENING,
    "plane stress": PLANE_STRESS,
}
every_material = pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS.keys())
plastic_materials = pytest.mark.parametrize(
    "material", list(MATERIALS.values())[1:], ids=list(MATERIALS)[1:]
)
YIELD_STRAIN = YIELD_STRESS / E


@pytest.fixture
def warped():
    """A quarter annulus whose interior edges are bent too."""
    return warped_annulus(MPI.COMM_SELF)


def warped_annulus(comm, size=0.4):
    tagged = quarter_annulus(comm, 1.0, 2.0, size)
    mesh = tagged.mesh
    x = tagged.mesh.geometry.x
    x[:, :2] += 0.02 * np.stack(
        [np.sin(9 * x[:, 0] + 5 * x[:, 1]), np.cos(8 * x[:, 0] - 7 * x[:, 1])], axis=1
    )
    return mesh, tagged.cells, tagged.facets


@pytest.fixture
def bulk_of(warped):
    """``bulk_of(material)`` is the bulk of the warped annulus."""
    return lambda material: Bulk(space(warped[0]), {1: warped[1].find(1)}, {1: material})


def stiffness(bulk):
    """Tangent of the last update, without supports."""
    A = matrix(bulk.V, bulk.elastic_forms)
    assemble(A, bulk.elastic_forms)
    bulk.assemble_correction(A, [])
    A.assemble()
    return scipy_matrix(A)


@every_material
def test_a_free_body_has_three_rigid_motions_and_no_other(material, bulk_of):
    """Exactly three zero eigenvalues: the three-point rule leaves no spurious mode."""
    bulk = bulk_of(material)
    bulk.update(np.zeros((n_nodes(bulk.V), 2)))
    K = stiffness(bulk).toarray()
    np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-14 * np.abs(K).max())
    value = np.linalg.eigvalsh(K) / np.linalg.norm(K, 2)
    assert np.abs(value[:3]).max() < 1e-14
    assert value[3] > 1e-4


@pytest.mark.mpi
@pytest.mark.parametrize("amount", [0.3, 3.0])
@every_material
def test_patch(material, amount, comm):
    """A linear displacement gives constant stress, on warped cells and beyond yield, and no force
    inside."""
    mesh, cells, facets = warped_annulus(comm)
    V = space(mesh)
    bulk = Bulk(V, {1: cells.find(1)}, {1: material})
    A = amount * YIELD_STRAIN * np.array([[1.0, 0.7], [-0.2, -0.5]])
    u = coordinates(V) @ A.T + [0.1, 0.2]
    force = internal_force(bulk, u)
    eps = np.array([[A[0, 0], A[1, 1], A[0, 1] + A[1, 0]]])
    expected, _, state = material.update(eps, material.state(1))
    if material.yields:
        assert (state.peeq[0] > 0) == (amount > 1)
        assert bulk.peeq()[0] == pytest.approx(state.peeq[0], rel=1e-10)
    for part in bulk.at_points(u):
        np.testing.assert_allclose(von_mises(part.stress), von_mises(expected)[0], rtol=1e-10)
        np.testing.assert_allclose(mean_stress(part.stress), expected[0, :3].mean(), rtol=1e-10)
    inside = np.ones(len(force), dtype=bool)
    for tag in (INNER, OUTER, ON_X, ON_Y):
        nodes = edge_nodes(V, facets, tag)
        inside[nodes[nodes < len(force)]] = False
    assert comm.allreduce(int(inside.sum())) > 20
    assert np.abs(force[inside]).max(initial=0) < 1e-14 * YIELD_STRESS / YIELD_STRAIN


@every_material
def test_the_tangent_is_the_derivative_of_the_internal_force(material, bulk_of):
    """Central differences in random directions, from a state with a history and partly yielding."""
    bulk = bulk_of(material)
    x = coordinates(bulk.V)
    rng = np.random.default_rng(0)
    for step in (1.0, 1.5):
        u = step * YIELD_STRAIN * np.stack([np.sin(x[:, 0] + x[:, 1]), x[:, 1] ** 2 / 4], axis=1)
        bulk.update(u)
        commit(bulk)
    u = u + 0.05 * YIELD_STRAIN * rng.normal(size=u.shape)

    def flowing(u):
        bulk.update(u)
        return np.concatenate(
            [p.trial.peeq > p.state.peeq for _, p in bulk.histories().values()]
            or [np.ones(1, dtype=bool)]
        )

    flows = flowing(u)
    assert 0.2 < flows.mean() < 0.95 or material is ELASTIC
    K = stiffness(bulk)
    h = 1e-6 * YIELD_STRAIN
    for _ in range(3):
        d = rng.normal(size=u.shape)
        np.testing.assert_array_equal(flowing(u + h * d), flows)
        np.testing.assert_array_equal(flowing(u - h * d), flows)
        difference = (internal_force(bulk, u + h * d) - internal_force(bulk, u - h * d)).ravel() / (
            2 * h
        )
        assert np.linalg.norm(K @ d.ravel() - difference) < 1e-6 * np.linalg.norm(difference)


@every_material
def test_internal_forces_do_no_work_on_rigid_motions(material, bulk_of):
    """Their sum and their moment are zero to round-off, whatever the displacement."""
    bulk = bulk_of(material)
    x = coordinates(bulk.V)
    force = internal_force(bulk, YIELD_STRAIN * np.random.default_rng(0).normal(size=x.shape))
    size = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-14 * size
    assert abs((x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]).sum()) < 1e-14 * size


def test_elastic_energy_is_half_the_work_of_the_forces(bulk_of):
    """u . f / 2, for the body with a constant matrix and for the plastic body below yield."""
    energies = []
    for material in (ELASTIC, PERFECT):
        bulk = bulk_of(material)
        u = 1e-3 * YIELD_STRAIN * np.random.default_rng(0).normal(size=(n_nodes(bulk.V), 2))
        force = internal_force(bulk, u)
        stored, dissipated = bulk.energies(u)
        assert stored == pytest.approx((u * force).sum() / 2, rel=1e-12)
        assert dissipated == 0
        energies.append(stored)
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)


@plastic_materials
def test_an_update_without_commit_leaves_no_trace(material, bulk_of):
    """Forces after an excursion far beyond yield are those of a body that never made it."""
    bulk = bulk_of(material)
    u = 0.3 * YIELD_STRAIN * np.random.default_rng(0).normal(size=(n_nodes(bulk.V), 2))
    before = internal_force(bulk, u)
    internal_force(bulk, 50 * u)
    np.testing.assert_array_equal(internal_force(bulk, u), before)
    commit(bulk)
    internal_force(bulk, 50 * u)
    commit(bulk)
    assert np.abs(internal_force(bulk, u) - before).max() > 0.1 * np.abs(before).max()


@pytest.mark.parametrize("first", [ELASTIC, HARDENING], ids=["elastic", "hardening"])
def test_bodies_keep_their_own_materials(first, warped):
    """Two bodies, the second plastic: the force is the sum of what each gives alone."""
    V = space(warped[0])
    n = V.mesh.topology.index_map(2).size_local
    half = dict(enumerate(np.split(np.arange(n, dtype=np.int32), [n // 2]), 1))
    u = YIELD_STRAIN * np.random.default_rng(0).normal(size=(n_nodes(V), 2))
    together, *apart = (
        internal_force(Bulk(V, half, m), u)
        for m in ({1: first, 2: PERFECT}, {1: first}, {2: PERFECT})
    )
    np.testing.assert_allclose(together, sum(apart), rtol=0, atol=1e-15 * E)

"""Internal forces and stiffness of the bulk in space."""

from __future__ import annotations

from collections.abc import Callable

import basix
import numpy as np
import pytest
from dolfinx import fem
from dolfinx.mesh import CellType

from archord.geometry.basis import (
    QUADRILATERAL,
    TETRAHEDRON,
    TRIANGLE,
    bulk_quadrature,
    cell_basis,
)
from archord.geometry.strain import PointStrain
from archord.kernels.compat import ghosted_vector
from archord.materials.kinematics import SPACE
from archord.materials.material import Material
from archord.solver.bulk.assembly import assemble, matrix
from archord.solver.bulk.bulk import Bulk
from archord.solver.contact.trace_inequality import trace_constants
from archord.solver.path.system import displacement_space
from tests.materials.test_space import ASKEW, tensors
from tests.solver.parts import commit, scipy_matrix
from tests.solver.space import KINDS, LARGE, MATERIALS, E, box, every_material, small_and_large


def warped(comm, kind) -> Callable[[Material], Bulk]:
    """``warped(comm, kind)(material)`` is the bulk of a box with curved edges inside."""
    mesh = box(comm, (2, 2, 2), kind=kind).mesh
    x = mesh.geometry.x
    inside = np.prod(x * (1 - x), axis=1)[:, None]
    x += 2 * inside * np.stack([np.sin(5 * x[:, 1]), np.cos(4 * x[:, 2]), x[:, 0]], axis=1)
    V = displacement_space(mesh, 2)
    every = np.arange(mesh.topology.index_map(3).size_local, dtype=np.int32)
    return lambda material: Bulk(V, {1: every}, {1: material.under(SPACE)}, SPACE, every[:3])


def internal_force(bulk: Bulk, u: np.ndarray) -> np.ndarray:
    """Internal force ``(n_owned, 3)`` at the nodal displacements ``u`` ``(n, 3)``."""
    function = fem.Function(bulk.V)
    function.x.array[:] = u.ravel()
    force = ghosted_vector(bulk.V.dofmap.index_map, 3)
    with force.localForm() as local:
        local.set(0.0)
    bulk.update(u)
    bulk.add_force(function.x.petsc_vec, force)
    return force.array_r.reshape(-1, 3).copy()


def stiffness(bulk: Bulk) -> np.ndarray:
    """Tangent of the last update, without supports."""
    A = matrix(bulk.V, bulk.elastic_forms)
    assemble(A, bulk.elastic_forms)
    bulk.assemble_correction(A, [])
    A.assemble()
    return scipy_matrix(A).toarray()


@KINDS
def test_a_free_body_has_six_rigid_motions_and_no_other(kind, comm):
    bulk = warped(comm, kind)(MATERIALS["linear"])
    x = bulk.V.tabulate_dof_coordinates()
    bulk.update(np.zeros_like(x))
    K = stiffness(bulk)
    np.testing.assert_allclose(K, K.T, rtol=0, atol=1e-14 * np.abs(K).max())
    value = np.linalg.eigvalsh(K) / np.linalg.norm(K, 2)
    assert np.abs(value[:6]).max() < 1e-14
    assert value[6] > 1e-4
    for motion in SPACE.rigid_motions(x):
        assert np.abs(K @ motion.ravel()).max() < 1e-13 * np.abs(K).max()


@KINDS
@every_material
def test_patch(material, kind, comm):
    """A linear displacement gives constant stress, also beyond yield, and no force inside."""
    bulk = warped(comm, kind)(material)
    x = bulk.V.tabulate_dof_coordinates()
    A = 0.004 * np.array([[1.0, 0.7, 0.2], [-0.2, -0.5, 0.4], [0.3, -0.6, 0.1]])
    force = internal_force(bulk, x @ A.T + [0.1, 0.2, -0.1])
    m = material.under(SPACE)
    strain = SPACE.small @ [A[i, j] for i, j in SPACE.terms]
    expected = m.update(strain[None], m.state(1))[0]
    inside = ((x > 1e-9) & (x < 1 - 1e-9)).all(axis=1)
    assert inside.sum() > 6
    assert np.abs(force[inside]).max() < 1e-13 * E
    for part in bulk.at_points(x @ A.T):
        np.testing.assert_allclose(
            part.stress, np.broadcast_to(expected, part.stress.shape), atol=1e-9 * E
        )


@KINDS
@small_and_large
def test_the_tangent_is_the_derivative_of_the_internal_force(material, kind, comm):
    """Central differences in random directions, from a state with a history and partly yielding;
    at large strain behind a finite rotation."""
    bulk = warped(comm, kind)(material)
    x = bulk.V.tabulate_dof_coordinates()
    rng = np.random.default_rng(0)
    shape = np.stack([np.sin(x[:, 0] + x[:, 1]), x[:, 1] ** 2 / 4, x[:, 0] * x[:, 2]], axis=1)
    Q = ASKEW if material.finite else np.eye(3)
    for size in (0.0015, 0.0025):
        u = (x + size * shape) @ Q.T - x
        bulk.update(u)
        commit(bulk)
    u = u + 1e-5 * rng.normal(size=u.shape)
    bulk.update(u)
    if material.yields:
        flows = [p.trial.peeq > p.state.peeq for _, p in bulk.histories().values()]
        assert 0.1 < np.concatenate(flows).mean() < 0.9
    K = stiffness(bulk)
    h = 1e-9
    for _ in range(3):
        d = rng.normal(size=u.shape)
        difference = internal_force(bulk, u + h * d) - internal_force(bulk, u - h * d)
        off = np.linalg.norm(K @ d.ravel() - difference.ravel() / (2 * h))
        limit = 1e-6 if material.finite else 1e-8  # round-off of the larger displacements
        assert off < limit * np.linalg.norm(K @ d.ravel())
    direction = fem.Function(bulk.V)
    direction.x.array[:] = d.ravel()
    action = ghosted_vector(bulk.V.dofmap.index_map, 3)
    bulk.update(u)
    bulk.add_action(direction, action)
    np.testing.assert_allclose(action.array, K @ d.ravel(), rtol=0, atol=1e-11 * E)


@pytest.mark.parametrize("material", LARGE.values(), ids=LARGE)
def test_a_finite_rotation_makes_no_force(material, comm):
    """Nor stress, nor PEEQ, nor energy."""
    bulk = warped(comm, CellType.tetrahedron)(material)
    x = bulk.V.tabulate_dof_coordinates()
    u = x @ ASKEW.T - x + [0.3, -0.2, 0.1]
    assert np.abs(internal_force(bulk, u)).max() < 1e-12 * E
    assert bulk.peeq()[0] == 0
    assert max(map(abs, bulk.energies(u))) < 1e-20 * E
    for part in bulk.at_points(u):
        assert np.abs(part.stress).max() < 1e-12 * E


def test_a_cell_that_is_turned_inside_out_is_counted(comm):
    bulk = warped(comm, CellType.tetrahedron)(MATERIALS["elastic"])
    x = bulk.V.tabulate_dof_coordinates()
    assert bulk.distortion(np.zeros_like(x)).inside_out == 0
    assert bulk.distortion(-1.5 * x * [1, 0, 0]).inside_out == bulk.n_cells
    turn = bulk.distortion(0.01 * np.cross([1.0, 2.0, 2.0], x))
    assert turn.angle == pytest.approx(0.03)
    assert turn.strain < 1e-12


@KINDS
def test_the_trace_constants_bound_the_tractions_of_any_displacement(kind, comm):
    """Of the stress along the normal and of the shear on a facet of each cell, and random ones
    come near."""
    bulk = warped(comm, kind)(MATERIALS["elastic"])
    V = bulk.V
    cells = np.arange(bulk.n_cells, dtype=np.int32)
    moduli = bulk.materials[1].elastic_tangent
    X, w = bulk_quadrature(V.mesh.basix_cell(), 2, full=True)
    basis = cell_basis(V.mesh, 2, cells, X)
    in_cell = PointStrain(SPACE, basis, V.dofmap.list), basis.measure * w
    X, w = on_first_facet(V.mesh.basix_cell())
    basis = cell_basis(V.mesh, 2, cells, X)
    outward = np.cross(basis.jacobian[..., 0], basis.jacobian[..., 1])
    area = np.linalg.norm(outward, axis=-1)
    outward = outward / area[..., None]
    on_facet = PointStrain(SPACE, basis, V.dofmap.list), area * w
    constants = trace_constants(moduli, SPACE, in_cell, on_facet, outward)

    u = np.random.default_rng(0).normal(size=(200, *V.tabulate_dof_coordinates().shape))
    ratios = []
    for displacement in u:
        strain, weight = in_cell
        e = strain(displacement)
        energy = np.einsum("nq,nqi,ij,nqj->n", weight, e, moduli, e)
        strain, weight = on_facet
        stress = tensors((strain(displacement) @ moduli).reshape(-1, 6))
        force = np.einsum("nij,nj->ni", stress, outward.reshape(-1, 3)).reshape(outward.shape)
        normal = (force * outward).sum(axis=-1)
        shear = (force**2).sum(axis=-1) - normal**2
        ratios.append([(weight * part).sum(axis=1) / energy for part in (normal**2, shear)])
    largest = np.max(ratios, axis=0)
    assert (largest <= np.array(constants) * (1 + 1e-9)).all()
    assert (largest > 0.2 * np.array(constants)).all()


def on_first_facet(cell):
    """Points ``(q, 3)`` and weights ``(q,)`` on the facet Z = 0 of the reference ``cell``."""
    facet = TRIANGLE if cell == TETRAHEDRON else QUADRILATERAL
    X, w = basix.make_quadrature(facet, 6)
    return np.pad(X, ((0, 0), (0, 1))), w

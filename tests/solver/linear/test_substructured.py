"""Each rank eliminates its own unknowns: the same solutions as with the whole matrix."""

from unittest.mock import patch

import basix.ufl
import numpy as np
import pytest
from basix import LagrangeVariant
from dolfinx import fem
from dolfinx.mesh import CellType, create_unit_square
from mpi4py import MPI
from petsc4py import PETSc

from archord.benchmarks.case import paper_joint
from archord.solver.linear import choose
from archord.solver.linear import substructured as module
from archord.solver.linear.nested_dissection import before_corners, corners, nested_dissection
from archord.solver.linear.substructured import substructures
from tests.solver.solving import MUMPS_FROM_C, joint_system, solve

SEVERAL = pytest.mark.skipif(
    MPI.COMM_WORLD.size == 1 or not MUMPS_FROM_C,
    reason="one rank has no interface, or MUMPS no headers",
)


def pressed(degree=2):
    """A joint in contact, and its tangent, unsymmetric as theta = 0 makes it."""
    with patch.object(choose, "LEFT_OUT", {"condensed"}):
        scene = paper_joint(0.1, 1, 0.002, analysis={"degree": degree})
        joint = joint_system(scene, MPI.COMM_WORLD)
    at = joint.equilibrium
    at.restore(0.004, joint.first_guess(0.004))
    at.evaluate()
    at.linear.update()
    return joint, at.linear.tangent.A


def solver_of(joint, A):
    parts = substructures(A, joint.V)
    ksp = PETSc.KSP().create(A.comm)
    ksp.setOperators(A)
    ksp.setType("preonly")
    ksp.getPC().setType("python")
    ksp.getPC().setPythonContext(parts)
    return parts, ksp


def solution(ksp, b):
    x = b.duplicate()
    ksp.solve(b, x)
    return x


@pytest.mark.mpi
@SEVERAL
@pytest.mark.parametrize("degree", [2, 3])
def test_solutions_are_those_of_the_whole_matrix(degree):
    """Of the matrix, and of another with the same pattern."""
    joint, A = pressed(degree)
    _, ksp = solver_of(joint, A)
    x, b = A.createVecs()
    for factor in (1.0, 1.5):
        A.scale(factor)
        A.shift(0.1 * factor)
        x.setRandom()
        A.mult(x, b)
        found = solution(ksp, b)
        found.axpy(-1.0, x)
        assert found.norm() < 1e-9 * x.norm()


@pytest.mark.mpi
@SEVERAL
def test_one_takes_the_place_of_another():
    """As where the pattern grows within a solve; what the first one held is free."""
    joint, A = pressed()
    first, ksp = solver_of(joint, A)
    b = A.createVecLeft()
    b.set(1.0)
    x = solution(ksp, b)
    ksp.getPC().setPythonContext(substructures(A, joint.V))
    assert first._mumps is None
    y = solution(ksp, b)
    y.axpy(-1.0, x)
    assert y.norm() < 1e-12 * x.norm()


@pytest.mark.mpi
@SEVERAL
def test_without_the_interface_no_rank_knows_of_another():
    joint, A = pressed()
    interface = module._interface(A, MPI.COMM_WORLD)
    start, end = A.getOwnershipRange()
    offsets, columns, _ = A.getValuesCSR()
    rows = np.repeat(np.arange(start, end), np.diff(offsets))
    inner = ~np.isin(rows, interface) & ~np.isin(columns, interface)
    assert ((columns[inner] >= start) & (columns[inner] < end)).all()
    ghosts = MPI.COMM_WORLD.allreduce(joint.V.dofmap.index_map.num_ghosts)
    assert (
        len(interface) < 2 * ghosts + 100
    )  # but for few of the contact, those on cells of several ranks


@pytest.mark.mpi
@SEVERAL
def test_a_singular_block_on_one_rank_has_no_number_for_an_answer_on_all():
    joint, A = pressed()
    inner = np.setdiff1d(np.arange(*A.getOwnershipRange()), module._interface(A, MPI.COMM_WORLD))
    A.zeroRowsColumns(inner[: MPI.COMM_WORLD.rank == 0].astype(PETSc.IntType), diag=0.0)
    _, ksp = solver_of(joint, A)
    b = A.createVecLeft()
    b.set(1.0)
    assert np.isnan(solution(ksp, b).array_r).all()


@pytest.mark.mpi
@SEVERAL
@pytest.mark.parametrize("control", ["displacement", "force"])
def test_a_joint_is_solved_as_without(control, monkeypatch):
    """Same iterations, same force, whether ranks eliminate their own unknowns or MUMPS works on all
    together."""
    load = (
        {}
        if control == "displacement"
        else {"load": {"displacement": None, "relative_force": 0.004}}
    )
    scene = paper_joint(0.15, 2, 0.002, **load)
    ours = solve(scene, MPI.COMM_WORLD)
    monkeypatch.setattr(choose, "LEFT_OUT", {"substructured"})
    theirs = solve(scene, MPI.COMM_WORLD)
    for a, b in zip(ours.steps, theirs.steps, strict=True):
        assert a.iterations == b.iterations
        assert pytest.approx(b["P"], rel=1e-9) == a["P"]
        assert a["delta"] == pytest.approx(b["delta"], rel=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [2, 3])
def test_corners_are_those_of_the_edge_or_triangle(degree):
    """Nodes lie on the edge, or in the middle of the triangle, of their corners (on straight ones,
    to a hundredth of them)."""
    joint, _ = pressed(degree)
    index_map = joint.V.dofmap.index_map
    everywhere = np.zeros((index_map.size_global, 2))
    n = index_map.size_local
    start = index_map.local_range[0]
    x = joint.V.tabulate_dof_coordinates()[:n, :2]
    everywhere[start : start + n] = x
    MPI.COMM_WORLD.Allreduce(MPI.IN_PLACE, everywhere)
    at = corners(joint.V)
    ends = everywhere[at]
    size = np.ptp(ends, axis=1).max(axis=1)
    alone = at[:, 0] == np.arange(start, start + n)
    assert (size[alone] == 0).all()
    assert (size[~alone] > 0).all()
    weights = {2: [1 / 2], 3: [1 / 3, 2 / 3]}[degree]
    on_edge = [
        np.abs((1 - w) * ends[:, 0] + w * ends[:, k] - x).max(axis=1)
        for w in weights
        for k in (1, 2)
    ]
    off = np.minimum.reduce([*on_edge, np.abs(ends.mean(axis=1) - x).max(axis=1)])
    assert (off[~alone] <= 0.05 * size[~alone]).all()


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [2, 3])
def test_corners_of_quads(degree):
    """As those of triangles: a node is the mean of its corners, or at a third between two (straight
    cells)."""
    equispaced = {"lagrange_variant": LagrangeVariant.equispaced, "shape": (2,)}
    element = basix.ufl.element("P", "quadrilateral", degree, **equispaced)
    V = fem.functionspace(create_unit_square(MPI.COMM_WORLD, 4, 3, CellType.quadrilateral), element)
    index_map = V.dofmap.index_map
    here = np.zeros((V.dofmap.index_map.size_global, 2))
    own = slice(*index_map.local_range)
    here[own] = V.tabulate_dof_coordinates()[: index_map.size_local, :2]
    MPI.COMM_WORLD.Allreduce(MPI.IN_PLACE, here)
    x = here[own]
    ends = here[corners(V)]
    low = ends.min(axis=1)
    high = ends.max(axis=1)
    share = (x - low) / np.where(high > low + 1e-9, high - low, 1.0)
    assert np.abs(share * degree - np.round(share * degree)).max() < 1e-12
    inside = (share > 1e-9) & (share < 1 - 1e-9)
    np.testing.assert_array_equal(inside, high > low + 1e-9)


def grid(n):
    """Couplings of a square grid of ``n`` by ``n``, and of nodes between neighbours with both;
    corners of all."""
    number = np.arange(n * n).reshape(n, n)
    neighbours = (number[:, :-1], number[:, 1:]), (number[:-1], number[1:])
    ends = np.concatenate([np.stack(pair, -1).reshape(-1, 2) for pair in neighbours])
    middle = n * n + np.arange(len(ends))
    pairs = np.concatenate([ends, *(np.stack([ends[:, k], middle], -1) for k in range(2))])
    corner = np.concatenate([np.repeat(np.arange(n * n), 3).reshape(-1, 3), ends[:, [0, 1, 0]]])
    return len(corner), *pairs.T, corner


def fill_in(n, rows, columns, place):
    """Entries of the factor, found by elimination of sets."""
    later = [set() for _ in range(n)]
    for a, b in zip(place[rows], place[columns], strict=True):
        later[min(a, b)].add(max(a, b))
    for i in range(n):
        if later[i]:
            first = min(later[i])
            later[first] |= later[i] - {first}
    return sum(map(len, later))


def test_few_entries_fill_in():
    """Orders are permutations; less fill-in than with the rows as they come, and not more for the
    sake of corners."""
    n, rows, columns, corner = grid(24)
    whole = nested_dissection(n, rows, columns)
    quick = before_corners(n, rows, columns, corner)
    for place in (whole, quick):
        assert sorted(place) == list(range(n))
    middle = np.flatnonzero(corner[:, 0] != np.arange(n))
    assert (quick[middle] < quick[corner[middle]].min(axis=1)).all()
    natural, metis, ours = (
        fill_in(n, rows, columns, place) for place in (np.arange(n), whole, quick)
    )
    assert metis < natural / 1.5
    assert ours < 1.1 * metis
    none = np.zeros(0, dtype=np.int64)  # coupled
    assert [nested_dissection(k, none, none).tolist() for k in (3, 0)] == [[0, 1, 2], []]

"""Multigrid: solutions of the whole matrix, iterations that do not grow, and Newton's method as by
a factorisation."""

import numpy as np
import pytest
from dolfinx import fem
from dolfinx.mesh import CellType, create_unit_cube, create_unit_square
from mpi4py import MPI
from petsc4py import PETSc

from archord.benchmarks.case import paper_joint
from archord.geometry.strain import strain_terms
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematics import PLANE_STRAIN, SPACE
from archord.solver.bulk.assembly import assemble, matrix
from archord.solver.bulk.stiffness import CellStiffness, value_terms
from archord.solver.linear import choose
from archord.solver.linear import multigrid as module
from archord.solver.linear.forcing import LOOSEST, forcing_term
from archord.solver.linear.multigrid import Multigrid
from archord.solver.path.stepping import Step, StepFailure, march
from archord.solver.path.system import System, displacement_space
from archord.solver.problem import Body, Dirichlet, Interaction, Load, Problem, Support
from tests.solver.contact.blocks_in_space import bodies, tagged
from tests.solver.solving import solve
from tests.solver.space import MATERIALS, box

FORCE = {"displacement": None, "relative_force": 0.01}


def elastic_cube(n, cell=CellType.tetrahedron, degree=2, comm=MPI.COMM_WORLD, skew=0.0, nu=0.3):
    """The displacements, the fixed ones, and the matrix of a cube (a square for triangles) that is
    held at its bottom and stands on a plane of symmetry; with a term that is not symmetric."""
    if cell == CellType.triangle:
        mesh = create_unit_square(comm, n, n)
    else:
        mesh = create_unit_cube(comm, n, n, n, cell)
    d = mesh.geometry.dim
    V = displacement_space(mesh, degree)
    x = V.tabulate_dof_coordinates()
    fixed = np.zeros((len(x), d), dtype=bool)
    fixed[np.isclose(x[:, d - 1], 0)] = True
    fixed[np.isclose(x[:, 0], 0), 0] = True
    kinematics = SPACE if d == 3 else PLANE_STRAIN
    values = value_terms(d)
    values[:, 2] += d * d
    terms = np.concatenate([strain_terms(kinematics, large=True), values])
    moduli = np.zeros((d * d + d,) * 2)
    small = kinematics.small
    moduli[: d * d, : d * d] = small.T @ Elastic(1.0, nu, kinematics.name).elastic_tangent @ small
    for gradient, (component, _) in enumerate(kinematics.terms):
        moduli[d * d + component, gradient] = skew
    cells = np.arange(mesh.topology.index_map(d).size_local)
    form = CellStiffness(V, kinematics, 2 * degree, terms, moduli).over(cells)
    nodes = [np.flatnonzero(fixed[:, axis]).astype(np.int32) for axis in range(d)]
    bcs = [fem.dirichletbc(0.0, d * nodes[axis] + axis, V.sub(axis)) for axis in range(d)]
    A = matrix(V, [form])
    assemble(A, [form], bcs)
    A.assemble()
    return V, fixed, A


def solver(A, V, fixed, rtol=1e-8):
    ksp = PETSc.KSP().create(A.comm)
    Multigrid([A], V, fixed).attach(ksp)
    ksp.setTolerances(rtol=rtol)
    return ksp


def error(ksp, A):
    """The relative error of a solution that is known."""
    x, b = A.createVecs()
    x.array[:] = np.sin(np.arange(*x.getOwnershipRange()))
    A.mult(x, b)
    found = x.duplicate()
    ksp.solve(b, found)
    found.axpy(-1.0, x)
    return found.norm() / x.norm()


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("cell", "degree", "skew"),
    [
        (CellType.tetrahedron, 2, 0.0),
        (CellType.tetrahedron, 2, 1.0),
        (CellType.tetrahedron, 1, 0.0),
        (CellType.tetrahedron, 3, 0.0),
        (CellType.hexahedron, 2, 0.0),
        (CellType.triangle, 2, 0.0),
    ],
)
def test_solutions_are_those_of_the_whole_matrix(cell, degree, skew):
    """Of the matrix, and of another with the same pattern; with prescribed displacements."""
    V, fixed, A = elastic_cube(6, cell, degree, skew=skew)
    ksp = solver(A, V, fixed, rtol=1e-10)
    assert error(ksp, A) < 1e-7
    A.shift(0.5)
    assert error(ksp, A) < 1e-7
    assert ksp.getIterationNumber() < 30


@pytest.mark.mpi
def test_iterations_do_not_grow_with_the_mesh():
    counts = []
    for n in (4, 9, 14):  # 2 000, 21 000 and 73 000 dofs
        V, fixed, A = elastic_cube(n)
        ksp = solver(A, V, fixed)
        error(ksp, A)
        counts.append(ksp.getIterationNumber())
    assert max(counts) < 16
    assert counts[-1] <= counts[0] + 4


@pytest.mark.mpi
def test_nearly_incompressible_bodies_need_hardly_more_iterations_on_several_ranks():
    """Ranks smooth at once, each as if the others' nodes were held."""
    V, fixed, A = elastic_cube(4, nu=0.49)
    ksp = solver(A, V, fixed)
    error(ksp, A)
    assert ksp.getIterationNumber() < 45  # 34 on one rank


@pytest.mark.mpi
def test_linear_displacements_are_interpolated_but_where_they_are_fixed():
    """All but the fixed ones; a fixed displacement at a vertex is itself alone."""
    V, fixed, A = elastic_cube(3)
    ksp = solver(A, V, fixed)
    ksp.setUp()
    strategy = ksp.getPC().getPythonContext()
    n = V.dofmap.index_map.size_local
    x = V.tabulate_dof_coordinates()[:n]
    coarse, fine = strategy.interpolation.createVecs()
    coarse.set(1.0)
    strategy.interpolation.mult(coarse, fine)
    ones = fine.array.reshape(-1, 3)
    beside = (x[:, 2] < 0.3) | (x[:, 0] < 0.3)  # in a cell with fixed displacements
    assert np.allclose(ones[~beside], 1.0)
    at_vertex = np.isclose(x * 3, np.round(x * 3)).all(axis=1)
    assert np.allclose(
        ones[fixed[:n]], np.broadcast_to(at_vertex[:, None], fixed[:n].shape)[fixed[:n]]
    )
    assert strategy.linear.getDiagonal().min()[1] > 0


@pytest.mark.mpi
@pytest.mark.parametrize(("cell", "motions"), [(CellType.tetrahedron, 6), (CellType.triangle, 3)])
def test_rigid_motions_are_the_near_null_space(cell, motions):
    V, fixed, A = elastic_cube(3, cell)
    ksp = solver(A, V, fixed)
    ksp.setUp()
    near = ksp.getPC().getPythonContext().entries.getNearNullSpace()
    assert len(near.getVecs()) == motions


def test_the_forcing_term_falls_with_the_residual_and_no_further_than_the_goal():
    residuals = (0.9, 1e-2, 1e-3, 1e-4)
    terms = [forcing_term([1.0, now], 1e-14, is_linear=False) for now in residuals]
    assert terms == sorted(terms, reverse=True)
    assert terms[-1] == pytest.approx(1e-8)  # of quadratic convergence
    assert forcing_term([1.0, 1e-10], 1e-10, is_linear=False) == LOOSEST
    assert forcing_term([1.0], 1e-10, is_linear=True) == pytest.approx(1e-12)
    assert forcing_term([0.0], 1e-10, is_linear=True) == LOOSEST


@pytest.mark.parametrize(
    ("scene", "by"),
    [
        (paper_joint(0.1, 3), "multigrid + look_ahead"),
        (paper_joint(0.1, 3, 0.002), "multigrid + look_ahead"),
        (paper_joint(0.1, 3, 0.002, analysis={"friction": 0.3}), "multigrid + look_ahead"),
        (paper_joint(0.1, 3, 0.004, load=FORCE), "bordered + multigrid + look_ahead"),
    ],
)
def test_newtons_method_needs_hardly_more_iterations(scene, by, monkeypatch):
    """Contact included, in a plane, beside a factorisation with the same updates."""
    updates = set() if "look_ahead" in by else {"look_ahead"}
    monkeypatch.setattr(choose, "LEFT_OUT", {"condensed"} | updates)
    usual = solve(scene)
    monkeypatch.setattr(module, "LEAST_DIMENSION", 2)
    monkeypatch.setattr(module, "FEWEST_DOFS", 0)
    found = solve(scene)
    assert found.joint.equilibrium.linear.choice.words()["strategy"] == by
    before = sum(step.iterations for step in usual.steps)
    assert sum(step.iterations for step in found.steps) <= 1.1 * before + 1
    assert found.steps[-1].work == pytest.approx(usual.steps[-1].work, rel=1e-8)


def test_a_body_in_space_yields_in_hardly_more_iterations(monkeypatch):
    def solved() -> tuple[int, float]:
        pull = [Dirichlet(side, side, axis) for side in ("z0", "z1") for axis in (0, 1)]
        pull += [Dirichlet("z0", "z0", 2), Dirichlet("z1", "z1", 2, 0.006)]
        mesh = box(MPI.COMM_SELF, (6, 6, 6))
        bodies = [Body("box", MATERIALS["linear"])]
        system = System(Problem(mesh, bodies, supports=pull, kinematics="space"))
        counts = []
        march(system.load_path(), [0.5, 1.0], attempted=lambda load, n: counts.append(n))
        return sum(counts), system.reaction("z1")[2]

    iterations, force = solved()
    monkeypatch.setattr(choose, "LEFT_OUT", {"multigrid"})
    usual, expected = solved()
    assert iterations <= usual + 1
    assert force == pytest.approx(expected, rel=1e-8)


def test_a_loose_body_yields_as_by_a_factorisation(monkeypatch):
    """Weak springs are added to a matrix to which the cells that yield have added theirs."""
    metal = J2Material(210e3, 0.3, "space", LinearHardening(200.0, 2000.0))

    def moved() -> float:
        problem = Problem(
            tagged(bodies(MPI.COMM_SELF)),
            [Body("lower", metal), Body("upper", metal)],
            [Interaction("contact", ("upper", "lower"))],
            [Support("base"), Support("left", fixed="x"), Support("front", fixed="y")],
            [Load("press", on="upper", direction="z", force=-300.0)],
        )
        system = System(problem)
        system.solve([1.0])
        assert system.peeq()[0] > 1e-3
        return system.drive_displacement("press")

    usual = moved()
    monkeypatch.setattr(module, "FEWEST_DOFS", 0)
    assert moved() == pytest.approx(usual, rel=1e-8)


def _pressed(load: Load) -> System:
    """A body that is pressed against another one by a ``load`` named "press"."""
    supports = [Support("base"), Support("left", fixed="x"), Support("front", fixed="y")]
    problem = Problem(
        tagged(bodies(MPI.COMM_SELF)),
        [Body("lower", Elastic(210e3, 0.3)), Body("upper", Elastic(70e3, 0.3))],
        [Interaction("contact", ("upper", "lower"))],
        supports,
        [load],
    )
    return System(problem)


def _only_step(system: System) -> Step:
    steps = []
    march(system.load_path(), [1.0], target_done=lambda step, _: steps.append(step))
    [step] = steps
    return step


def test_a_force_takes_hardly_more_iterations_than_a_displacement(monkeypatch):
    """GMRES solves the bordered system once, and no more accurately than Newton's method needs. The
    matrix alone was solved twice in each Newton iteration, to 1e-10: four times as many
    iterations."""
    monkeypatch.setattr(module, "FEWEST_DOFS", 0)
    by_force = _pressed(Load("press", on="upper", direction="z", force=-300.0))
    step = _only_step(by_force)
    moved = by_force.drive_displacement("press")
    driven = _pressed(Load("press", on="upper", direction="z", displacement=moved))
    other = _only_step(driven)
    assert driven.drive_force("press") == pytest.approx(-300.0, rel=1e-8)
    krylov, usual = (sum(solve.krylov_iterations for solve in s.attempts) for s in (step, other))
    assert step.iterations <= other.iterations + 1
    assert krylov < 1.5 * usual


def test_what_nothing_holds_is_told_by_multigrid_as_by_a_factorisation(monkeypatch):
    """A force that pulls a body away, where A^-1 B is known roughly at first."""
    told = []
    for fewest in (10**9, 0):
        monkeypatch.setattr(module, "FEWEST_DOFS", fewest)
        system = _pressed(Load("press", on="upper", direction="z", force=300.0))
        with pytest.raises(StepFailure) as refused:
            system.solve([1.0])
        told.append(str(refused.value))
    assert told[0] == told[1]
    assert "nothing holds" in told[0]

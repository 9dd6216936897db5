"""Elements of third order: the same laws, the same limit, the same files."""

import h5py
import numpy as np
import pytest

from archord.geometry.basis import TRIANGLE
from archord.geometry.curve import lagrange
from archord.geometry.meshes.second_order import SecondOrder
from archord.output.files.step_file import step_name
from archord.output.run import solve_scene
from tests.solver.parts import DR
from tests.solver.solving import scene, solve

CUBIC = {"degree": 3}


def test_both_degrees_find_the_same_joint():
    """At 0.1 R, elements of second and third order agree in P within 2e-4, and the third are nearer
    to a fine mesh."""
    second, third, fine = (
        solve(scene(h, 2, joint={"growth": growth}, analysis={"degree": degree})).steps[-1]["P"]
        for h, growth, degree in ((0.1, 0.3, 2), (0.1, 0.3, 3), (0.05, 0.15, 3))
    )
    assert abs(third / fine - 1) < 4e-5 < abs(second / fine - 1) < 5e-4


@pytest.mark.mpi
@pytest.mark.parametrize(
    "sections", [{}, {"yield_stress": 0.002}, {"pin": {"rigid": True, "E": None, "nu": None}}]
)
def test_forces_and_energies_balance(sections, comm):
    """Of third order too, whatever the number of ranks."""
    solution = solve(scene(0.2, 4, analysis=CUBIC, **sections), comm)
    for m in solution.steps:
        assert m.force_balance < 1e-9
    last = solution.steps[-1]
    assert last.elastic_energy + last.plastic_dissipation == pytest.approx(last.work, rel=0.03)


def test_fields_of_third_order_are_written_on_second_order_triangles(tmp_path):
    """All of the displacement's values at vertices and middles, on a mesh whose arcs lie on their
    circles."""
    problem = scene(0.2, 1, analysis=CUBIC)
    solve_scene(problem, tmp_path)
    u = solve(problem).joint.equilibrium.displacement()
    with h5py.File(tmp_path / "fields.h5") as file:
        x = file["mesh/coordinates"][:, :2]
        cells = file["mesh/cells"][()]
        written = file["displacement"][step_name(1)][()]
    assert cells.shape[1] == 6
    assert len(x) == len(written) == cells.max() + 1
    assert np.ptp(written[:, 1]) == pytest.approx(np.ptp(u[:, 1]), rel=1e-3)
    radius = np.hypot(x[:, 0], x[:, 1])
    on_hole = np.abs(radius - 1 - DR) < 1e-6
    assert on_hole.sum() >= 2 * 8 + 1


def test_middles_of_polynomials_are_exact():
    """A cubic along the edges is found at their middles; vertices stay what they are."""
    nodes = lagrange(3)
    assert nodes.shape == (4, 4)
    t = np.arange(4) / 3
    cell = np.arange(10)[None]
    x = np.zeros((10, 2))
    x[:3] = [[0, 0], [1, 0], [0, 1]]
    ends = [(1, 2), (0, 2), (0, 1)]
    for k, (i, j) in enumerate(ends):
        x[3 + 2 * k : 5 + 2 * k] = x[i] + t[1:3, None] * (x[j] - x[i])
    x[9] = 1 / 3
    f = lambda p: p[:, :1] ** 3 - 2 * p[:, 1:] ** 2 * p[:, :1] + p[:, 1:]  # noqa: E731
    second = SecondOrder(TRIANGLE, cell)
    middles = np.array([(x[i] + x[j]) / 2 for i, j in ends])
    at = second(f(x))
    np.testing.assert_allclose(at[second.cells[0, :3]], f(x[:3]), rtol=0, atol=0)
    np.testing.assert_allclose(at[second.cells[0, 3:]], f(middles), rtol=0, atol=1e-15)

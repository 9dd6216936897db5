"""Problems of others: quick ones against closed forms, and what their tables say."""

from dataclasses import replace

import numpy as np
import pytest

from archord.benchmarks.axisymmetric.case import solved
from archord.benchmarks.outside import table
from archord.benchmarks.outside.neo_hooke import NeoHooke
from archord.solver.problem import Load


def of(name):
    (problem,) = table.chosen(name)
    return problem


@pytest.mark.parametrize("name", ["patch test, friction 0", "patch test, friction 0.2"])
def test_the_patch_test_of_meshes_that_do_not_match_gives_the_closed_form(name):
    problem = next(problem for problem in table.PROBLEMS if problem.name == name)
    values = problem.study()[0]
    # the contact is that of the deformed blocks, whose strains are 1e-4: products of strains remain
    assert values["p0"] == pytest.approx(109.89, rel=2e-8)
    stress_over_modulus = 109.89 / 1e6
    sideways = 0.3 * 1.3 * stress_over_modulus
    downwards = -(1 - 0.3**2) * stress_over_modulus
    assert values["ux at the corner"] == pytest.approx(sideways, rel=2e-8)
    assert values["uy at the corner"] == pytest.approx(downwards, rel=2e-8)


def test_the_cylinder_on_a_block_is_near_hertz():
    problem = replace(of("NAFEMS 1, cylinder on block"), finer=(1,))
    (values,) = problem.study()
    for published in problem.published:
        if published.by == "Hertz":
            assert values[published.quantity] == pytest.approx(published.value, rel=0.01)


def test_every_published_value_is_of_a_quantity_that_is_read(tmp_path):
    problem = replace(of("NAFEMS 4"), finer=(1, 1))
    rows = table.run([problem], lambda sentence: None)
    assert len(rows) == len(problem.published)
    text, files = table.write(rows, [problem], tmp_path)
    assert problem.verdict in text
    assert all(file.exists() for file in files)


def last_force(name, folder, moved, steps, **held):
    """The last force on the drive "press" where it alone moves, on the coarsest mesh."""
    problem = of(name).problem(1)
    (press,) = (load for load in problem.loads if load.name == "press")
    loads = [Load("press", on=press.on, direction=press.direction, displacement=moved)]
    loads += [
        Load(name, on=press.on, direction=axis, displacement=0.0) for name, axis in held.items()
    ]
    run = solved(replace(problem, loads=loads, steps=steps), folder)
    return run.history["press force"].iloc[-1]


def test_the_eye_bar_is_that_of_calculix(tmp_path):
    """CalculiX with elements of second order and small strain: see examples/eyebar."""
    assert last_force("eye bar", tmp_path, 0.05, 4) == pytest.approx(807.2, rel=5e-3)


def test_the_iron_presses_a_slab_as_on_finer_meshes(tmp_path):
    """0.05 mm, in the neo-Hookean solid, which is archord's own at small strain."""
    force = last_force("ironing in plane strain", tmp_path, -0.05, 1, slide="x")
    assert force == pytest.approx(-11.2, rel=0.01)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_the_derivative_of_the_neo_hookean_stress_is_that_of_differences(plane):
    """The stress is the derivative of the energy, and the moduli those of the stress; Cauchy's
    stress does not turn with the axes of a pure rotation."""
    solid = NeoHooke(3.0, 0.3, plane)
    gradient = np.array([[0.2, -0.3, 0.1, -0.15]])
    stress, tangent, _ = solid.update(gradient, None)
    h = 1e-6
    for k in range(4):
        steps = [gradient + sign * h * np.eye(4)[k] for sign in (1, -1)]
        up, down = (solid.update(step, None)[0] for step in steps)
        more, less = (solid.stored(step, stress, None) for step in steps)
        assert (up - down)[0] / (2 * h) == pytest.approx(tangent[0, :, k], rel=1e-7, abs=1e-8)
        assert (more - less)[0] / (2 * h) == pytest.approx(stress[0, k], rel=1e-7)
    cos, sin = np.cos(0.7), np.sin(0.7)
    turned = np.array([[cos - 1, cos - 1, -sin, sin]])
    assert solid.true_stress(turned, solid.update(turned, None)[0], None) == pytest.approx(
        0, abs=1e-12
    )

"""Problems of others: quick ones against closed forms, and what their tables say."""

from dataclasses import replace

import pytest

from archord.benchmarks.outside import table


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

"""A scene's variants pay only for what they use."""

from dataclasses import replace

import pytest

from archord.benchmarks.cost.variants import WATCHED, run, variants, write

CHOSEN = ("elastic, rigid pin", "elastic, no fields", "plastic", "picture of plastic")


@pytest.fixture(scope="module")
def uses(tmp_path_factory):
    """On a coarser mesh and in fewer steps than the benchmark's, which load the same."""
    chosen = [variant for variant in variants(0.12, 2) if variant.name in CHOSEN]
    return {used.variant.name: used for used in run(chosen, tmp_path_factory.mktemp("runs"), 1, warm=False)}


def test_what_is_used_is_loaded_and_nothing_else(uses):
    """That something is loaded where it is used makes its absence elsewhere say something."""
    assert not [fault for used in uses.values() for fault in used.faults()]
    plastic = {
        "archord.materials.j2",
        "kernel radial_return",
        "archord.output.fields",
        "kernel closest_point",
        "dolfinx",
    }
    assert plastic <= set(uses["plastic"].loaded)
    assert "kernel closest_point" in uses["elastic, no fields"].loaded
    assert "matplotlib" in uses["picture of plastic"].loaded


def test_less_is_written_and_solved_where_less_is_wanted(uses):
    """No fields: less than half of what the same joint writes with them; a rigid pin has no dofs."""
    assert uses["elastic, no fields"].written < 0.5 * uses["plastic"].written
    assert uses["elastic, rigid pin"].dofs < uses["plastic"].dofs == uses["elastic, no fields"].dofs
    assert all(used.memory > 8 * used.dofs and used.modules > 100 and used.seconds > 0 for used in uses.values())


def test_what_is_not_needed_is_told(uses, tmp_path):
    plastic = uses["plastic"]
    wasteful = replace(plastic, loaded=(*plastic.loaded, "scipy"))
    assert wasteful.faults() == ["plastic: loads scipy, which it does not need"]
    text, files = write([wasteful], tmp_path)
    assert text.count("\n") == 3
    assert {file.name for file in files} == {"variants.csv", "variants.md"}
    assert all(set(v.unused) <= set(WATCHED) for v in variants())

"""The mesh of the lug, and that its half, its whole and its whole pin are one joint."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.shapes.lug import lug
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Interaction, Problem
from tests.geometry.shapes.measures import area, facet_nodes, length
from tests.solver.parts import ELASTIC

R = 10.0
DR = 0.1
WIDTH = 40.0
EDGE = 20.0
LENGTH = 60.0
SIZE = 1.5
GROWTH = 0.4
HOLE = R + DR


def made(width=WIDTH, edge=EDGE, size=SIZE, comm=MPI.COMM_SELF, scale=1.0, **options):
    lengths = (scale * v for v in (R, DR, width, edge, LENGTH, size))
    return lug(comm, *lengths, GROWTH, **options)


def end_area(width, edge, end):
    """Area of the plate beyond x = -length: a square end, or a rectangle and a half disc, however
    far its apex is."""
    return width * (LENGTH + edge - (width / 2 if end == "round" else 0.0)) + (
        np.pi * width**2 / 8 if end == "round" else 0.0
    )


@pytest.mark.mpi
@pytest.mark.parametrize("end", ["round", "square"])
@pytest.mark.parametrize(
    ("width", "edge"), [(40.0, 20.0), (30.0, 45.0), (80.0, 15.0), (24.5, 12.2)]
)
def test_areas_are_those_of_the_drawing(width, edge, end, comm):
    """To what parabolas leave of arcs, for apexes before, on and behind the centre of the hole."""
    joint = made(width, edge, 0.8, comm, end=end, degree=3)
    assert 2 * area(joint, "pin", comm) == pytest.approx(np.pi * R**2 / 2, rel=2e-7)
    assert 2 * area(joint, "lug", comm) == pytest.approx(
        end_area(width, edge, end) - np.pi * HOLE**2, rel=3e-5
    )


@pytest.mark.parametrize(
    ("half", "pin", "parts"), [(True, "half", 1), (True, "whole", 2), (False, "half", 2)]
)
def test_every_part_is_there(half, pin, parts):
    """A whole pin has twice the area of a half one, a whole model that of two halves; the driven
    line halves it."""
    joint = made(half=half, pin=pin)
    once = made()
    assert area(joint, "pin") == pytest.approx(parts * area(once, "pin"), rel=1e-9)
    assert area(joint, "lug") == pytest.approx((2 - half) * area(once, "lug"), rel=1e-9)
    np.testing.assert_allclose(facet_nodes(joint, "flat")[..., 0], DR, atol=1e-12)
    assert length(joint, "flat") == pytest.approx((2 - half) * R)
    np.testing.assert_allclose(facet_nodes(joint, "axis")[..., 1], 0.0, atol=1e-12)
    assert length(joint, "clamp") == pytest.approx((2 - half) * WIDTH / 2)
    assert joint.point_sets["centre"] == pytest.approx(np.array([[DR, 0.0]]))


def test_arcs_are_round_to_round_off_and_touch_on_the_axis():
    """All nodes of pin, hole and end on their circles; equal edges on both arcs; a gap of 0 at the
    axis alone."""
    joint = made(pin="whole")
    for name, centre, radius in (("pin", DR, R), ("hole", 0.0, HOLE), ("end", 0.0, WIDTH / 2)):
        x = facet_nodes(joint, name) - [centre, 0.0]
        np.testing.assert_allclose(np.linalg.norm(x, axis=-1), radius, rtol=4e-16)
    for name, radius in (("pin", R), ("hole", HOLE)):
        x = facet_nodes(joint, name)
        assert np.linalg.norm(x[:, 0] - x[:, 1], axis=1) == pytest.approx(
            2 * radius * np.sin(np.pi / 44), rel=1e-6
        )
    assert facet_nodes(joint, "pin")[..., 0].max() == pytest.approx(HOLE, abs=1e-14)


def test_a_rigid_pin_is_not_meshed():
    joint = made(pin="none")
    assert set(joint.cells.values) == set(joint.cell_sets["lug"])
    assert not joint.point_sets


def test_meshes_do_not_depend_on_units():
    """In metres as in millimetres, to the last digits."""
    in_mm = made()
    in_m = made(scale=1e-3)
    np.testing.assert_allclose(
        in_m.mesh.geometry.x, 1e-3 * in_mm.mesh.geometry.x, rtol=1e-13, atol=1e-17
    )
    assert (in_m.mesh.geometry.dofmap == in_mm.mesh.geometry.dofmap).all()


@pytest.mark.parametrize(("width", "edge"), [(24.0, 40.0), (60.0, 12.0)])
def test_a_narrow_ligament_has_three_elements_across(width, edge):
    """However large the elements elsewhere may be."""
    joint = made(width, edge, 4.0)
    ligament = min(width / 2, edge) - HOLE
    x = facet_nodes(joint, "hole")
    assert np.linalg.norm(x[:, 0] - x[:, 1], axis=1).max() <= ligament / 3 * HOLE / R


def solved(**options):
    joint = made(**options)
    half = options.get("half", True)
    supports = [Dirichlet("clamp", "clamp", axis) for axis in (0, 1)]
    supports += [
        Dirichlet("flat", "flat", 0, 1.0),
        Dirichlet("centre", "axis" if half else "centre", 1),
    ]
    contact = Interaction("contact", ("pin", "hole"))
    bodies = [Body(name, ELASTIC) for name in ("pin", "lug")]
    system = System(Problem(joint, bodies, [contact], supports, symmetry=1.0 + half))
    system.solve([0.5 * DR, DR])
    return system


@pytest.mark.parametrize("pin", ["half", "whole"])
def test_the_whole_lug_is_twice_the_half(pin):
    """Forces balance where contact spreads over the node at which a closed hole begins."""
    half = solved(pin=pin)
    whole = solved(pin=pin, half=False)
    assert whole.reaction("flat")[0] == pytest.approx(half.reaction("flat")[0], rel=1e-4)
    for system in (half, whole):
        assert -system.reaction("clamp")[0] == pytest.approx(system.reaction("flat")[0], rel=1e-8)

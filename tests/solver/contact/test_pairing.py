"""Pairs of contact points: none is missed, whatever the start of the search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry import curve as curve_module
from archord.geometry.curve import Curve, ProjectionError
from archord.geometry.shapes.rectangles import rectangles
from archord.materials.elasticity import Elastic
from archord.measures.edge import surface_profiles
from archord.solver.path.system import System
from archord.solver.problem import Body, Interaction, Problem, Support
from tests.geometry.shapes.measures import Cells
from tests.solver.parts import DR, contact_force, interact, joint_parts, n_nodes, nodes_of


@pytest.mark.parametrize("seed", range(3))
def test_a_corrupted_start_does_not_change_the_forces(seed):
    """Start facets drawn at random lead to the pairs, and the forces, of a search over the whole
    curve."""
    parts = joint_parts(size=0.1)
    contact = parts.contact
    u = parts.pressed(1.5 * DR, noise=1e-4)
    contact.search()
    expected = contact_force(contact, u)
    rng = np.random.default_rng(seed)
    for pair in contact.pairs:
        random = rng.integers(0, pair.opposite.n_facets, len(pair.projection.facet))
        pair.projection = replace(pair.projection, facet=random)
    np.testing.assert_allclose(
        contact_force(contact, u), expected, rtol=0, atol=1e-12 * np.abs(expected).max()
    )


def test_the_path_to_a_state_does_not_change_its_pairs():
    """Pairs followed from far away, step by step, are those of a search from scratch."""
    parts = joint_parts(size=0.1)
    contact = parts.contact
    u = parts.pressed(1.5 * DR)
    pin = nodes_of(parts.V, parts.cells, Cells.PIN)
    for slid in np.linspace(0.5, 0, 6):
        v = u.copy()
        v[pin, 0] += slid
        contact.evaluate(v)
    followed = contact_force(contact, u)
    contact.search()
    fresh = contact_force(contact, u)
    assert np.abs(fresh).max() > 0
    np.testing.assert_allclose(followed, fresh, rtol=0, atol=1e-12 * np.abs(fresh).max())


def test_only_points_beyond_the_ends_have_no_partner():
    """At rest every point within the arcs is paired; pressed down, those of the pin below the
    block's top still are."""
    parts = joint_parts(size=0.1)
    contact = parts.contact
    for depth in (0.0, 1.5 * DR, 0.05):
        u = parts.pressed(0.0)
        u[nodes_of(parts.V, parts.cells, Cells.PIN), 1] -= depth
        contact.evaluate(u)
        pin, hole = (
            contact.pair_of(side).projection.found.reshape(side.weight.shape)
            for side in parts.sides
        )
        below = parts.sides[0].point[..., 1] - depth < 0
        assert below.any()
        assert pin[below].all()
        covered = parts.sides[1].point[..., 1] < -DR - depth
        assert hole[covered].all()


@pytest.mark.mpi
@pytest.mark.parametrize("when", ["at rest", "moving"])
def test_a_lost_point_is_an_error_on_every_rank(when, comm, monkeypatch):
    """A projection that fails on one rank is raised by all, at the start and at any later
    evaluation: none waits."""
    parts = joint_parts(comm)
    rest = np.zeros((n_nodes(parts.V), 2))
    parts.contact.evaluate(rest)
    search = {
        "at rest": lambda: interact(parts.sides),
        "moving": lambda: parts.contact.evaluate(rest),
    }[when]
    lost = comm.size - 1
    project = Curve._project

    def fail(self, *arguments):
        if comm.rank == lost:
            raise ProjectionError("one point is lost")
        return project(self, *arguments)

    monkeypatch.setattr(Curve, "_project", fail)
    with pytest.raises(ProjectionError, match="one point is lost"):
        search()


def test_a_point_that_does_not_converge_is_an_error(monkeypatch):
    """It is not taken for a point without a partner."""
    parts = joint_parts()
    monkeypatch.setattr(curve_module, "_NEWTON_STEPS", 1)
    with pytest.raises(ProjectionError, match="found no closest point"):
        parts.contact.evaluate(parts.pressed(1.5 * DR, noise=1e-3))


def test_points_that_face_nothing_are_open():
    """Those of the longer block beside the shorter one, which was drawn into it, lay below the line
    that continues its lower edge."""
    boxes = {"lower": (0.0, 0.0, 4.0, 1.0), "upper": (1.0, 0.9, 2.0, 1.0)}
    fit = Interaction("fit", ("upper bottom", "lower top"), overlap=0.1)
    system = System(
        Problem(
            rectangles(boxes, 0.5, MPI.COMM_SELF),
            bodies=[Body(name, Elastic(1000.0, 0.3)) for name in boxes],
            interactions=[fit],
            supports=[Support("lower bottom"), Support("upper top")],
            steps=1,
        )
    )
    system.solve([1.0])
    profile = surface_profiles(system)["lower top"]
    x = profile.X[..., 0]
    beside = np.maximum(1.0 - x, x - 3.0)
    is_beside = beside > 0.1
    assert (profile.gap[is_beside] > beside[is_beside] - 0.06).all()
    assert not profile.slip[is_beside].any()


def test_sliding_out_of_the_pattern_extends_it():
    """The matrix pattern grows with the pairs, and says so; a state seen before needs no more
    room."""
    parts = joint_parts(size=0.1)
    u = parts.pressed(1.5 * DR)
    assert not parts.contact.evaluate(u)
    before = parts.contact.pattern()[0].size
    u[nodes_of(parts.V, parts.cells, Cells.PIN), 0] += 0.5
    assert parts.contact.evaluate(u)
    assert parts.contact.pattern()[0].size > before
    assert not parts.contact.evaluate(u)

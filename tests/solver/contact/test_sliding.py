"""Pressures of surfaces that have slid on each other: points of the quadrature stay where the
undeformed facets end, the kinks of the partners' shape functions slide away."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.geometry.curve import Curve
from archord.geometry.meshes.refine import Circle
from archord.geometry.shapes.joint_mesh import Sketch, mesh_joint
from archord.materials.elasticity import Elastic
from archord.measures.edge import surface_profiles
from archord.solver.contact import quadrature
from archord.solver.contact.quadrature import segment_rule
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Interaction, Problem

E = 210e3
NU = 0.3
FACET = 0.2
STEEL = Elastic(E, NU)


def line(n: int, *, backward: bool = False) -> Curve:
    """A straight curve from 0 to 1 of ``n`` quadratic facets."""
    x = np.linspace(0.0, 1.0, 2 * n + 1)
    X = np.column_stack([x[::-1] if backward else x, np.zeros_like(x)])
    return Curve(X, 2)


def forces_of_uniform_pressure(own: Curve, opposite: Curve, slide: float) -> np.ndarray:
    """Nodal forces on ``opposite`` of the pressure 1 on ``own``, which has slid along x."""
    xi, w = segment_rule(own, opposite)
    nodes = own.X[own.connectivity]
    shape, slope = own.shapes(xi)
    x = np.einsum("fqa,fai->fqi", shape, nodes).reshape(-1, 2)
    x[:, 0] += slide
    length = np.linalg.norm(np.einsum("fqa,fai->fqi", slope, nodes), axis=-1)
    outward = np.tile([0.0, -1.0], (len(x), 1))
    partners = opposite.closest_point(x, outward, np.zeros_like(opposite.X))
    force = partners.shape * (partners.found * (w * length).ravel())[:, None]
    return np.bincount(partners.nodes.ravel(), force.ravel(), len(opposite.X))


@pytest.mark.parametrize("seed", range(8))
def test_points_do_not_depend_on_round_off_where_nodes_coincide(seed):
    """Of a node that lies where two facets meet round-off decides on which of them."""
    own = line(8)
    opposite = line(8, backward=True)
    expected, _ = segment_rule(own, opposite)
    moved = opposite.X + 1e-14 * np.random.default_rng(seed).normal(size=opposite.X.shape)
    xi, _ = segment_rule(own, Curve(moved, 2))
    np.testing.assert_allclose(xi, expected, atol=1e-9)


@pytest.mark.parametrize("end", [4 / 11, 7 / 11])
@pytest.mark.parametrize("round_off", [-1e-14, 0.0, 1e-14])
def test_points_do_not_depend_on_round_off_where_parts_are_equally_long(end, round_off):
    """Segments of 4 and 7 elevenths of a facet, cut into eleven parts: the twelfth is the longer
    segment's, from whichever end the facet is passed."""
    own = Curve(np.column_stack([[0.0, 0.5, 1.0], np.zeros(3)]), 2)
    opposite = Curve(np.column_stack([np.linspace(1.0, end + round_off, 3), np.zeros(3)]), 2)
    xi, _ = segment_rule(own, opposite)
    in_shorter = xi < end if end < 0.5 else xi > end
    assert in_shorter.sum() == 4 * (own.degree + 1)


def test_a_mirrored_curve_has_as_many_points():
    """Five vertices lie on the last three of six facets, the first one where the third facet
    ends."""

    def points(start: float, end: float, *, mirrored: bool) -> int:
        x = np.linspace(start, end, 9)
        opposite = Curve(np.column_stack([1 - x[::-1] if mirrored else x, np.zeros(9)]), 2)
        return segment_rule(line(6), opposite)[0].size

    assert points(1.0, 0.5, mirrored=False) == points(1.0, 0.5, mirrored=True)


@pytest.mark.parametrize("n_own", [10, 12, 30])
def test_nodes_get_their_share_of_a_uniform_pressure(n_own):
    """To round-off without slip, and within a hundredth wherever the facets have slid to."""
    own = line(n_own)
    opposite = line(10, backward=True)
    facet = 0.1
    exact = np.where(np.arange(21) % 2, 2 / 3, 1 / 3) * facet
    at_rest = forces_of_uniform_pressure(own, opposite, 0.0)
    np.testing.assert_allclose(at_rest[1:-1], exact[1:-1], rtol=1e-12)
    x = opposite.X[:, 0]
    covered = (x > 0.41) & (x < 0.89)
    for facets in np.linspace(0.05, 3.0, 40):
        forces = forces_of_uniform_pressure(own, opposite, facets * facet)
        np.testing.assert_allclose(forces[covered], exact[covered], rtol=1e-2)


def shaft_mesh():
    """A hollow shaft in a hub, whose facets are shorter."""
    sketch = Sketch(["shaft", "hub"], ["core", "journal", "bore", "rim"])
    for body, inner, outer, radii in (
        ("shaft", "core", "journal", (0.5, 1.0)),
        ("hub", "bore", "rim", (1.0, 1.8)),
    ):
        corners = [[(r, 0.0), (0.0, r), (-r, 0.0), (0.0, -r), (r, 0.0)] for r in radii]
        for k in range(4):
            ends = [near[k : k + 2] for near in corners]
            paths = {
                name: sketch.path(body, *at, on=Circle(name, (0.0, 0.0), radius))
                for name, at, radius in zip((inner, outer), ends, radii, strict=True)
            }
            for side in (0, 1):
                paths[f"side {side}"] = sketch.path(body, ends[0][side], ends[1][side])
            sketch.face(body, **paths)
    growth = "(1 + Abs(Sqrt(x*x + y*y) - 1))"
    sketch.sizes = {"shaft": f"{FACET} * {growth}", "hub": f"{0.83 * FACET} * {growth}"}
    return mesh_joint(MPI.COMM_SELF, sketch, radius=1.0)


def facet_means(slide: float) -> list[np.ndarray]:
    """Mean pressures of the facets of a shaft pressed into a hub, and turned by so many facets."""
    turn = slide * FACET
    turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    supports = [Dirichlet(f"rim {axis}", "rim", axis) for axis in range(2)]
    supports += [
        Dirichlet(f"core {axis}", "core", axis, lambda x, axis=axis: x @ (turned - np.eye(2))[axis])
        for axis in range(2)
    ]
    names = ("journal", "bore")
    fit = Interaction("fit", names, interference=2e-3, slide=turn)
    bodies = [Body("shaft", STEEL), Body("hub", STEEL)]
    system = System(Problem(shaft_mesh(), bodies, [fit], supports, strain="large"))
    system.solve([0.5, 1.0], StepRules(minimum=1.0))
    return [profile.facet_force / profile.width for profile in surface_profiles(system).values()]


def test_means_of_facets_do_not_scatter_where_surfaces_slid(monkeypatch):
    """By at most 0.1 % of the pressure, against a rule of many points."""
    found = facet_means(1.5)
    monkeypatch.setattr(quadrature, "_PARTS", 40)
    exact = facet_means(1.5)
    for means, fine in zip(found, exact, strict=True):
        assert np.abs(means - fine).max() < 1e-3 * fine.mean()


def _slot(mesh, in_space):
    """A slab that is pressed into a slot, and pushed half out of it."""
    names = ("low", "mid", "high")
    supports = [archord.Support("low bottom"), archord.Support("high top")]
    if in_space:
        sides = [f"{name} {side}" for name in names for side in ("back", "front")]
        supports += [archord.Support(side, fixed="z") for side in sides]
    fits = {"a": ("mid bottom", "low top"), "b": ("high bottom", "mid top")}
    return archord.Problem(
        mesh,
        [archord.Body(name, archord.Elastic(1000.0, 0.3)) for name in names],
        [archord.Interaction(name, pair, interference=0.02) for name, pair in fits.items()],
        supports,
        [archord.Load("push", on="mid left", direction="x", displacement=1.0)],
        steps=5,
    )


def test_a_press_fit_in_space_leaves_its_slot_as_in_the_plane(tmp_path):
    """Forces and energies of a slice, over its thickness, as surfaces slide over each other's
    edges; what is drawn together is released in proportion to the length."""
    low = {name: 0.5 * k for k, name in enumerate(("low", "mid", "high"))}
    thick = 0.25
    flat = archord.rectangles({name: (0, y, 2, 0.5) for name, y in low.items()}, thick)
    slice_ = {name: (0, y, 0, 2, 0.5, thick) for name, y in low.items()}
    solids = archord.boxes(slice_, 0.25, "hexahedra")
    plane, space = (
        archord.solve(_slot(mesh, is_solid), tmp_path / str(is_solid)).columns
        for mesh, is_solid in ((flat, False), (solids, True))
    )
    for name in ("elastic_energy", "a force y", "work"):
        found = np.array(space[name]) / thick
        largest = np.abs(plane[name]).max()
        np.testing.assert_allclose(found, plane[name], atol=0.01 * largest, rtol=0)
    assert space["a contact area"][-1] == pytest.approx(thick * 1.0, rel=0.02)
    released = space["elastic_energy"][-1] / space["elastic_energy"][0]
    assert released == pytest.approx(0.5, rel=0.05)

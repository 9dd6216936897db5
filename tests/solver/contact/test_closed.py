"""Surfaces that are no open curve: a whole pin in a whole hole, and holes in several pieces."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Interaction, Problem
from tests.solver.parts import DR, ELASTIC, R, solve

RADII = {"bore": 0.4 * R, "pin": R, "hole": R + DR, "outer": 2 * R}
PUSH = 2 * DR


def rings(
    comm: MPI.Comm, quarters: int, gap: bool = False, edges: int = 9, **options
) -> TaggedMesh:
    """A "bush" with a bore in a "ring", so many ``quarters`` of them from the bottom on; with a
    ``gap`` in the set "hole" at an angle of 120 to 150 degrees. Twice as many ``edges`` are on a
    quarter of the hole, 16 on one of the pin. Sets are the circles, and the "cuts" where they
    end."""

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        centre = geo.addPoint(0, 0, 0)
        whole = quarters == 4
        arcs = {}
        ends = []
        for name, radius in RADII.items():
            angles = np.radians(90.0 * np.arange(quarters + 1))
            if name == "hole" and gap:
                angles = np.sort(np.append(angles, np.radians([120, 150])))
            points = [
                geo.addPoint(radius * np.sin(a), -radius * np.cos(a), 0)
                for a in angles[: -1 if whole else None]
            ]
            points += points[:1] if whole else []
            arcs[name] = [geo.addCircleArc(a, centre, b) for a, b in pairwise(points)]
            for arc, turned in zip(arcs[name], np.diff(angles), strict=True):
                geo.mesh.setTransfiniteCurve(
                    arc, 1 + 2 * round((edges if name == "hole" else 8) * turned / np.pi * 2)
                )
            ends.append((points[0], points[-1]))
        cuts = []
        for body, (inner, outer) in {"bush": (0, 1), "ring": (2, 3)}.items():
            inside, outside = (arcs[list(RADII)[k]] for k in (inner, outer))
            if whole:
                loops = [geo.addCurveLoop(outside), geo.addCurveLoop(inside)]
            else:
                first, last = (geo.addLine(ends[inner][k], ends[outer][k]) for k in (0, 1))
                cuts += [first, last]
                loops = [
                    geo.addCurveLoop([first, *outside, -last, *(-arc for arc in reversed(inside))])
                ]
            face = geo.addPlaneSurface(loops)
            geo.synchronize()
            gmsh.model.addPhysicalGroup(2, [face], name=body)
        for cut in cuts:
            gmsh.model.mesh.setTransfiniteCurve(cut, 9)
        if gap:
            del arcs["hole"][2]
        for tag, lines in enumerate([*arcs.values(), *([cuts] if cuts else [])], 1):
            gmsh.model.addPhysicalGroup(1, lines, tag, [*arcs, "cuts"][tag - 1])
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)

    return gmsh_to_mesh(
        comm, build, [Circle(name, (0.0, 0.0), r) for name, r in RADII.items()], **options
    )


def press(
    mesh: TaggedMesh, angle: float = 0.0, symmetry: float = 1.0, degree: int = 2, **contact
) -> tuple[System, float]:
    """The bush's bore moved by ``PUSH``, down and turned by ``angle``; the system and the force
    along that way."""
    way = np.array([np.sin(angle), -np.cos(angle)])
    supports = [Dirichlet("outer", "outer", axis) for axis in range(2)]
    supports += [Dirichlet("bore", "bore", axis, way[axis]) for axis in range(2)]
    supports += [Dirichlet("cuts", "cuts", 0)] if symmetry > 1 else []
    bodies = [Body("bush", ELASTIC), Body("ring", ELASTIC)]
    contact = Interaction("contact", ("pin", "hole"), **contact)
    system = solve(
        Problem(mesh, bodies, [contact], supports, symmetry=symmetry, degree=degree), [PUSH]
    )
    force = system.contact_force()
    balance = max(
        np.abs(force + system.reaction("outer")).max(),
        np.abs(force - system.reaction("bore")).max(),
    )
    assert symmetry > 1 or balance < 1e-9 * np.abs(force).max()
    return system, float(force @ way)


def turned(mesh: TaggedMesh, angle: float) -> TaggedMesh:
    c = np.cos(angle)
    s = np.sin(angle)
    mesh.mesh.geometry.x[:, :2] = mesh.mesh.geometry.x[:, :2] @ [[c, s], [-s, c]]
    return mesh


@pytest.mark.parametrize("quads", [False, True])
@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_a_whole_pin_in_a_whole_hole_is_twice_its_half(quads, kinematics):
    """P agrees within the discretisation; the whole one's pressure is symmetric, and no force acts
    aside."""
    system, whole = press(rings(MPI.COMM_SELF, 4, quads=quads), kinematics=kinematics)
    _, half = press(rings(MPI.COMM_SELF, 2, quads=quads), symmetry=2.0, kinematics=kinematics)
    assert whole == pytest.approx(half, rel=1e-3)
    hole = system.sides["hole"]
    assert hole.curve.n_pieces == 1
    assert hole.curve.before.min() == hole.curve.after.min() == 0
    assert abs(system.contact_force()[0]) < 2e-4 * whole
    pair = system.contact.pair_of(hole)
    force = (hole.weight * pair.pressure).sum(axis=1)
    x = hole.point.mean(axis=1)
    left, right = (
        force[np.sign(x[:, 0]) == s][np.argsort(x[np.sign(x[:, 0]) == s, 1])] for s in (-1, 1)
    )
    assert np.abs(left - right).max() < 0.02 * force.max()


def test_cells_and_orders_agree():
    """Triangles and quads, geometry and displacements of second and third order, also one of each:
    P and its peak."""

    def half(quads: bool, order: int, degree: int) -> tuple[System, float]:
        return press(rings(MPI.COMM_SELF, 2, quads=quads, order=order), symmetry=2.0, degree=degree)

    fine, expected = half(True, 3, 3)
    peak = fine.contact.pair_of(fine.sides["hole"]).pressure.max()
    for quads, order, degree in ((False, 2, 2), (True, 2, 3), (False, 3, 2), (False, 3, 3)):
        system, force = half(quads, order, degree)
        assert force == pytest.approx(expected, rel=2e-4)
        assert system.contact.pair_of(system.sides["hole"]).pressure.max() == pytest.approx(
            peak, rel=0.01
        )


@pytest.mark.parametrize("edges", [8, 9])
def test_forces_do_not_depend_on_where_the_seam_lies(edges):
    """The mesh turned with the load, so that the seam lies in, beside and opposite to the contact;
    nor on rounding, which might choose between two facets where vertices face each other."""
    forces = []
    seams = []
    for angle in np.radians([0, 145, 328]):
        system, force = press(turned(rings(MPI.COMM_SELF, 4, edges=edges), angle), angle)
        forces.append(force)
        x = system.sides["hole"].curve.X[0]
        seams.append(np.degrees((np.arctan2(x[0], -x[1]) - angle) % (2 * np.pi)))
    assert np.ptp(seams) > 90
    assert np.ptp(forces) < 1e-9 * forces[0]


@pytest.mark.mpi
@pytest.mark.parametrize("quads", [False, True])
def test_forces_do_not_depend_on_the_ranks(quads, comm):
    """Nor does the order of the facets."""
    system, force = press(rings(comm, 4, quads=quads), 0.3)
    alone, expected = press(rings(MPI.COMM_SELF, 4, quads=quads), 0.3)
    assert force == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(system.sides["pin"].curve.X, alone.sides["pin"].curve.X, atol=1e-12)


def test_a_hole_in_pieces_carries_what_the_whole_one_does():
    """A gap where there is no contact changes nothing; one within it takes its part of the force
    away."""
    _, whole = press(rings(MPI.COMM_SELF, 4, gap=False))
    system, beside = press(rings(MPI.COMM_SELF, 4, gap=True))
    hole = system.sides["hole"].curve
    assert (hole.before < 0).sum() == (hole.after < 0).sum() == 1
    assert beside == pytest.approx(whole, rel=1e-3)
    _, within = press(rings(MPI.COMM_SELF, 4, gap=True), np.radians(135))
    assert 0.3 * whole < within < 0.9 * whole

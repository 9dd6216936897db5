"""Cells in space that bend, keep their volume, or yield all together: beam theory, a tube that is
hardly compressible, and the limit load of a bar with deep notches (Hill 1952)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dolfinx.mesh import compute_midpoints, meshtags

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from archord.solver.problem import Body, Load, Problem, Support
from tests.solver.space import KINDS, E, box

YIELD_STRESS = 300.0
INNER = 1.0  # radii of the tube
OUTER = 2.0
ALMOST = 0.4999  # Poisson's ratio of what hardly changes its volume
FAR = 9.0  # from a notched bar's middle to its sides, over half the ligament


def solved(mesh, material, supports, loads, at=(1.0,)) -> System:
    system = System(Problem(mesh, [Body("box", material)], supports=supports, loads=loads))
    system.solve(list(at), StepRules())
    return system


@KINDS
@pytest.mark.parametrize(("n", "most"), [(1, 0.012), (2, 0.006)])
def test_a_cantilever_bends_as_beam_theory_says(kind, n, most, comm):
    """With one and two cells across: bending and shear together, nu = 0, so that the root may be
    held in all directions."""
    length = 20.0
    tip = 0.1
    mesh = box(comm, (5 * n, n, n), (length, 1.0, 1.0), kind)
    root = [Support("x0", fixed="xyz")]
    system = solved(
        mesh, Elastic(E, 0.0), root, [Load("push", on="x1", direction="y", displacement=tip)]
    )
    bending = length**3 / (3 * E / 12)
    shear = length / (5 / 6 * E / 2)
    assert system.drive_force("push") == pytest.approx(tip / (bending + shear), rel=most)


def tube(comm, n, kind) -> TaggedMesh:
    """A quarter of a tube, ``n`` cells through its wall; the bore is "x0", the ends "z0" and
    "z1", the planes of symmetry "y0" (y = 0) and "y1" (x = 0)."""
    mesh = box(comm, (n, 2 * n, 1), (1.0, 1.0, 0.5), kind)
    x = mesh.mesh.geometry.x
    radius = INNER + (OUTER - INNER) * x[:, 0]
    angle = np.pi / 2 * x[:, 1]
    x[:, 0] = radius * np.cos(angle)
    x[:, 1] = radius * np.sin(angle)
    return mesh


@KINDS
def test_a_tube_that_hardly_changes_its_volume_widens_as_lame_says(kind, comm):
    """Under inner pressure between held ends; cells are straight, so that the error falls with the
    square of their size."""
    pressure = 1.0
    errors = []
    for n in (2, 4):
        mesh = tube(comm, n, kind)
        held = {"z0": "z", "z1": "z", "y0": "y", "y1": "x"}
        supports = [Support(on, fixed=fixed) for on, fixed in held.items()]
        load = Load("oil", on="x0", pressure=pressure)
        system = solved(mesh, Elastic(E, ALMOST), supports, [load])
        bore = mesh.dofs_in(system.V, "x0")
        u = system.equilibrium.displacement()[bore]
        x = system.V.tabulate_dof_coordinates()[bore]
        radial = (u[:, :2] * x[:, :2]).sum(axis=1) / np.hypot(x[:, 0], x[:, 1])
        a, b = INNER, OUTER
        expected = (
            pressure * a * (1 + ALMOST) / E / (b**2 - a**2) * ((1 - 2 * ALMOST) * a**2 + b**2)
        )
        errors.append(radial.mean() / expected - 1)
    assert abs(errors[1]) < 0.02
    assert abs(errors[1]) < 0.4 * abs(errors[0])


def notched(comm, n, kind) -> TaggedMesh:
    """A quarter of a bar with deep notches, with ``n`` cells in half the ligament, which is the set
    "ligament" of length 1 and the plane y = 0."""
    mesh = box(comm, (2 * n, 2 * n, 1), (1.0, 1.0, 1.0 / n), kind)
    values = mesh.facets.values.copy()
    below = np.isin(values, mesh.facet_sets["y0"])
    middle = compute_midpoints(mesh.mesh, 2, mesh.facets.indices)
    values[below & (middle[:, 0] < 0.5)] = 7
    facets = meshtags(mesh.mesh, 2, mesh.facets.indices, values)
    x = mesh.mesh.geometry.x
    beyond = np.maximum(2 * x[:, 0] - 1, 0.0)
    x[:, 0] = np.minimum(2 * x[:, 0], 1.0) + (FAR - 1) * beyond**2
    x[:, 1] = FAR * x[:, 1] ** 2
    return replace(mesh, facets=facets, facet_sets={**mesh.facet_sets, "ligament": (7,)})


@KINDS
def test_a_notched_bar_carries_its_limit_load(kind, comm):
    """In plane strain a ligament of width 2 carries ``(2 + pi) k`` per area, with the yield stress
    ``k`` in shear; the excess halves with the
    cells: the field of slip lines is singular where they meet."""
    excess = []
    for n in (3, 6):
        mesh = notched(comm, n, kind)
        held = {"ligament": "y", "x0": "x", "z0": "z", "z1": "z"}
        supports = [Support(on, fixed=fixed) for on, fixed in held.items()]
        material = J2Material(E, 0.3, hardening=LinearHardening(YIELD_STRESS))
        load = Load("pull", on="y1", direction="y", displacement=0.3)
        system = solved(mesh, material, supports, [load], at=(0.05, 0.2, 0.6, 1.0))
        limit = (2 + np.pi) * YIELD_STRESS / np.sqrt(3) / n
        excess.append(system.drive_force("pull") / limit - 1)
    assert 0 < excess[1] < 0.07
    assert excess[1] < 0.5 * excess[0]

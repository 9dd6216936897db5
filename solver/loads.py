"""Forces that are spread over sets of cells and facets, and mean motions of facets.

Around an axis they are integrals over the whole ring.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx import fem
from dolfinx.la import InsertMode
from mpi4py import MPI

from archord.geometry.basis import Array, cell_basis
from archord.materials.kinematics import Ints
from archord.solver.conditions import DeadLoad, Mean
from archord.solver.contact.facets import boundary_facets, facet_kind, facet_normals
from archord.solver.problem import Problem

LOAD_DEGREE = 6  # of the quadrature of distributed forces
_OUT_OF_PLANE = 2  # the axis about which a plane turns


@dataclass(frozen=True)
class Region:
    """The ``q`` integration points of ``n`` cells or facets of a set, whose cells this rank owns.

    - ``nodes`` ``(n, a)``: of the cells
    - ``shape`` ``(n, q, a)``, ``gradient`` ``(n, q, a, d)``: the basis of the displacements
    - ``point`` ``(n, q, d)``: coordinates
    - ``normal`` ``(n, q, d)``: outward, of unit length, of facets
    - ``drawn`` ``(n, q)``: area or length in a plane, volume or area in space
    - ``weight`` ``(n, q)``: the same, around an axis of the whole ring
    - ``comm``: the ranks
    """

    nodes: Ints
    shape: Array
    gradient: Array
    point: Array
    normal: Array
    drawn: Array
    weight: Array
    comm: MPI.Comm

    def integral(self, values: Array | float = 1.0) -> Any:
        """The integral of ``values`` ``(n, q, ...)`` over all ranks. Collective."""
        values = np.broadcast_to(values, (*self.weight.shape, *np.shape(values)[2:]))
        return self.comm.allreduce(np.einsum("nq,nq...->...", self.weight, values))


class Loads:
    """Integrals over sets of the mesh of ``problem`` in its displacement space ``V``.
    Collective."""

    def __init__(self, problem: Problem, V: fem.FunctionSpace) -> None:
        self.problem = problem
        self.kinematics = problem.kinematics
        self.V = V

    def region(self, cells: str = "", facets: str = "") -> Region:
        """A set of cells, or of facets that bound a body. Raises ValueError where there are none
        of these."""
        found = self._of_facets(facets) if facets else self._of_cells(cells)
        if not found.integral():
            raise ValueError(
                f"the facet set {facets!r} is not on the boundary of a body: nothing can load it"
            )
        return found

    def cells_of(self, name: str) -> Ints:
        """The cells ``(n,)`` of a set that this rank owns."""
        topology = self.V.mesh.topology
        cells = np.unique(self.problem.mesh.cells_in(name))
        return cells[cells < topology.index_map(topology.dim).size_local]

    def _of_cells(self, name: str) -> Region:
        cells = self.cells_of(name)
        X, w = basix.make_quadrature(self.V.mesh.basix_cell(), LOAD_DEGREE)
        X = np.broadcast_to(X, (len(cells), *X.shape))
        return self._at(cells, X, w, None)

    def _of_facets(self, name: str) -> Region:
        facets = np.unique(self.problem.mesh.facets_in(name))
        found = boundary_facets(self.V, facets)
        found = found.reordered(np.flatnonzero(~found.within))
        xi, w = basix.make_quadrature(facet_kind(self.V.mesh.basix_cell()), LOAD_DEGREE)
        return self._at(found.cells, found.origin[:, None] + xi @ found.axes, w, found.axes)

    def _at(self, cells: Ints, X: Array, w: Array, axes: Array | None) -> Region:
        """Points ``X`` ``(n, q, d)`` of ``cells`` with weights ``w`` ``(q,)``, of facets along
        their ``axes`` ``(n, d - 1, d)``."""
        mesh = self.V.mesh
        basis = cell_basis(mesh, self.V.element.basix_element.degree, cells, X)
        normal: Array = np.zeros_like(basis.point)
        if axes is None:
            drawn = basis.measure * w
        else:
            normal = facet_normals(basis.jacobian, axes)
            size = np.linalg.norm(normal, axis=-1)
            normal /= size[..., None]
            drawn = size * w
        weight = drawn * self.kinematics.measure(basis.point)
        nodes = self.V.dofmap.list[cells]
        return Region(
            nodes, basis.shape, basis.gradient, basis.point, normal, drawn, weight, mesh.comm
        )

    def _spread(self, on: Region, density: Array) -> Array:
        """The forces ``(n_owned, d)`` of a ``density`` ``(n, q, d)`` per area or volume."""
        of_cells = np.einsum("nq,nqa,nqi->nai", on.weight, on.shape, density)
        force = fem.Function(self.V).x
        np.add.at(force.array.reshape(-1, density.shape[-1]), on.nodes, of_cells)
        force.scatter_reverse(InsertMode.add)
        n_owned = self.V.dofmap.index_map.size_local
        return force.array.reshape(-1, density.shape[-1])[:n_owned].copy()

    def forces(self, load: DeadLoad) -> Array:
        """Forces ``(n_owned, d)`` on the modelled part per unit of the drive. Raises ValueError for
        a density whose integral is zero or not finite."""
        on = self.region(load.cells, load.facets)
        if load.pressure:
            return self._spread(on, -load.pressure * on.normal)
        density: Array = np.ones(on.weight.shape)
        if load.density is not None:
            given = load.density(np.moveaxis(on.point, -1, 0))
            density = np.broadcast_to(given, on.weight.shape)
        total = on.integral(density)
        if not 0 < abs(total) < np.inf:
            raise ValueError(f"the density of a load has the integral {total:g}: nothing is loaded")
        forces = self._spread(on, density[..., None] * np.array(load.force))
        return forces / (self.problem.whole * total)

    def dead_error(self, facets: str, u: Array) -> float:
        """How far the area vectors of a set of ``facets`` change at the nodal displacements ``u``
        ``(n_nodes, d)``, over their size: what a pressure on undeformed areas misses."""
        on = self.region(facets=facets)
        F = np.eye(u.shape[1]) + np.einsum("nqaj,nai->nqij", on.gradient, u[on.nodes])
        pulled = np.linalg.solve(np.swapaxes(F, -1, -2), on.normal[..., None])[..., 0]
        place = on.point + np.einsum("nqa,nai->nqi", on.shape, u[on.nodes])
        ring = self.kinematics.measure(place) / self.kinematics.measure(on.point)
        growth = np.linalg.det(F) * ring
        change = growth[..., None] * pulled - on.normal  # Nanson
        return float(on.integral(np.linalg.norm(change, axis=-1)) / on.integral())

    def mean_motion(self, mean: Mean) -> Array:
        """Derivative ``(n_owned, d)`` of the mean motion by the displacements of the nodes. Raises
        ValueError for a rotation of a ring."""
        d = self.kinematics.dimension
        turns = self.kinematics.turns
        on = self.region(facets=mean.facets)
        length = on.integral()
        axes = np.eye(d + len(turns))
        if not turns:
            if mean.axis >= d:
                raise ValueError(f"the mean {mean.name!r} is a rotation, which no ring has")
            return self._spread(on, np.broadcast_to(axes[mean.axis], on.point.shape)) / length
        centre = on.integral(on.point) / length
        for axis, at in mean.mirrors:
            centre[axis] = at
        arm = on.point - centre
        lever = np.zeros(d) if mean.point is None else np.array(mean.point) - centre
        inertia = self._inertia(arm, on)
        along = axes[mean.axis, :d]
        about = np.arange(len(turns)) if len(turns) > 1 else np.array([_OUT_OF_PLANE])
        for axis, _ in mean.mirrors:
            along[axis] = 0.0
            inertia[np.ix_(about == axis, about != axis)] = 0.0
            inertia[np.ix_(about != axis, about == axis)] = 0.0
        by_rotations = self._by_rotations(mean.axis, lever, inertia)
        for axis, _ in mean.mirrors:
            by_rotations[about != axis] = 0.0
        density = np.tile(along / length, (*arm.shape[:2], 1))
        for rotation, (i, j) in zip(by_rotations, turns, strict=True):
            density[..., j] += rotation * arm[..., i]
            density[..., i] -= rotation * arm[..., j]
        return self._spread(on, density)

    def _inertia(self, arm: Array, on: Region) -> Array:
        """Moments of inertia ``(t, t)`` of facets for the turns, by the arms to their centroid."""
        second = on.integral(arm[..., :, None] * arm[..., None, :])
        polar = np.trace(second)
        if len(self.kinematics.turns) == 1:
            return np.array([[polar]])
        return polar * np.eye(len(second)) - second

    def _by_rotations(self, axis: int, lever: Array, inertia: Array) -> Array:
        """What a motion along or about an ``axis`` has of the moments ``(t,)``: of the mean
        rotations about the centroid, which move the end of the ``lever``."""
        d = len(lever)
        rates = np.zeros(len(inertia))
        for turn, (i, j) in enumerate(self.kinematics.turns):
            motion = np.zeros(d)
            motion[i] = -lever[j]
            motion[j] = lever[i]
            rates[turn] = float(axis == d + turn) if axis >= d else motion[axis]
        if len(inertia) == 1:
            return rates / inertia[0]
        return np.linalg.solve(inertia, rates)

"""Forces that are spread over sets of cells and facets, and mean motions of facets.

Around an axis they are integrals over the whole ring.
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.la import InsertMode
from dolfinx.mesh import meshtags

from archord.geometry.basis import Array
from archord.solver.conditions import DeadLoad, Mean
from archord.solver.problem import Problem

LOAD_DEGREE = 6  # of the quadrature of distributed forces
_OUT_OF_PLANE = 2  # the axis about which a plane turns


class Loads:
    """Integrals over sets of the mesh of ``problem`` in its displacement space ``V``.
    Collective."""

    def __init__(self, problem: Problem, V: fem.FunctionSpace) -> None:
        self.problem = problem
        self.kinematics = problem.kinematics
        self.V = V

    def measure(self, cells: str = "", facets: str = "") -> Any:
        """The measure of a set of cells, or of facets, as drawn."""
        mesh = self.V.mesh
        sets = self.problem.mesh
        named = sets.cells_in(cells) if cells else sets.facets_in(facets)
        entities = np.unique(named).astype(np.int32)
        dimension = mesh.topology.dim if cells else mesh.topology.dim - 1
        tags = meshtags(mesh, dimension, entities, 1)
        rule = {"quadrature_degree": LOAD_DEGREE}
        kind = "dx" if cells else "ds"
        measure = ufl.Measure(kind, mesh, subdomain_data=tags, metadata=rule)(1)
        if not self._size(measure):
            raise ValueError(
                f"the facet set {facets!r} is not on the boundary of a body: nothing can load it"
            )
        return measure

    def swept(self, integrand: Any) -> Any:
        """The ``integrand``, in UFL, times what areas and lengths stand for: around an axis for a
        ring."""
        return integrand * self.kinematics.measure(ufl.SpatialCoordinate(self.V.mesh))

    def _size(self, measure: Any) -> float:
        """The area, or the length, of what is measured."""
        one = fem.Constant(self.V.mesh, 1.0)
        return self.integral(self.swept(one) * measure)

    def integral(self, form: Any) -> float:
        """The ``form`` without arguments, over all ranks."""
        return self._sum(fem.form(form))

    def _sum(self, compiled: fem.Form) -> float:
        """The same of a ``compiled`` form, with what its constants are now."""
        return self.V.mesh.comm.allreduce(fem.assemble_scalar(compiled))

    def _first_moments(self, x: Any, ds: Any) -> Array:
        """Integrals ``(d,)`` of the components of ``x``."""
        d = self.kinematics.dimension
        along = fem.Constant(self.V.mesh, np.zeros(d))
        moment = fem.form(ufl.inner(along, x) * ds)
        moments = np.zeros(d)
        for i in range(d):
            along.value = np.eye(d)[i]
            moments[i] = self._sum(moment)
        return moments

    def _vector(self, form: Any) -> Array:
        """The linear ``form`` at the nodes ``(n_owned, d)``."""
        vector = fem.assemble_vector(fem.form(form))
        vector.scatter_reverse(InsertMode.add)
        d = self.kinematics.dimension
        n_owned = self.V.dofmap.index_map.size_local
        return vector.array[: d * n_owned].reshape(-1, d)

    def forces(self, load: DeadLoad) -> Array:
        """Forces ``(n_owned, d)`` on the modelled part per unit of the drive."""
        mesh = self.V.mesh
        v = ufl.TestFunction(self.V)
        measure = self.measure(load.cells, load.facets)
        if load.pressure:
            along_normal = ufl.inner(ufl.FacetNormal(mesh), v)
            pressure = fem.Constant(mesh, load.pressure)
            return self._vector(-pressure * self.swept(along_normal) * measure)
        force = fem.Constant(mesh, np.array(load.force))
        density = fem.Constant(mesh, 1.0)
        if load.density is not None:
            density = load.density(ufl.SpatialCoordinate(mesh))
        total = self.integral(self.swept(density) * measure)
        forces = self._vector(self.swept(density) * ufl.inner(force, v) * measure)
        return forces / (self.problem.whole * total)

    def mean_motion(self, mean: Mean) -> Array:
        """Derivative ``(n_owned, d)`` of the mean motion by the displacements of the nodes. Raises
        ValueError for a rotation of a ring."""
        mesh = self.V.mesh
        d = self.kinematics.dimension
        turns = self.kinematics.turns
        v = ufl.TestFunction(self.V)
        ds = self.measure(facets=mean.facets)
        length = self._size(ds)
        if not turns:
            if mean.axis >= d:
                raise ValueError(f"the mean {mean.name!r} is a rotation, which no ring has")
            return self._vector(self.swept(v[mean.axis]) * ds) / length
        x = ufl.SpatialCoordinate(mesh)
        centre = self._first_moments(x, ds) / length
        for axis, at in mean.mirrors:
            centre[axis] = at
        arm = x - fem.Constant(mesh, centre)
        lever = np.zeros(d) if mean.point is None else np.array(mean.point) - centre
        inertia = self._inertia(arm, ds)
        along = np.eye(d + len(turns))[mean.axis, :d]
        about = np.arange(len(turns)) if len(turns) > 1 else np.array([_OUT_OF_PLANE])
        for axis, _ in mean.mirrors:
            along[axis] = 0.0
            inertia[np.ix_(about == axis, about != axis)] = 0.0
            inertia[np.ix_(about != axis, about == axis)] = 0.0
        by_rotations = self._by_rotations(mean.axis, lever, inertia)
        for axis, _ in mean.mirrors:
            by_rotations[about != axis] = 0.0
        density = ufl.inner(fem.Constant(mesh, along / length), v)
        for rotation, (i, j) in zip(by_rotations, turns, strict=True):
            moment = arm[i] * v[j] - arm[j] * v[i]
            density += fem.Constant(mesh, rotation) * moment
        return self._vector(density * ds)

    def _inertia(self, arm: Any, ds: Any) -> Array:
        """Moments of inertia ``(t, t)`` of facets for the turns, by the arms to their centroid."""
        turns = self.kinematics.turns
        if len(turns) == 1:
            return np.array([[self.integral(ufl.inner(arm, arm) * ds)]])
        d = self.kinematics.dimension
        one = fem.Constant(self.V.mesh, np.zeros(d))
        other = fem.Constant(self.V.mesh, np.zeros(d))
        moment = fem.form(ufl.inner(one, arm) * ufl.inner(other, arm) * ds)
        second = np.zeros((d, d))
        axes = np.eye(d)
        for i, j in combinations_with_replacement(range(d), 2):
            one.value = axes[i]
            other.value = axes[j]
            second[i, j] = second[j, i] = self._sum(moment)
        polar = float(np.trace(second))
        return polar * axes - second

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

"""Forces that are spread over sets of cells and facets, and mean motions of facets.

Around an axis they are integrals over the whole ring.
"""

from __future__ import annotations

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
        entities = np.unique(sets.cells_in(cells) if cells else sets.facets_in(facets))
        dimension = mesh.topology.dim if cells else mesh.topology.dim - 1
        tags = meshtags(mesh, dimension, entities.astype(np.int32), 1)
        rule = {"quadrature_degree": LOAD_DEGREE}
        measure = ufl.Measure("dx" if cells else "ds", mesh, subdomain_data=tags, metadata=rule)(1)
        if not self.integral(self.swept(fem.Constant(mesh, 1.0)) * measure):
            raise ValueError(
                f"the facet set {facets!r} is not on the boundary of a body: nothing can load it"
            )
        return measure

    def swept(self, integrand: Any) -> Any:
        """The ``integrand``, in UFL, times what areas and lengths stand for: around an axis for a
        ring."""
        return integrand * self.kinematics.measure(ufl.SpatialCoordinate(self.V.mesh))

    def integral(self, form: Any) -> float:
        """The ``form`` without arguments, over all ranks."""
        return self.V.mesh.comm.allreduce(fem.assemble_scalar(fem.form(form)))

    def _vector(self, form: Any) -> Array:
        """The linear ``form`` at the nodes ``(n_owned, d)``."""
        vector = fem.assemble_vector(fem.form(form))
        vector.scatter_reverse(InsertMode.add)
        d = self.kinematics.dimension
        return vector.array[: d * self.V.dofmap.index_map.size_local].reshape(-1, d)

    def forces(self, load: DeadLoad) -> Array:
        """Forces ``(n_owned, d)`` on the modelled part per unit of the drive."""
        mesh = self.V.mesh
        v = ufl.TestFunction(self.V)
        measure = self.measure(load.cells, load.facets)
        if load.pressure:
            along_normal = ufl.inner(ufl.FacetNormal(mesh), v)
            return self._vector(
                -fem.Constant(mesh, load.pressure) * self.swept(along_normal) * measure
            )
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
        v = ufl.TestFunction(self.V)
        ds = self.measure(facets=mean.facets)
        length = self.integral(self.swept(fem.Constant(mesh, 1.0)) * ds)
        if not self.kinematics.is_plane:
            if mean.axis == self.kinematics.dimension:
                raise ValueError(f"the mean {mean.name!r} is a rotation, which no ring has")
            return self._vector(self.swept(v[mean.axis]) * ds) / length
        x = ufl.SpatialCoordinate(mesh)
        centre = np.array([self.integral(x[i] * ds) for i in (0, 1)]) / length
        arm = x - fem.Constant(mesh, centre)
        lever = np.zeros(2) if mean.point is None else np.array(mean.point) - centre
        by_rotation = np.array([-lever[1], lever[0], 1.0])[mean.axis]
        inertia = self.integral(ufl.inner(arm, arm) * ds)
        shift = fem.Constant(mesh, np.eye(3)[mean.axis, :2] / length)
        turn = fem.Constant(mesh, by_rotation / inertia)
        moment = arm[0] * v[1] - arm[1] * v[0]
        return self._vector((ufl.inner(shift, v) + turn * moment) * ds)

"""What moves and what loads a problem: the shape of each drive in the displacement space, and which
are unknown.

Every drive has one level: the displacement ``q`` of what it moves, where prescribed displacements
are ``rate q``, or the force ``f`` of loads and means, whose nodal forces are ``applied f``.
Conjugate to it is the force on what moves, or the displacement of what is loaded: their product is
work. Where a drive prescribes the conjugate (a force on what moves; the displacement of a mean,
whose force is a Lagrange multiplier then), the level is unknown.

A body that nothing but prescribed means holds would leave the tangent of all displacements
singular. Three of its displacements become levels of drives without force, its anchors, which
change nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.la import InsertMode
from dolfinx.mesh import meshtags
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.solver.contact.contact import Contact
from archord.solver.contact.surface import RigidSurface
from archord.solver.prescribed import Prescribed
from archord.solver.problem import Body, DeadLoad, Mean, Problem, Rigid

LOAD_DEGREE = 6  # of the quadrature of distributed forces
MOVABLE = 1e-8  # stiffness of a rigid motion over the largest one, below which nothing holds it
_SAME_PLACE = 1e-9  # of the distance between two anchors
_DEPENDENT = 1e-12  # of the squared length of a mean's gradient: what is left of it is round-off
_PART = 1e-3  # of a combination of means that displacements cannot follow


class Drives:
    """The drives of ``problem`` in the displacement space ``V``, which move the rigid surfaces of
    ``contact``, too; ``stiffness`` is that of the stiffest body. Collective; raises ValueError.

    ``names`` are the problem's; in arrays of ``d`` drives the anchors follow. ``fixed`` ``(n_local,
    2)`` are the prescribed displacements; ``rate`` ``(d, n_local, 2)`` and ``applied`` ``(d,
    n_owned, 2)``, on the modelled part, are per unit of the levels, which are displacements where
    ``moving`` ``(d,)``. The levels ``unknown`` ``(m,)`` are solved for in units of ``weight``
    ``(m,)``, as are their equations: displacements of bodies, and forces. ``warnings`` are of
    displacements that nodes do not follow.
    """

    def __init__(
        self, problem: Problem, V: fem.FunctionSpace, contact: Contact, stiffness: float
    ) -> None:
        self.problem, self.V, self.comm, index_map = problem, V, V.mesh.comm, V.dofmap.index_map
        self.n_owned, self._n_local = (
            index_map.size_local,
            index_map.size_local + index_map.num_ghosts,
        )
        self._x, self.stiffness = V.tabulate_dof_coordinates()[:, :2], stiffness
        self._drives = problem.all_drives
        self.names = names = [drive.name for drive in self._drives]
        self.applied = np.zeros((len(names), self.n_owned, 2))
        self._prescribed = Prescribed(problem, V, self._drives)
        self.rate = self._prescribed.rate
        self._holder = self._prescribed.holder
        self.warnings = self._prescribed.warnings
        for load in problem.loads:
            self.applied[names.index(load.drive)] += self._nodal_forces(load)
        for mean in problem.means:
            self.applied[names.index(mean.drive)] = self._mean_motion(mean) / problem.symmetry
        controls = {drive.name: drive.control for drive in self._drives}
        bodies = {mean.drive: problem.body_of(mean.facets) for mean in problem.means}
        prescribed = [name for name in bodies if controls[name] == "displacement"]
        moves = problem.moving_drives()
        unknown = [name for name in moves if controls[name] == "force"] + prescribed
        anchors = self._anchors({bodies[name].name: bodies[name] for name in prescribed}.values())
        self.rate = np.concatenate([self.rate, anchors])
        self.applied = np.pad(self.applied, ((0, len(anchors)), (0, 0), (0, 0)))
        self.moving = np.append(np.isin(names, list(moves)), np.ones(len(anchors), dtype=bool))
        self.unknown = np.flatnonzero(
            np.append(np.isin(names, unknown), np.ones(len(anchors), dtype=bool))
        )
        for interface in contact.interfaces:
            disc, given = interface.surfaces[0], interface.interaction.surfaces[0]
            if isinstance(disc, RigidSurface) and isinstance(given, Rigid):
                rates = [given.moved_by().get(name, (0.0, 0.0)) for name in names]
                disc.rate = np.array(rates + [(0.0, 0.0)] * len(anchors))
        self.fixed = self._holder >= 0
        self._require_independent()
        largest = self._largest_rates(contact)
        self.weight = np.array([self._weight(level, largest) for level in self.unknown])
        self.unknown_rate = self.weight[:, None, None] * self.rate[self.unknown]
        self.unknown_load = self.weight[:, None, None] * self.applied[self.unknown]

    def _require_independent(self) -> None:
        """Raise ValueError where displacements that are free cannot give prescribed means all their
        values."""
        means = self.unknown[~self.moving[self.unknown]]
        if not len(means):
            return
        free = np.where(self.fixed[: self.n_owned], 0.0, self.applied[means]).reshape(
            len(means), -1
        )
        rates = self.rate[self.unknown[self.moving[self.unknown]], : self.n_owned]
        of_levels = self.comm.allreduce(np.tensordot(self.applied[means], rates, ((1, 2), (1, 2))))
        products = self.comm.allreduce(free @ free.T) + of_levels @ of_levels.T
        lengths = np.sqrt(self.comm.allreduce((self.applied[means] ** 2).sum(axis=(1, 2))))
        smallest, modes = np.linalg.eigh(products / np.outer(lengths, lengths))
        if smallest[0] < _DEPENDENT:
            names = [repr(self.names[level]) for level in means[np.abs(modes[:, 0]) > _PART]]
            raise ValueError(
                f"the mean motions of {' and '.join(names)} cannot be prescribed: supports, or each other, decide on "
                "them already; take one away, or give it a force"
            )

    def _largest_rates(self, contact: Contact) -> Array:
        """The largest displacement ``(d,)`` of a node or a disc per unit of each level. Raises
        ValueError where a level moves nothing."""
        largest = np.abs(self.rate).max(axis=(1, 2), initial=0.0)
        for disc in contact.rigid:
            largest = np.maximum(largest, np.abs(disc.rate).max(axis=1))
        self.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        for level in np.flatnonzero(self.moving & (largest == 0)):
            raise ValueError(
                f"the drive {self.names[level]!r} moves nothing: supports hold all that it would move"
            )
        return largest

    def _weight(self, level: int, largest: Array) -> float:
        """The unit of a level: one that moves a node by 1 at most, or whose forces are of the size
        of the stiffness."""
        if self.moving[level]:
            return 1 / largest[level]
        return self.stiffness / self.comm.allreduce(np.abs(self.applied[level]).sum())

    def values(self, factor: float) -> Array:
        """What the drives prescribe ``(d,)`` at the load ``factor``."""
        values = [drive.value(factor) for drive in self._drives]
        return np.array(values + [0.0] * (len(self.rate) - len(values)))

    def pushes(self, factor: float) -> bool:
        """Whether a force that is prescribed acts at the load ``factor``."""
        loaded = {load.drive for load in self.problem.loads}
        by_force = [
            drive for drive in self._drives if drive.control == "force" or drive.name in loaded
        ]
        return any(drive.value(factor) for drive in by_force)

    def course(self, factor: float) -> Array:
        """Where the path is at the load ``factor``: the problem's drives over their largest values,
        and the fit."""
        largest = [max(map(abs, drive.path), default=1.0) or 1.0 for drive in self._drives]
        return np.append(self.values(factor)[: len(largest)] / largest, self.problem.fitted(factor))

    def held_by(self, name: str) -> np.ndarray:
        """Which displacements ``(n_owned, 2)`` the supports ``name`` prescribe, the last ones where
        several do."""
        return self._holder[: self.n_owned] == self._prescribed.names.index(name)

    def share_of(self, name: str) -> Array:
        """The part ``(n_owned, 2)`` that the supports ``name`` have of the reaction at each
        node."""
        return self._prescribed.share_of(name)[: self.n_owned]

    def rigid_modes(self, body: Body) -> Array:
        """The rigid motions ``(3, n_local, 2)`` of the ``body``: along x, along y, and turning.
        Collective."""
        nodes = np.unique(self.V.dofmap.list[self.problem.cells_of(body)])
        x = self._x[nodes] / self.comm.allreduce(
            np.abs(self._x[nodes]).max(initial=0.0), op=MPI.MAX
        )
        modes = np.zeros((3, self._n_local, 2))
        modes[0, nodes, 0] = modes[1, nodes, 1] = 1.0
        modes[2, nodes] = np.stack([-x[:, 1], x[:, 0]], axis=1)
        return modes

    def held(self, body: Body) -> bool:
        """Whether supports alone keep the ``body`` from moving rigidly. Collective."""
        rows = self.rigid_modes(body)[:, self._holder >= 0]
        smallest, _, largest = np.linalg.eigvalsh(self.comm.allreduce(rows @ rows.T))
        return bool(smallest > MOVABLE * largest)

    def _anchors(self, bodies: Iterable[Body]) -> Array:
        """The rates ``(a, n_local, 2)`` of three anchors for each of the ``bodies`` that supports
        do not hold."""
        found: list[Array] = []
        for body in bodies:
            if self.held(body):
                continue
            nodes = np.unique(self.V.dofmap.list[self.problem.cells_of(body)])
            nodes = nodes[(self._holder[nodes] < 0).all(axis=1)]
            places = np.concatenate(self.comm.allgather(self._x[nodes[nodes < self.n_owned]]))
            first = places[np.lexsort(places.T)[0]]
            away = places[np.argmax(np.linalg.norm(places - first, axis=1))] - first
            across = int(abs(away[0]) > abs(away[1]))
            for place, axis in ((first, 0), (first, 1), (first + away, across)):
                here = nodes[
                    np.abs(self._x[nodes] - place).max(axis=1) < _SAME_PLACE * np.abs(away).max()
                ]
                found.append(np.zeros((self._n_local, 2)))
                found[-1][here, axis] = 1.0
                self._holder[here, axis] = len(self._prescribed.names)
        return np.array(found).reshape(len(found), self._n_local, 2)

    def measure(self, cells: str = "", facets: str = "") -> Any:
        """The measure of a set of cells, or of facets."""
        mesh, sets = self.V.mesh, self.problem.mesh
        entities = np.unique(sets.cells_in(cells) if cells else sets.facets_in(facets))
        tags = meshtags(mesh, 2 if cells else 1, entities.astype(np.int32), 1)
        rule = {"quadrature_degree": LOAD_DEGREE}
        measure = ufl.Measure("dx" if cells else "ds", mesh, subdomain_data=tags, metadata=rule)(1)
        if not self.integral(fem.Constant(mesh, 1.0) * measure):
            raise ValueError(
                f"the facet set {facets!r} is not on the boundary of a body: nothing can load it"
            )
        return measure

    def integral(self, form: Any) -> float:
        """The ``form`` without arguments, over all ranks."""
        return self.comm.allreduce(fem.assemble_scalar(fem.form(form)))

    def _vector(self, form: Any) -> Array:
        """The linear ``form`` at the nodes ``(n_owned, 2)``."""
        vector = fem.assemble_vector(fem.form(form))
        vector.scatter_reverse(InsertMode.add)
        return vector.array[: 2 * self.n_owned].reshape(-1, 2)

    def _nodal_forces(self, load: DeadLoad) -> Array:
        """Forces ``(n_owned, 2)`` on the modelled part per unit of the drive."""
        mesh, v, measure = (
            self.V.mesh,
            ufl.TestFunction(self.V),
            self.measure(load.cells, load.facets),
        )
        if load.pressure:
            normal = ufl.FacetNormal(mesh)
            return self._vector(-fem.Constant(mesh, load.pressure) * ufl.inner(normal, v) * measure)
        force = fem.Constant(mesh, np.array(load.force))
        density = (
            fem.Constant(mesh, 1.0)
            if load.density is None
            else load.density(ufl.SpatialCoordinate(mesh))
        )
        total = self.integral(density * measure)
        return self._vector(density * ufl.inner(force, v) * measure) / (
            self.problem.symmetry * total
        )

    def _mean_motion(self, mean: Mean) -> Array:
        """Derivative ``(n_owned, 2)`` of the mean motion by the displacements of the nodes."""
        mesh, v, ds = self.V.mesh, ufl.TestFunction(self.V), self.measure(facets=mean.facets)
        x, one = ufl.SpatialCoordinate(mesh), fem.Constant(mesh, 1.0)
        length = self.integral(one * ds)
        centre = np.array([self.integral(x[i] * ds) for i in (0, 1)]) / length
        arm = x - fem.Constant(mesh, centre)
        lever = np.zeros(2) if mean.point is None else np.array(mean.point) - centre
        rotation = np.array([-lever[1], lever[0], 1.0])[mean.axis] / self.integral(
            ufl.inner(arm, arm) * ds
        )
        shift, turn = (fem.Constant(mesh, c) for c in (np.eye(3)[mean.axis, :2] / length, rotation))
        return self._vector((ufl.inner(shift, v) + turn * (arm[0] * v[1] - arm[1] * v[0])) * ds)

"""What moves and what loads a problem: the shape of each drive in the displacement space, and which
are unknown.

Every drive has one level: the displacement ``q`` of what it moves, where prescribed displacements
are ``rate q``, or the force ``f`` of loads and means, whose nodal forces are ``applied f``.
Conjugate to it is the force on what moves, or the displacement of what is loaded: their product is
work. Where a drive prescribes the conjugate (a force on what moves; the displacement of a mean,
whose force is a Lagrange multiplier then), the level is unknown.

A body that nothing but prescribed means holds would leave the tangent of all displacements
singular. As many of its displacements as it has rigid motions become levels of drives without
force, its anchors, which change nothing.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.materials.kinematics import Bools, Ints
from archord.solver.contact.contact import Contact
from archord.solver.contact.surface import RigidSurface
from archord.solver.loads import Loads
from archord.solver.prescribed import Prescribed
from archord.solver.problem import Body, Problem, Rigid
from archord.solver.turns import FiniteTurn

MOVABLE = 1e-8  # stiffness of a rigid motion over the largest one, below which nothing holds it
# distance from the origin over the size of a body, from which on a rotation about the origin looks
# like a displacement
_FAR = 30.0
_SAME_PLACE = 1e-9  # of the distance between two anchors
_DEPENDENT = 1e-12  # of the squared length of a mean's gradient: what is left of it is round-off
_PART = 1e-3  # of a combination of means that displacements cannot follow


class Drives:
    """The drives of ``problem`` in the displacement space ``V``, which move the rigid surfaces of
    ``contact``, too. Collective; raises ValueError.

    Arrays of ``l`` drives: the problem's come first and the anchors follow, in the order
    in which they come to be:

    names : names of the problem's drives
    stiffness : force per displacement of the stiffest body
    warnings : displacements that nodes do not follow
    rate : (l, n_local, d) displacements of the nodes per unit of each level
    applied : (l, n_owned, d) forces on the nodes, on the modelled part, per unit of each level
    moving : (l,) whether the level is a displacement
    unknown : (m,) levels that are solved for
    fixed : (n_local, d) whether a displacement is prescribed
    turns : finite rotations of what drives turn
    weight : (m,) units of the unknown levels and of their equations
    unknown_rate, unknown_load : (m, n, d) ``rate`` and ``applied`` per unit of the unknown levels
    """

    def __init__(self, problem: Problem, V: fem.FunctionSpace, contact: Contact) -> None:
        index_map = V.dofmap.index_map
        self.problem = problem
        self.kinematics = problem.kinematics
        self.V = V
        self.comm = V.mesh.comm
        self.dimension = self.kinematics.dimension
        self.n_owned = index_map.size_local
        self._n_local = index_map.size_local + index_map.num_ghosts
        self._x = V.tabulate_dof_coordinates()[:, : self.dimension]
        self._drives = problem.all_drives
        self.names = [drive.name for drive in self._drives]
        self.stiffness = self._stiffest()
        self.loads = Loads(problem, V)
        self._prescribed = Prescribed(problem, V, self._drives)
        self._holder = self._prescribed.holder
        self.warnings = self._prescribed.warnings

        anchors = self._anchors(self._bodies_of_prescribed_means())
        self.rate = np.concatenate([self._prescribed.rate, anchors])
        self.applied = np.zeros((len(self.rate), self.n_owned, self.dimension))
        self._apply_loads()
        self.moving = self._with_anchors(problem.moving_drives())
        self.unknown = np.flatnonzero(self._with_anchors(self._unknown_names()))
        self._move_discs(contact)
        self.fixed = self._holder >= 0
        self.turns = self._turns()
        self._require_independent()
        largest = self._largest_rates(contact)
        weights = [self._weight(level, largest) for level in self.unknown]
        self.weight = np.array(weights)
        weight = self.weight[:, None, None]
        self.unknown_rate = weight * self.rate[self.unknown]
        self.unknown_load = weight * self.applied[self.unknown]

    def _stiffest(self) -> float:
        moduli = [body.material.elastic_tangent[0, 0] for body in self.problem.bodies]
        largest = float(max(moduli))
        if self.dimension == 3:
            return largest * self._shortest_extent()
        depth = np.max(self.kinematics.measure(self._x), initial=0.0)
        return largest * self.comm.allreduce(float(depth), op=MPI.MAX)

    def _shortest_extent(self) -> float:
        """The shortest extent of the mesh along an axis, such as the thickness of a plate.
        Collective."""
        lowest = self._x.min(axis=0, initial=np.inf)
        highest = self._x.max(axis=0, initial=-np.inf)
        extents = np.append(-lowest, highest)
        self.comm.Allreduce(MPI.IN_PLACE, extents, op=MPI.MAX)
        return float((extents[:3] + extents[3:]).min())

    def _bodies_of_prescribed_means(self) -> list[Body]:
        """The bodies of means whose motion is prescribed, each once."""
        by_displacement = self._controlled("displacement")
        found = {}
        for mean in self.problem.means:
            body = self.problem.body_of(mean.facets)
            if mean.drive in by_displacement:
                found[body.name] = body
        return list(found.values())

    def _controlled(self, control: str) -> set[str]:
        """Names of the drives under this control."""
        return {drive.name for drive in self._drives if drive.control == control}

    def _unknown_names(self) -> set[str]:
        """Names of the drives that prescribe what is conjugate to their level."""
        means = {mean.drive for mean in self.problem.means}
        by_force = self.problem.moving_drives() & self._controlled("force")
        return by_force | (means & self._controlled("displacement"))

    def _with_anchors(self, names: Iterable[str]) -> Bools:
        """Which levels ``(l,)`` are of the drives of these ``names``, or of anchors."""
        chosen = np.ones(len(self.rate), dtype=bool)
        chosen[: len(self.names)] = np.isin(self.names, list(names))
        return chosen

    def _apply_loads(self) -> None:
        for load in self.problem.loads:
            level = self.names.index(load.drive)
            self.applied[level] += self.loads.forces(load)
        for mean in self.problem.means:
            level = self.names.index(mean.drive)
            self.applied[level] = self.loads.mean_motion(mean) / self.problem.whole

    def _move_discs(self, contact: Contact) -> None:
        """Give rigid surfaces their rates ``(l, d)``."""
        for interface in contact.interfaces:
            disc = interface.surfaces[0]
            given = interface.interaction.surfaces[0]
            if isinstance(disc, RigidSurface) and isinstance(given, Rigid):
                rates = given.moved_by()
                disc.rate = np.zeros((len(self.rate), self.dimension))
                for level, name in enumerate(self.names):
                    disc.rate[level] = rates.get(name, 0.0)

    def _turns(self) -> list[FiniteTurn]:
        """The finite rotations."""
        numbers = {name: number for number, name in enumerate(self._prescribed.names)}
        return [
            FiniteTurn(turn, self.names, self._x, self._holder == numbers[turn.name])
            for turn in self.problem.turns
        ]

    def displaced(self, levels: Array) -> Array:
        """The prescribed displacements ``(n_local, d)`` at these ``levels``."""
        u = np.tensordot(levels, self.rate, 1)
        for turn in self.turns:
            turn.displace(u, levels)
        return u

    def _require_independent(self) -> None:
        """Raise ValueError where displacements that are free cannot give prescribed means all their
        values."""
        is_moving = self.moving[self.unknown]
        means = self.unknown[~is_moving]
        if not len(means):
            return
        moving = self.unknown[is_moving]
        motions = self.applied[means]
        is_fixed = self.fixed[: self.n_owned]
        free = np.where(is_fixed, 0.0, motions).reshape(len(means), -1)
        rates = self.rate[moving, : self.n_owned]
        along_rates = np.tensordot(motions, rates, ((1, 2), (1, 2)))
        of_levels = self.comm.allreduce(along_rates)
        of_nodes = self.comm.allreduce(free @ free.T)
        products = of_nodes + of_levels @ of_levels.T
        squares = (motions**2).sum(axis=(1, 2))
        lengths = np.sqrt(self.comm.allreduce(squares))
        values, modes = np.linalg.eigh(products / np.outer(lengths, lengths))
        if values[0] < _DEPENDENT:
            taking_part = np.abs(modes[:, 0]) > _PART
            names = [repr(self.names[level]) for level in means[taking_part]]
            raise ValueError(
                f"the mean motions of {' and '.join(names)} cannot be prescribed: "
                "supports, or each other, decide on them already; "
                "take one away, or give it a force"
            )

    def _largest_rates(self, contact: Contact) -> Array:
        """The largest displacement ``(l,)`` of a node or a disc per unit of each level. Raises
        ValueError where a level moves nothing."""
        largest = np.abs(self.rate).max(axis=(1, 2), initial=0.0)
        for disc in contact.rigid:
            largest = np.maximum(largest, np.abs(disc.rate).max(axis=1))
        self.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        for level in np.flatnonzero(self.moving & (largest == 0)):
            raise ValueError(
                f"the drive {self.names[level]!r} moves nothing: "
                "supports hold all that it would move"
            )
        return largest

    def _weight(self, level: int, largest: Array) -> float:
        """The unit of a level: one that moves a node by 1 at most, or whose forces are of the size
        of the stiffness."""
        if self.moving[level]:
            return 1 / largest[level]
        forces = np.abs(self.applied[level]).sum()
        return self.stiffness / self.comm.allreduce(forces)

    def values(self, factor: float) -> Array:
        """What the drives prescribe ``(l,)`` at the load ``factor``."""
        values = np.zeros(len(self.rate))
        values[: len(self._drives)] = [drive.value(factor) for drive in self._drives]
        return values

    def pushes(self, factor: float) -> bool:
        """Whether a force that is prescribed acts at the load ``factor``."""
        loaded = {load.drive for load in self.problem.loads}
        forces = loaded | self._controlled("force")
        return any(drive.value(factor) for drive in self._drives if drive.name in forces)

    def course(self, factor: float) -> Array:
        """Where the path is at the load ``factor``: the problem's drives over their largest values,
        and the fit."""
        largest = [max(map(abs, drive.path), default=1.0) or 1.0 for drive in self._drives]
        return np.append(self.values(factor)[: len(largest)] / largest, self.problem.fitted(factor))

    def held_by(self, name: str) -> Bools:
        """Which displacements ``(n_owned, d)`` the supports ``name`` prescribe, the last ones where
        several do."""
        return self._holder[: self.n_owned] == self._prescribed.names.index(name)

    def share_of(self, name: str) -> Array:
        """The part ``(n_owned, d)`` that the supports ``name`` have of the reaction at each
        node."""
        return self._prescribed.share_of(name)[: self.n_owned]

    def nodes_of(self, body: Body) -> Ints:
        """Nodes ``(n,)`` of the ``body`` on this rank, ghosts included."""
        return np.unique(self.V.dofmap.list[self.problem.cells_of(body)])

    def rigid_modes(self, body: Body) -> Array:
        """The rigid motions ``(k, n_local, d)`` of the ``body``, of size 1 about: rotations about
        the origin, of a body far from there about its middle. Collective."""
        nodes = self.nodes_of(body)
        x = self._x[nodes]
        lowest = x.min(axis=0, initial=np.inf)
        highest = x.max(axis=0, initial=-np.inf)
        self.comm.Allreduce(MPI.IN_PLACE, lowest, op=MPI.MIN)
        self.comm.Allreduce(MPI.IN_PLACE, highest, op=MPI.MAX)
        extent = (highest - lowest).max()
        size = np.maximum(np.abs(lowest), np.abs(highest)).max()
        if size > _FAR * extent:
            x = x - (lowest + highest) / 2
            size = extent / 2
        modes = np.zeros((self.kinematics.n_rigid, self._n_local, self.dimension))
        modes[:, nodes] = self.kinematics.rigid_motions(x / size)
        return modes

    def held(self, body: Body) -> bool:
        """Whether supports alone keep the ``body`` from moving rigidly. Collective."""
        rows = self.rigid_modes(body)[:, self._holder >= 0]
        sizes = np.linalg.eigvalsh(self.comm.allreduce(rows @ rows.T))
        return bool(sizes[0] > MOVABLE * sizes[-1])

    def _anchors(self, bodies: Iterable[Body]) -> Array:
        """The rates ``(a, n_local, d)`` of the anchors of those ``bodies`` that supports do not
        hold, one for each rigid motion. Collective."""
        found: list[Array] = []
        for body in bodies:
            if self.held(body):
                continue
            nodes = self.nodes_of(body)
            nodes = nodes[(self._holder[nodes] < 0).all(axis=1)]
            places = np.concatenate(self.comm.allgather(self._x[nodes[nodes < self.n_owned]]))
            near = _SAME_PLACE * float(np.ptp(places, axis=0).max())
            for place, axis in self._anchored(places):
                here = nodes[np.abs(self._x[nodes] - place).max(axis=1) < near]
                rate = np.zeros((self._n_local, self.dimension))
                rate[here, axis] = 1.0
                found.append(rate)
                self._holder[here, axis] = len(self._prescribed.names)
        return np.array(found).reshape(len(found), self._n_local, self.dimension)

    def _anchored(self, places: Array) -> list[tuple[Array, int]]:
        """Places and axes of displacements that rigid motions do not leave all zero: of the first
        of ``places`` ``(n, d)``, then of the place that the motions which are left move most."""
        first = places[np.lexsort(places.T)[0]]
        motions = self.kinematics.rigid_motions(places - first)
        along = self.kinematics.rigid_motions(np.zeros((1, self.dimension)))[:, 0]
        anchors = [(first, axis) for axis in np.flatnonzero(along.any(axis=0))]
        motions = motions[~along.any(axis=1)]
        while len(motions):
            sizes = np.linalg.norm(motions, axis=0)
            place = int(np.argmax(np.linalg.norm(sizes, axis=1)))
            axis = int(np.argmax(sizes[place]))
            anchors.append((places[place], axis))
            motions = _at_rest(motions, motions[:, place, axis])
        return anchors


def _at_rest(motions: Array, displacements: Array) -> Array:
    """The combinations ``(k - 1, ...)`` of the ``motions`` ``(k, ...)`` that do not displace what
    they displace by ``displacements`` ``(k,)``."""
    others = np.linalg.svd(displacements[None])[2][1:]
    return np.tensordot(others, motions, 1)

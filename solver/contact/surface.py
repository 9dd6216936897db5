"""One side of a contact: the facets of a body's contact edge on this rank, and the whole edge as a
curve on every rank.

The curve is small (it grows with the square root of the mesh), so every rank holds all of it and
exchanges its displacement; each rank integrates the facets of the cells it owns.
"""

from __future__ import annotations

import basix
import numpy as np
import numpy.typing as npt
from dolfinx import fem

from archord.geometry.basis import (
    CONTACT_POINTS,
    Array,
    bulk_quadrature,
    cell_basis,
)
from archord.geometry.curve import Curve, RigidCircle, in_pieces
from archord.geometry.strain import PointStrain
from archord.kernels.compat import cell_degree
from archord.materials.kinematics import PLANE_STRAIN, Kinematics
from archord.materials.material import Material, Points

_ASKEW = np.array(
    [0.5257, 0.8507]
)  # a direction in which no two nodes of a closed piece should be equally far


class Surface:
    """The boundary ``facets`` ``(n,)`` of the body with ``material`` in the displacement space
    ``V``.

    Arrays of this rank's ``n`` facets with ``q`` points each, in the order in which the curve runs:
    ``weight`` ``(n, q)`` (measure of the curved edge), ``point`` and ``outward`` ``(n, q, 2)``,
    ``gradient`` ``(n, q, a, 2)`` of the own cell's basis, ``shape`` ``(n, q, a)`` and of it
    ``trace_shape`` ``(n, q, k)`` of the nodes on the facet, ``gamma`` and ``gamma_shear`` ``(n,)``.
    ``facet`` ``(n,)`` numbers the facets along the curve, ``trace`` their nodes within the cell.
    The ``curve``, its ``n_facets`` and ``curve_dofs``, the global dofs of its nodes, are those of
    all ranks. Collective; raises ValueError for facets that are no boundary of the body, or branch.
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        facets: np.ndarray,
        material: Material,
        name: str = "",
        kinematics: Kinematics = PLANE_STRAIN,
    ) -> None:
        self.kinematics = kinematics
        self.V, self.comm, self.material, self.name = V, V.mesh.comm, material, name
        self.degree, index_map = V.element.basix_element.degree, V.dofmap.index_map
        cells, local_facets, within = _owned_facets(V.mesh, facets)
        kind = V.mesh.basix_cell()
        corners, edges = basix.geometry(kind), np.array(basix.topology(kind)[1])
        closure = [V.dofmap.dof_layout.entity_closure_dofs(1, k) for k in range(len(edges))]
        # closure order is vertex, vertex, interior; along the facet the interior nodes come between
        # the vertices
        along = [[c[0], *c[2:], c[1]] for c in closure]
        trace = np.array([along[k] for k in local_facets], dtype=np.int64).reshape(
            -1, self.degree + 1
        )
        ends, middle = corners[edges[local_facets]], corners.mean(axis=0)
        # some of basix' edges run clockwise, and a mirrored cell turns all of them
        clockwise = np.linalg.det(ends - middle) < 0
        clockwise ^= cell_basis(V.mesh, self.degree, cells, middle[None]).determinant[:, 0] < 0
        trace[clockwise], ends[clockwise] = trace[clockwise, ::-1], ends[clockwise, ::-1]

        cell_dofs = V.dofmap.list[cells]
        global_dofs = index_map.local_to_global(cell_dofs.ravel()).reshape(cell_dofs.shape)
        on_facet = np.take_along_axis(cell_dofs, trace, axis=1)
        nodes = V.tabulate_dof_coordinates()[:, :2]
        x = nodes[on_facet]
        gathered = self.comm.allgather((np.take_along_axis(global_dofs, trace, axis=1), x, within))
        all_dofs, all_x, within = (np.concatenate(parts) for parts in zip(*gathered, strict=True))
        _refuse(name, all_dofs, all_x, within)
        order = in_pieces(all_dofs[:, 0], all_dofs[:, -1], all_x[:, 0] @ _ASKEW)
        dofs, first, node = np.unique(all_dofs[order], return_index=True, return_inverse=True)
        ranked = np.argsort(first)  # the nodes in the order in which the curve runs
        self.curve_dofs, X = dofs[ranked], all_x[order].reshape(-1, 2)[first[ranked]]
        self.curve = Curve(X, self.degree, np.argsort(ranked)[node].reshape(all_dofs.shape))
        self.n_facets = len(order)
        start = sum(len(part[0]) for part in gathered[: self.comm.rank])
        facet = np.argsort(order)[start : start + len(cells)]
        sort = np.argsort(facet)
        self.facet, self.cells = facet[sort], cells[sort]
        self.cell_dofs, self.cell_global, self._nodes = (
            cell_dofs[sort],
            global_dofs[sort],
            nodes[cell_dofs[sort]],
        )
        self.trace, self._ends = trace[sort].astype(np.int32), ends[sort]
        owned = self.curve_dofs - index_map.local_range[0]
        self._owned = np.flatnonzero((owned >= 0) & (owned < index_map.size_local))
        self._owned_local = owned[self._owned]
        xi, w = basix.make_quadrature(basix.CellType.interval, 2 * CONTACT_POINTS - 1)
        self.place_points(np.tile(xi[:, 0], (self.n_facets, 1)), np.tile(w, (self.n_facets, 1)))
        self.gamma, self.gamma_shear = self._trace_inequality()

    def facet_lengths(self) -> Array:
        """Arc length ``(n_facets,)`` of every facet, over all ranks."""
        return np.diff(self.curve.arc_length(np.array([0.0, 1.0])))[:, 0]

    def place_points(self, xi: Array, w: Array) -> None:
        """Put the contact points at ``xi`` ``(n_facets of the curve, q)`` in (0, 1) with weights
        ``w``; no history."""
        self.curve_xi = xi
        start, along = self._ends[:, 0], self._ends[:, 1] - self._ends[:, 0]
        X = start[:, None] + xi[self.facet][..., None] * along[:, None]
        basis = cell_basis(self.V.mesh, self.degree, self.cells, X)
        tangent = np.einsum("nqij,nj->nqi", basis.jacobian, along)
        length = np.linalg.norm(tangent, axis=-1)
        self.weight = length * w[self.facet]
        self.outward = np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1) / length[..., None]
        self.point, self.gradient, self.shape = (
            basis.point,
            basis.gradient,
            np.ascontiguousarray(basis.shape),
        )
        self.hoop = np.zeros(0)
        if cell_degree(self.V.mesh) > self.degree:
            self.point = self.shape @ self._nodes  # on the curve
        on_facet = np.broadcast_to(
            self.trace[:, None, :], (*self.weight.shape, self.trace.shape[1])
        )
        self.trace_shape = np.take_along_axis(self.shape, on_facet, axis=2)
        self.points = Points(self.material, self.weight.size)
        large = self.material.finite
        self._small_strain = PointStrain(self.kinematics, basis, self.cell_dofs)
        self.strain = PointStrain(self.kinematics, basis, self.cell_dofs, large=large)
        # takes a stress to the force on the edge
        self._cut = self.kinematics.traction(self.outward.reshape(-1, 2), large=large)

    def _trace_inequality(self) -> Array:
        """Smallest ``gamma`` ``(n,)`` with ``|sigma_n(v)|^2 over a facet <= gamma a(v, v) over its
        cell``, any ``v``; and the same of the shear: ``(2, n)``.

        Warburton and Hesthaven (2003) give the constant for polynomials; here the generalised
        eigenvalue problem of each contact cell is solved, with its curved geometry and its elastic
        moduli. Unit: stress / length.
        """
        C = self.material.elastic_tangent
        X, w = bulk_quadrature(self.V.mesh.basix_cell(), self.degree)
        basis = cell_basis(self.V.mesh, self.degree, self.cells, X)
        B = PointStrain(self.kinematics, basis, self.cell_dofs).matrix()
        energy = np.einsum("nq,nqia,ij,nqjb->nab", basis.measure * w, B, C, B, optimize=True)
        x, y = np.moveaxis(self.outward, -1, 0)
        normal, shear = [x**2, y**2, 2 * x * y], [-x * y, x * y, x**2 - y**2]
        rows = np.einsum(
            "inqk,nqka->inqa",
            np.stack([normal, shear]).transpose(0, 2, 3, 1) @ C,
            self._small_strain.matrix(),
        )
        traces = np.einsum("nq,inqa,inqb->inab", self.weight, rows, rows)
        value, vector = np.linalg.eigh(energy)
        scaled = vector[..., 3:] / np.sqrt(value[:, None, 3:])
        return np.linalg.eigvalsh(np.swapaxes(scaled, 1, 2) @ traces @ scaled)[..., -1]

    def arc_position(self, origin: Array) -> Array:
        """Arc length ``(n_facets, q)`` of all points, from the end of an open curve nearest to
        ``origin`` ``(2,)``; on closed curves, and on each of several pieces, from where it
        starts."""
        s = self.curve.arc_length(np.column_stack([self.curve_xi, np.ones(self.n_facets)]))
        ends = self.curve.connectivity[[0, -1], [0, -1]]
        first, last = np.linalg.norm(self.curve.X[ends] - origin, axis=1)
        return s[-1, -1] - s[:, :-1] if last < first and self.curve.n_pieces == 1 else s[:, :-1]

    def curve_displacement(self, u: Array) -> Array:
        """Displacement ``(n_nodes, 2)`` of the whole curve, from this rank's nodal displacements
        ``u`` ``(n, 2)``."""
        values = np.zeros((len(self.curve_dofs), 2))
        values[self._owned] = u[self._owned_local]
        return self.sum_over_ranks(values)

    def sum_over_ranks(self, values: Array) -> Array:
        """Sum of an array that every rank holds."""
        if self.comm.size == 1:
            return values
        total = np.empty_like(values)
        self.comm.Allreduce(values, total)
        return total

    def add_to_owned(self, curve_force: Array, force: Array) -> None:
        """Add nodal forces ``(n_nodes, 2)`` of the whole curve to this rank's owned ``force`` ``(n,
        2)``."""
        force[self._owned_local] += curve_force[self._owned]

    def deform(self, u: Array) -> tuple[Array, Array, Array]:
        """Own displacement ``(n q, 2)`` at the contact points, force of the own stress per
        undeformed area ``(n q, 2)``, and its derivative ``(n q, 2, 4)`` by the displacement
        gradient, ``[xx, yy, xy, yx]``."""
        stress, moduli = self.points.update(self.strain(u).reshape(-1, self.strain.k))
        by_strain = self._cut @ moduli
        if self.material.finite:
            return self.displacement(u), np.einsum("mij,mj->mi", self._cut, stress), by_strain
        working = stress[:, self.kinematics.working]
        force = np.einsum("mij,mj->mi", self._cut, working)
        return self.displacement(u), force, by_strain @ self.kinematics.small

    def displacement(self, u: Array) -> Array:
        """Own displacement ``(n q, 2)`` at the contact points."""
        return (self.shape @ u[self.cell_dofs]).reshape(-1, 2)


class RigidSurface:
    """A rigid disc as a surface of one facet, without points of its own, displaced by ``motion``
    ``(1, 2)``.

    ``rate`` ``(d, 2)`` is that per unit of each drive; ``curve_dofs`` ``(1,)`` is a block dof
    behind the others.
    """

    n_facets = 1

    def __init__(self, circle: RigidCircle, rate: npt.ArrayLike = (0.0, 0.0)) -> None:
        self.curve, self.rate = circle, np.atleast_2d(np.asarray(rate, dtype=float))
        self.motion: Array = np.zeros((1, 2))
        self.curve_dofs = np.zeros(1, dtype=np.int64)

    def curve_displacement(self, u: Array) -> Array:
        """The displacement of the disc ``(1, 2)``, whatever that of the bodies."""
        return self.motion


def _owned_facets(mesh, facets) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Owned cells behind ``facets``, the facets' numbers within them, and which of these lie
    between two cells."""
    for dimensions in ((1, 2), (2, 1)):
        mesh.topology.create_connectivity(*dimensions)
    to_cell, to_facet = mesh.topology.connectivity(1, 2), mesh.topology.connectivity(2, 1)
    cells = np.array([to_cell.links(f)[0] for f in facets], dtype=np.int32).reshape(-1)
    keep = cells < mesh.topology.index_map(2).size_local
    cells, facets = cells[keep], np.asarray(facets)[keep]
    n, within = len(basix.topology(mesh.basix_cell())[1]), np.diff(to_cell.offsets)[facets] > 1
    return cells, np.nonzero(to_facet.array.reshape(-1, n)[cells] == facets[:, None])[1], within


def _refuse(name: str, dofs: np.ndarray, x: Array, within: np.ndarray) -> None:
    """Raise ValueError unless the facets with nodes ``dofs`` ``(n, p + 1)`` at ``x`` are the
    boundary of a body."""
    if not len(dofs):
        raise ValueError(f"the contact surface {name!r} has no facets")
    _, which, count = np.unique(
        np.sort(dofs[:, [0, -1]]), axis=0, return_inverse=True, return_counts=True
    )
    for a, b in x[within | (count[which.ravel()] > 1)].mean(
        axis=1
    ):  # two ranks may have a cell each
        raise ValueError(
            f"the contact surface {name!r} has facets within its body, the first at ({a:g}, {b:g})"
        )
    for end in (0, -1):
        _, first, count = np.unique(dofs[:, end], return_index=True, return_counts=True)
        for a, b in x[first[count > 1], end]:
            raise ValueError(
                f"the contact surface {name!r} branches at ({a:g}, {b:g}), where three of its facets meet"
            )

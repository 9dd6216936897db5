"""One side of a contact: the facets of a body's contact surface on this rank, and the whole surface
on every rank: as a curve in a plane, as patches in space.

The whole surface is small beside the mesh (a curve grows with its square root), so every rank holds
all of it and exchanges its displacement; each rank integrates the facets of the cells it owns.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import basix
import numpy as np
import numpy.typing as npt
from dolfinx import fem
from mpi4py import MPI

from archord.geometry.basis import CONTACT_POINTS, Array, bulk_quadrature, cell_basis
from archord.geometry.curve import Curve, ProjectionError, RigidCircle, in_pieces
from archord.geometry.overlay import coincide
from archord.geometry.patches import Patches
from archord.geometry.rigid_in_space import RigidBall
from archord.geometry.strain import PointStrain
from archord.kernels.compat import cell_nodes
from archord.materials.kinematics import PLANE_STRAIN, Kinematics
from archord.materials.material import Material, Points
from archord.solver.contact.facets import (
    BoundaryFacets,
    boundary_facets,
    facet_kind,
    facet_normals,
    refuse_all_but_a_boundary,
    refuse_branches,
)
from archord.solver.contact.quadrature import pieces_rule, segment_rule
from archord.solver.contact.trace_inequality import trace_constants

_MANY_FACETS = 500  # of a rank, from which on it breaks its share alone
# a direction in which no two nodes of a closed piece should be equally far
_ASKEW = np.array([0.5257, 0.8507])


class Deformed(NamedTuple):
    """The contact points of a surface at given displacements."""

    displacement: Array  # (m, d)
    stress_vector: Array  # (m, d) force of the own stress per undeformed area
    moduli: Array  # (m, d, g) its derivative by the displacement gradient


class Surface:
    """The boundary ``facets`` ``(n,)`` of the body with ``material`` in the displacement space
    ``V``, with contact points, ``q`` a facet.

    Collective; raises ValueError for facets that are no boundary of the body, or branch.

    Of the whole surface, on every rank:

    curve_dofs : (nodes,) global block dofs of its nodes
    curve : the curve, or the patches, of ``n_facets`` facets
    curve_xi : (n_facets, q) places of the points on the facets; in space (pieces, q, 2), of all
        pieces into which facets are broken
    facet_of_pieces : (pieces,) facets of the pieces, in rising order

    Of this rank's ``n`` facets, in space pieces of facets, in the order of the whole surface:

    piece : (n,) their numbers among the pieces of the whole surface
    facet : (n,) the numbers of their facets in the whole surface, in rising order
    cells : (n,) the cells behind them
    cell_dofs, cell_global : (n, a) block dofs of the cells' nodes on this rank, and of all ranks
    trace : (n, k) nodes on the facet within the cell
    point, outward : (n, q, d) the points, and the outward normals there
    weight : (n, q) measure of the curved facet, around an axis of the whole ring
    shape : (n, q, a) the cell's basis at the points
    trace_shape : (n, q, k) the same of the nodes on the facet
    derivative : (n, q, a, m) the basis by the axes, and around an axis over the radius
    terms : (g, 2) see `Kinematics.terms`
    small_strain : the small strain at the points
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        facets: np.ndarray,
        material: Material,
        name: str = "",
        kinematics: Kinematics = PLANE_STRAIN,
    ) -> None:
        self.V = V
        self.comm = V.mesh.comm
        self.material = material
        self.name = name
        self.kinematics = kinematics
        self.degree = V.element.basix_element.degree
        self._join(boundary_facets(V, facets))
        owned = self.curve_dofs - V.dofmap.index_map.local_range[0]
        is_owned = (owned >= 0) & (owned < V.dofmap.index_map.size_local)
        self._owned = np.flatnonzero(is_owned)
        self._owned_local = owned[self._owned]
        xi, w = _facet_rule(facet_kind(V.mesh.basix_cell()))
        xi = xi[:, 0] if xi.shape[1] == 1 else xi
        places = np.stack([xi] * self.n_facets)
        weights = np.tile(w, (self.n_facets, 1))
        self.place_points(places, weights)
        self._constants = self._trace_constants()

    @property
    def in_space(self) -> bool:
        """Whether facets are patches in space, not pieces of a curve."""
        return self.kinematics.dimension == 3

    def _join(self, found: BoundaryFacets) -> None:
        """Join the facets of all ranks, and order this rank's as in the whole."""
        index_map = self.V.dofmap.index_map
        cell_dofs = self.V.dofmap.list[found.cells]
        cell_global = index_map.local_to_global(cell_dofs.ravel()).reshape(cell_dofs.shape)
        nodes = self.V.tabulate_dof_coordinates()[:, : self.kinematics.dimension]
        own_dofs = np.take_along_axis(cell_global, found.trace, axis=1)
        own_x = nodes[np.take_along_axis(cell_dofs, found.trace, axis=1)]

        of_ranks = self.comm.allgather((own_dofs, own_x, found.within, found.number))
        dofs, x, within, number = (np.concatenate(parts) for parts in zip(*of_ranks, strict=True))
        order = self._ordered(dofs, x, within, number)
        unique, first, node = np.unique(dofs[order], return_index=True, return_inverse=True)
        along = np.argsort(first)  # the nodes in the order of the facets
        self.curve_dofs = unique[along]
        X = x[order].reshape(-1, x.shape[-1])[first[along]]
        connectivity = np.argsort(along)[node].reshape(dofs.shape)
        self.curve = self._shape(X, connectivity)
        self.n_facets = len(order)

        start = sum(len(part[0]) for part in of_ranks[: self.comm.rank])
        facet = np.argsort(order)[start : start + len(found.cells)]
        sort = np.argsort(facet)
        self._facets = found.reordered(sort)
        self._numbers = facet[sort]
        self._dofs_of_facets = cell_dofs[sort]
        self._global_of_facets = cell_global[sort]
        self._nodes = nodes

    def _take_pieces(self, facet: np.ndarray) -> None:
        """Let this rank's arrays be of pieces of the facets ``facet`` ``(pieces,)`` of the whole
        surface."""
        self.piece = np.flatnonzero(np.isin(facet, self._numbers))
        self.facet = facet[self.piece]
        home = np.searchsorted(self._numbers, self.facet)
        behind = self._facets.reordered(home)
        self.cells = behind.cells
        self.trace = behind.trace.astype(np.int32)
        self.cell_dofs = self._dofs_of_facets[home]
        self.cell_global = self._global_of_facets[home]
        self._home = home
        self._origin = behind.origin
        self._axes = behind.axes

    def _ordered(
        self, dofs: np.ndarray, x: Array, within: np.ndarray, number: np.ndarray
    ) -> np.ndarray:
        """The order of the facets with nodes ``dofs`` ``(n, k)`` at ``x`` ``(n, k, d)``: along
        curves, in space by their ``number`` ``(n,)``. Raises ValueError for what is no boundary."""
        kind = facet_kind(self.V.mesh.basix_cell())
        if kind != basix.CellType.interval:
            n_corners = len(basix.geometry(kind))
            middle = x[:, :n_corners].mean(axis=1)
            refuse_all_but_a_boundary(self.name, dofs[:, :n_corners], middle, within)
            return np.argsort(number)
        refuse_all_but_a_boundary(self.name, dofs[:, [0, -1]], x.mean(axis=1), within)
        refuse_branches(self.name, dofs, x)
        return in_pieces(dofs[:, 0], dofs[:, -1], x[:, 0] @ _ASKEW)

    def _shape(self, X: Array, connectivity: np.ndarray) -> Curve | Patches:
        """The whole surface. Raises ValueError if it branches."""
        kind = facet_kind(self.V.mesh.basix_cell())
        if kind == basix.CellType.interval:
            return Curve(X, self.degree, connectivity)
        try:
            return Patches(X, connectivity, kind, self.degree)
        except ValueError as error:
            raise ValueError(f"the contact surface {self.name!r} branches: {error}") from None

    def facet_lengths(self) -> Array:
        """Size ``(n_facets,)`` of every facet, over all ranks: its arc length, or the root of its
        area."""
        if isinstance(self.curve, Patches):
            return np.sqrt(self.curve.areas())
        ends = self.arc_length(np.array([0.0, 1.0]))
        return np.diff(ends)[:, 0]

    def face(self, opposite: Surface) -> None:
        """Place the points so that forces go to the ``opposite`` surface exactly; no history."""
        if isinstance(self.curve, Patches) and isinstance(opposite.curve, Patches):
            self.place_points(*self._broken_by(self.curve, opposite.curve))
        if isinstance(self.curve, Curve) and isinstance(opposite.curve, Curve):
            self.place_points(*segment_rule(self.curve, opposite.curve))

    def _broken_by(self, own: Patches, opposite: Patches) -> tuple[Array, Array, np.ndarray]:
        """`pieces_rule` of the surface's ``own`` facets; of many, each rank breaks a share."""
        same = coincide(own, opposite)
        n_ranks = self.comm.size
        if own.n_facets < _MANY_FACETS * n_ranks:
            return pieces_rule(own, opposite, same=same)
        ends = np.arange(n_ranks + 1) * own.n_facets // n_ranks
        first, last = ends[self.comm.rank : self.comm.rank + 2]
        with on_every_rank(self.comm):
            xi, w, facet = pieces_rule(own.part(first, last), opposite, same=same)
        shares = self.comm.allgather((xi, w, facet + first))
        xi, w, facet = (np.concatenate(parts) for parts in zip(*shares, strict=True))
        return xi, w, facet

    def place_points(self, xi: Array, w: Array, facet: np.ndarray | None = None) -> None:
        """Put the contact points at ``xi`` ``(n_facets, q)`` in (0, 1), in space ``(pieces, q,
        2)``, with weights ``w``; no history. Pieces are of the facets ``facet`` ``(pieces,)``, in
        rising order; without, every facet is one."""
        self.curve_xi = xi
        self._along: Array | None = None
        self.facet_of_pieces = np.arange(self.n_facets) if facet is None else facet
        self._take_pieces(self.facet_of_pieces)
        w = w[self.piece]
        on_facet = xi[self.piece].reshape(*w.shape, self._axes.shape[1])
        X = self._origin[:, None] + on_facet @ self._axes
        basis = cell_basis(self.V.mesh, self.degree, self.cells, X)
        normal = facet_normals(basis.jacobian, self._axes)
        length = np.linalg.norm(normal, axis=-1)
        self.outward = normal / length[..., None]
        self.shape = basis.shape.copy()  # of an array that has the derivatives, too
        self.point = basis.point
        if cell_nodes(self.V.mesh).shape[1] > self.shape.shape[-1]:
            self.point = self.shape @ self._nodes[self.cell_dofs]  # on the curve
        self.weight = length * w * self.kinematics.measure(self.point)
        n, q = self.weight.shape
        nodes = np.broadcast_to(self.trace[:, None, :], (n, q, self.trace.shape[1]))
        self.trace_shape = np.take_along_axis(self.shape, nodes, axis=2)

        self.points = Points(self.material, n * q)
        large = self.material.finite
        self.small_strain = PointStrain(self.kinematics, basis, self.cell_dofs)
        self._strain = PointStrain(self.kinematics, basis, self.cell_dofs, large=large)
        self.derivative = self._strain.derivative
        self.terms = np.array(self.kinematics.terms, dtype=np.int32)
        outward = self.outward.reshape(n * q, self.outward.shape[-1])
        # takes a stress to the force on the facet
        self._cut = np.ascontiguousarray(self.kinematics.traction(outward, large=large))

    @property
    def gamma(self) -> Array:
        """Constant ``(n,)`` of the trace inequality of normal stress, in stress per length."""
        of_pressure, _ = self._constants
        return of_pressure[self._home]

    @property
    def gamma_shear(self) -> Array:
        """The same of the shear."""
        _, of_shear = self._constants
        return of_shear[self._home]

    def _trace_constants(self) -> tuple[Array, Array]:
        """Constants ``(n,)`` of the trace inequality, of normal stress and shear."""
        X, w = bulk_quadrature(self.V.mesh.basix_cell(), self.degree, full=True)
        basis = cell_basis(self.V.mesh, self.degree, self.cells, X)
        strain = PointStrain(self.kinematics, basis, self.cell_dofs)
        weight = basis.measure * w * self.kinematics.measure(basis.point)
        in_cell = strain, weight
        on_facet = self.small_strain, self.weight
        moduli = self.material.elastic_tangent
        return trace_constants(moduli, self.kinematics, in_cell, on_facet, self.outward)

    def arc_length(self, xi: Array) -> Array:
        """Length ``(n_facets, m)`` along the curve, see `Curve.arc_length`. Raises ValueError in
        space."""
        if isinstance(self.curve, Patches):
            raise ValueError("surfaces in space have no arc length")
        return self.curve.arc_length(xi)

    @property
    def along(self) -> Array:
        """Arc length ``(n_facets, q + 1)`` of all points, and of the end of each facet, along
        each piece. Raises ValueError in space."""
        if self._along is None:
            places = np.column_stack([self.curve_xi, np.ones(self.n_facets)])
            self._along = self.arc_length(places)
        return self._along

    def arc_position(self, origin: Array) -> Array:
        """Arc length ``(n_facets, q)`` of all points, from the end of an open curve nearest to
        ``origin`` ``(2,)``; on closed curves, and on each of several pieces, from where it
        starts."""
        s = self.along
        ends = self.curve.connectivity[[0, -1], [0, -1]]
        first, last = np.linalg.norm(self.curve.X[ends] - origin, axis=1)
        one_piece = isinstance(self.curve, Curve) and self.curve.n_pieces == 1
        if last < first and one_piece:
            return s[-1, -1] - s[:, :-1]
        return s[:, :-1]

    def curve_displacement(self, u: Array) -> Array:
        """Displacement ``(nodes, d)`` of the whole curve, from this rank's nodal displacements
        ``u``."""
        values = np.zeros((len(self.curve_dofs), u.shape[1]))
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
        """Add nodal forces ``(nodes, d)`` of the whole curve to this rank's owned ``force``."""
        force[self._owned_local] += curve_force[self._owned]

    def deform(self, u: Array) -> Deformed:
        """The contact points at this rank's nodal displacements ``u``."""
        stress, tangent = self.points.update(self._strain(u).reshape(-1, self._strain.k))
        moduli = self._cut @ tangent
        if not self.material.finite:
            stress = stress[:, self.kinematics.working]
            moduli = moduli[..., self.kinematics.small.argmax(axis=0)]
        stress_vector = np.einsum("mij,mj->mi", self._cut, stress)
        return Deformed(
            self.displacement(u),
            np.ascontiguousarray(stress_vector),
            np.ascontiguousarray(moduli),
        )

    def displacement(self, u: Array) -> Array:
        """Own displacement ``(m, d)`` at the contact points."""
        return (self.shape @ u[self.cell_dofs]).reshape(-1, u.shape[1])


def _facet_rule(kind: basix.CellType) -> tuple[Array, Array]:
    """Points ``(q, d - 1)`` and weights ``(q,)`` on the reference facet: exact for the pressures of
    quadratic displacements on quadratic shape functions, and two degrees more."""
    degree = 2 * CONTACT_POINTS - 1
    if kind == basix.CellType.triangle:
        degree -= 1
    return basix.make_quadrature(kind, degree)


class RigidSurface:
    """A rigid disc, around an axis a sphere, in space a ball or a cylinder, as a surface of one
    facet without points of its own.

    curve_dofs : (1,) a block dof behind the block dofs of the displacement
    rate : (drives, d) displacement per unit of each drive
    motion : (1, d) displacement
    """

    n_facets = 1

    def __init__(self, circle: RigidCircle | RigidBall, rate: npt.ArrayLike | None = None) -> None:
        self.curve = circle
        self.curve_dofs = np.zeros(1, dtype=np.int64)
        still = np.zeros((1, circle.dimension))
        self.rate = still if rate is None else np.atleast_2d(np.asarray(rate, dtype=float))
        self.motion: Array = still

    def curve_displacement(self, u: Array) -> Array:
        """The displacement of the disc ``(1, d)``, whatever the displacement of the bodies."""
        return self.motion


@contextmanager
def on_every_rank(comm: MPI.Comm) -> Iterator[None]:
    """Let a `ProjectionError` that any rank raises within the context be raised on all of them.
    Collective."""
    failure = None
    try:
        yield
    except ProjectionError as error:
        failure = str(error)
    failures = [said for said in comm.allgather(failure) if said]
    if failures:
        raise ProjectionError(failures[0])

"""The contact along the surfaces of a problem: points, pressure and gap, with the pressure
projected facet by facet.

The raw pressure at quadrature points scatters inside plastic facets, its integrals over facets do
not: what is reported is built from them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.geometry.vectors import ALIKE
from archord.materials.kinematics import Arrays, Ints
from archord.materials.material import Array
from archord.report.by_name import ByName, Names

if TYPE_CHECKING:  # a profile is read from a run folder, too, without the solver
    from archord.geometry.patches import Patches
    from archord.solver.contact.pair import Pair
    from archord.solver.contact.surface import Surface
    from archord.solver.path.system import System

PER_STEP = ("coordinates", "pressure", "raw_pressure", "gap")  # of contact.h5
_ON_CONE = 1e-6  # of the largest shear: what comes as close slides
OF_FRICTION = ("shear", "sticks")  # of one with friction also


@dataclass(frozen=True, kw_only=True)
class ContactProfile:
    """One surface's contact state at ``q`` points of its ``n`` facets, in space of the pieces into
    which the opposite's edges break facets, on every rank.

    weight : (n, q) measure
    coordinates : (n, q, d) deformed
    pressure : (n, q) positive in compression; projected: linear on each facet, with the facet's
        force
    raw_pressure : (n, q) as integrated by the solver
    gap : (n, q) positive when open
    shear : (n, q) on the surface, positive along s; in space (n, q, 3); with friction, else None
    sticks : (n, q) 1 where points touch and stick; with friction, else None
    """

    weight: Array
    coordinates: Array
    pressure: Array
    raw_pressure: Array
    gap: Array
    shear: Array | None = None
    sticks: Array | None = None

    @property
    def width(self) -> Array:
        """Measure ``(n,)`` of each facet: a length in a plane, an area around an axis and in
        space."""
        return self.weight.sum(axis=1)

    @property
    def facet_force(self) -> Array:
        """Integral of the pressure over each facet ``(n,)``."""
        return (self.weight * self.raw_pressure).sum(axis=1)

    @property
    def in_contact(self) -> Array:
        """Share ``(n,)`` of each facet that carries pressure."""
        is_pressed = self.raw_pressure > 0
        return (self.weight * is_pressed).sum(axis=1) / self.width

    @property
    def contact_length(self) -> float:
        """Measure of the surface under pressure: a length in a plane, an area around an axis and
        in space."""
        return float((self.in_contact * self.width).sum())


@dataclass(frozen=True, kw_only=True)
class EdgeProfile(ContactProfile):
    """The contact state of an edge, in a plane or around an axis.

    s : (n, q) arc length along the curve
    """

    s: Array


@dataclass(frozen=True, kw_only=True)
class _Displaced(ContactProfile):
    """A contact state with the undeformed points, and how far they slid.

    X : (n, q, d)
    slip : (n, q) see `Pair.slip`; in space (n, q, 3)
    """

    X: Array
    slip: Array

    @property
    def largest_slip(self) -> float:
        """Largest slip, whichever way, where there is pressure."""
        is_pressed = self.raw_pressure > 0
        sizes = _size(self.slip)[is_pressed]
        return float(sizes.max(initial=0.0))

    @property
    def largest_shear(self) -> float:
        """Largest shear, whichever way, on a surface with friction."""
        return float(_size(self.shear).max()) if self.shear is not None else 0.0

    @property
    def largest(self) -> tuple[float, Array]:
        """Largest projected pressure, and the undeformed place ``(d,)`` where it is."""
        where_pressed = np.where(self.raw_pressure > 0, self.pressure, 0.0)
        at = np.unravel_index(_first_largest(where_pressed), self.pressure.shape)
        return float(where_pressed.max()), self.X[at]


def _first_largest(values: Array) -> int:
    """Where the largest of ``values``, counted through, is; the first place of several that differ
    by round-off, as images in a mirror do."""
    flat = values.ravel()
    largest = flat.max()
    return int(np.argmax(flat >= largest - ALIKE * abs(largest)))


def _size(values: Array) -> Array:
    """The size of scalars ``(n, q)``, or of vectors ``(n, q, 3)``."""
    return np.abs(values) if values.ndim == 2 else np.linalg.norm(values, axis=-1)


@dataclass(frozen=True, kw_only=True)
class PatchProfile(_Displaced):
    """The contact state of a surface in space.

    normal : (n, q, 3) outward, undeformed
    facet : (n,) the facet of each piece
    corners : (n, c, 3) the undeformed corners of these facets, one after the other around them
    facet_pressure : (n,) mean pressure of these facets
    traction : (n, q, 3) contact force on the own body per undeformed area
    corner_pressure : (n, c) pressure at the corners, recovered: of facets that meet the same
    """

    normal: Array
    traction: Array
    facet: np.ndarray
    corners: Array
    facet_pressure: Array
    corner_pressure: Array

    @property
    def largest(self) -> tuple[float, Array]:
        """Largest mean pressure of a facet, and the undeformed middle ``(3,)`` of this facet.

        Pressures at points, projected ones too, scatter more and more on finer meshes where a
        contact of plastic bodies ends within a facet.
        """
        piece = _first_largest(self.facet_pressure)
        of_facet = self.facet == self.facet[piece]
        points = self.X[of_facet].reshape(-1, 3)
        weights = self.weight[of_facet].ravel()
        middle = np.average(points, axis=0, weights=weights)
        return max(float(self.facet_pressure.max()), 0.0), middle


@dataclass(frozen=True, kw_only=True)
class SurfaceProfile(EdgeProfile, _Displaced):
    """The contact state of an edge with its undeformed points."""

    @property
    def n_arcs(self) -> int:
        """Number of separate stretches under pressure."""
        closed = self.in_contact > 0
        first = self.X[:, 0]
        last = self.X[:, -1]
        # gaps between the points of neighbours are a seventh of the longest chord
        longest = np.linalg.norm(last - first, axis=1).max()
        apart = np.linalg.norm(first[1:] - last[:-1], axis=1) > longest
        begins = closed[1:] & (~closed[:-1] | apart)
        arcs = int(closed[0]) + int(begins.sum())
        is_ring = np.linalg.norm(first[0] - last[-1]) < longest
        if arcs > 1 and is_ring and closed[0] and closed[-1]:
            return arcs - 1
        return arcs


AnyProfile = SurfaceProfile | PatchProfile


def fixed(system: System) -> Names:
    """Names of the arrays of contact.h5 that do not change."""
    in_space = system.problem.kinematics.dimension == 3
    return ("weight", "X", "normal", "facet", "corners") if in_space else ("s", "weight", "X")


def per_step(system: System) -> Names:
    """Names of the arrays of contact.h5 that change."""
    names = PER_STEP + OF_FRICTION if system.contact.has_friction else PER_STEP
    in_space = system.problem.kinematics.dimension == 3
    return (*names, "traction", "facet_pressure", "corner_pressure") if in_space else names


def surface_profiles(system: System) -> ByName:
    """Contact state along the integrated surfaces, by name, at the last evaluation. Collective."""
    u = system.equilibrium.displacement()
    found = {}
    for name, side in system.sides.items():
        pair = system.contact.pair_of(side)
        if pair is None:  # it is not integrated
            continue
        whole = _of_all_ranks(side, pair, u)
        has_friction = system.contact.has_friction
        more = {name: whole[name] for name in OF_FRICTION if has_friction}
        make = _patch_profile if side.in_space else _edge_profile
        del whole["shear"], whole["sticks"]
        found[name] = make(side, **whole, **more)
    return found


def _of_all_ranks(side: Surface, pair: Pair, u: Array) -> Arrays:
    """The arrays ``(n, q)`` and ``(n, q, d)`` of a profile at all facets of the ``side``.
    Collective."""
    from archord.solver.contact.laws.coulomb import Coulomb

    displaced = side.point + np.einsum("nqa,nai->nqi", side.shape, u[side.cell_dofs])
    # the frame's tangent runs along the opposite surface, which this one meets the other way round
    shear = 0.0 - pair.shear
    sticks = pair.law.has_friction & pair.sticks.reshape(shear.shape)
    if isinstance(pair.law, Coulomb):  # branches of points on the cone depend on round-off
        sticks = np.abs(shear) < (1 - _ON_CONE) * pair.law.friction * pair.pressure
    here = {
        "weight": side.weight,
        "raw_pressure": pair.pressure,
        "gap": pair.distance,
        "slip": pair.slip,
        "shear": shear,
        "sticks": sticks,
        "coordinates": displaced,
        "X": side.point,
    }
    if side.in_space:
        here |= {"slip": pair.slips, "shear": pair.shears, "traction": pair.tractions}
        here["normal"] = side.outward
    columns = [np.atleast_3d(values) for values in here.values()]
    together = np.concatenate(columns, axis=-1)
    local = np.zeros((len(side.curve_xi), *together.shape[1:]))
    local[side.piece] = together
    whole = side.sum_over_ranks(local)
    ends = np.cumsum([column.shape[-1] for column in columns])[:-1]
    parts = zip(here.items(), np.split(whole, ends, axis=-1), strict=True)
    return {name: part if old.ndim == 3 else part[..., 0] for (name, old), part in parts}


def _edge_profile(side: Surface, weight: Array, raw_pressure: Array, **others: Any) -> Any:
    s = side.along[:, :-1]
    pressure = project(raw_pressure, s, weight)
    return SurfaceProfile(
        s=s, weight=weight, pressure=pressure, raw_pressure=raw_pressure, **others
    )


def _patch_profile(side: Surface, weight: Array, raw_pressure: Array, **others: Any) -> Any:
    patches: Any = side.curve
    facet = side.facet_of_pieces
    force = np.bincount(facet, (weight * raw_pressure).sum(axis=1))
    area = np.bincount(facet, weight.sum(axis=1))
    return PatchProfile(
        weight=weight,
        pressure=project_on_patches(raw_pressure, side.curve_xi, weight, facet),
        raw_pressure=raw_pressure,
        facet=facet,
        corners=patches.X[patches.vertices][facet],
        facet_pressure=(force / area)[facet],
        corner_pressure=recovered(patches, side.curve_xi, weight, facet, raw_pressure)[facet],
        **others,
    )


def project_on_patches(pressure: Array, xi: Array, weight: Array, facet: Ints) -> Array:
    """L2 projection ``(n, q)`` of ``pressure`` at points of pieces onto one function a facet that
    is linear in the places ``xi`` ``(n, q, 2)`` on it; facet integrals are kept exactly. The facets
    ``(n,)`` of the pieces are counted from 0 on."""
    functions = np.concatenate([np.ones((*weight.shape, 1)), xi], axis=-1)
    weighted = functions * weight[..., None]
    n = facet.max(initial=-1) + 1
    moments = np.zeros((n, 3, 3))
    right = np.zeros((n, 3, 1))
    np.add.at(moments, facet, weighted.swapaxes(1, 2) @ functions)
    np.add.at(right, facet, weighted.swapaxes(1, 2) @ pressure[..., None])
    return (functions @ np.linalg.solve(moments, right)[facet])[..., 0]


def recovered(patches: Patches, xi: Array, weight: Array, facet: Ints, pressure: Array) -> Array:
    """Pressure ``(facets, c)`` at the corners of the ``patches``: L2 projection of ``pressure``
    ``(n, q)`` at points of pieces onto a continuous function that is linear on triangles and
    bilinear on quadrilaterals. The force is kept exactly.

    It converges with the second order where the pressure is smooth, and may be negative beside the
    edge of the contact. ``xi`` ``(n, q, 2)`` are the places of the points on the facets ``facet``
    ``(n,)`` of the pieces."""
    from scipy.sparse import coo_array  # runs in a plane do not pay for it
    from scipy.sparse.linalg import spsolve

    shape = patches.corner_shapes(xi.reshape(-1, 2)).reshape(*weight.shape, -1)
    weighted = shape * weight[..., None]
    mass = weighted.swapaxes(1, 2) @ shape
    force = weighted.swapaxes(1, 2) @ pressure[..., None]
    vertices = patches.corners[facet]
    rows, columns = np.broadcast_arrays(vertices[:, :, None], vertices[:, None, :])
    matrix = coo_array((mass.ravel(), (rows.ravel(), columns.ravel()))).tocsc()
    right = np.bincount(vertices.ravel(), force.ravel())
    return spsolve(matrix, right)[patches.corners]


def project(pressure: Array, s: Array, weight: Array) -> Array:
    """L2 projection ``(n, q)`` of ``pressure`` onto one linear function a facet; facet integrals
    are kept exactly."""
    total = weight.sum(axis=1, keepdims=True)
    mean = (weight * pressure).sum(axis=1, keepdims=True) / total
    lever = s - (weight * s).sum(axis=1, keepdims=True) / total
    slope = (weight * lever * pressure).sum(axis=1, keepdims=True) / (weight * lever**2).sum(
        axis=1, keepdims=True
    )
    return mean + slope * lever

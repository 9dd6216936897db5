"""Nitsche contact between two curves that may not match (Chouly, Hild and Renard 2015; theta = 0).

At a point ``x`` of a side, with closest point ``y`` on the opposite curve, ``n`` the opposite's outward normal there
and ``g = (x - y) . n`` the gap, the contact pressure is ``p = [t . n - gamma g]_+`` with ``t = sigma(u) N`` the
traction of the own body, and the virtual work of the contact forces is ``sum over sides of share * integral of p n .
(v(x) - v(y))``. The unbiased form gives like bodies one half each; of unlike bodies the softer takes more, in
proportion to the compliances (Annavarapu, Hautefeuille and Dolbow 2012), or a stiff pin's ``gamma`` would swamp the
other's. The one-sided form integrates one side only. ``gamma`` is ``gamma_factor`` times the share times the trace
constant ``c`` of each contact cell, ``|sigma_n(v)|^2 <= c a(v, v)``. The form is coercive where ``gamma > share c /
4``: Cauchy-Schwarz and ``c`` bound ``share * integral of sigma_n v_n`` by ``sqrt(a(v, v)) * share sqrt(c) |v_n|``,
which ``a(v, v) + share gamma |v_n|^2`` exceeds. Under current kinematics the closest points belong to the deformed
curves and the linearisation includes the moving ``n`` and ``y``; under reference kinematics pairs are those of the
undeformed curves, with the normal of the first side (the pin) for both, and the gap is linear in the displacement. A
tied contact carries the full vector ``t - gamma ([[u]])`` whatever its sign.

Opposite curves may lie on other ranks: their displacement is exchanged, forces on them are summed over the ranks, and
their rows of the matrix travel with PETSc's assembly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from archord.geometry.curve import Array, Curve, Projection, ProjectionError, RigidCircle
from archord.solver.contact_side import ContactSide
from archord.solver.points import PlasticPoints

Kinematics = Literal["current", "reference", "tied"]
GAMMA_FACTOR = 0.5  # twice the bound of coercivity; larger values stiffen the edge of the contact and cost iterations
_PATTERN_MARGIN = 2  # opposite facets kept in the matrix pattern on either side of those expected


@dataclass
class _Pairing:
    """State of one integrated side against its opposite at the last evaluated displacement; arrays over points."""

    side: ContactSide
    opposite: ContactSide | RigidCircle
    share: float
    gamma: Array  # (m,)
    fixed: Projection | None = None  # reference kinematics: the pairs
    projection: Projection | None = None
    reach: np.ndarray | None = None  # (n_facets, 2) opposite facets in the matrix pattern, for every facet of the curve
    separation: Array | None = None  # x - y (m, 2)
    gap: Array | None = None
    pressure: Array | None = None
    traction: Array | None = None
    tangent: Array | None = None

    @property
    def curve(self) -> Curve | RigidCircle:
        return self.opposite.curve if isinstance(self.opposite, ContactSide) else self.opposite


@dataclass(frozen=True)
class PointState:
    """What a side's points carry: arrays ``(n_facets_of_this_rank, q)`` and the facets' numbers along the curve."""

    facet: np.ndarray
    gap: Array
    pressure: Array
    normal: Array  # (n, q, 2) outward normal of the opposite side
    found: np.ndarray


class Contact:
    """Contact of ``sides``; the opposite of a lone side is ``rigid``.

    ``rigid_motion`` is the displacement of the rigid disc, set before each evaluation.
    """

    def __init__(
        self,
        sides: list[ContactSide],
        *,
        rigid: RigidCircle | None = None,
        kinematics: Kinematics = "current",
        gamma_factor: float = GAMMA_FACTOR,
        one_sided: int | None = None,
    ) -> None:
        self.sides = sides
        self.kinematics = kinematics
        self.rigid_motion = np.zeros(2)
        self.comm = sides[0].comm
        opposites = [rigid] if rigid is not None else [sides[1], sides[0]]
        chosen = range(len(sides)) if one_sided is None else [one_sided]
        compliance = np.array([1 / sides[i].points.elastic_tangent[0, 0] for i in chosen])
        self.pairings = []
        for i, share in zip(chosen, compliance / compliance.sum(), strict=True):
            gamma = np.repeat(gamma_factor * share * sides[i].gamma, sides[i].weight.shape[1])
            self.pairings.append(_Pairing(sides[i], opposites[i], float(share), gamma))
        rest = self._motions(None)
        failure = None
        for pair in self.pairings:
            side = pair.side
            x, outward = side.point.reshape(-1, 2), side.outward.reshape(-1, 2)
            try:
                start = pair.curve.closest_point(x, outward, rest[id(pair.opposite)])
            except ProjectionError as error:
                failure = str(error)
                break
            pair.projection = start
            if kinematics != "current":
                pair.fixed = start
                if side is sides[0] and rigid is None:
                    pair.fixed = replace(start, normal=-side.outward.reshape(-1, 2))
                pair.separation = side.point.reshape(-1, 2) - start.point
        self._raise_together(failure)
        self._extend_pattern([p.projection.facet for p in self.pairings])

    # ------------------------------------------------------------------ evaluation

    def _motions(self, u: Array | None) -> dict[int, Array]:
        """Displacement of each opposite: of its curve's nodes, or of the rigid disc; at rest without ``u``."""
        motion = {}
        for pair in self.pairings:
            if not isinstance(pair.opposite, ContactSide):
                motion[id(pair.opposite)] = np.zeros(2) if u is None else self.rigid_motion
            elif u is None:
                motion[id(pair.opposite)] = np.zeros((len(pair.opposite.curve_dofs), 2))
            else:
                motion[id(pair.opposite)] = pair.opposite.curve_displacement(u)
        return motion

    def search(self) -> None:
        """Forget where the pairs were: the next evaluation searches them anew, over whole curves."""
        for pair in self.pairings:
            if pair.fixed is None:
                pair.projection = None

    def evaluate(self, u: Array) -> bool:
        """Gaps, pressures and trial history at the nodal displacements ``u`` ``(n, 2)`` of this rank.

        Returns whether the matrix pattern had to grow (the pairs slid out of it). Collective; raises `ProjectionError`
        on every rank if a point on any of them finds no partner.
        """
        motion = self._motions(u)
        failure = None
        for pair in self.pairings:
            side = pair.side
            displacement, stress, tangent = side.deform(u)
            displacement = displacement.reshape(-1, 2)
            outward = side.outward.reshape(-1, 2)
            shift = motion[id(pair.opposite)]
            if pair.fixed is None:
                x = side.point.reshape(-1, 2) + displacement
                start = None if pair.projection is None else pair.projection.facet
                try:
                    pair.projection = (
                        pair.curve.closest_point(x, outward, shift, start)
                        if isinstance(pair.curve, Curve)
                        else pair.curve.closest_point(x, outward, shift)
                    )
                except ProjectionError as error:
                    failure = str(error)
                    break
                pair.separation = x - pair.projection.point
                pair.gap = (pair.separation * pair.projection.normal).sum(1)
                relative = None
            else:
                relative = displacement - self._opposite_displacement(pair, shift)
                pair.projection = pair.fixed
                pair.gap = ((pair.separation + relative) * pair.fixed.normal).sum(1)
            s = stress.reshape(-1, 4)
            pair.traction = np.stack(
                [s[:, 0] * outward[:, 0] + s[:, 3] * outward[:, 1], s[:, 3] * outward[:, 0] + s[:, 1] * outward[:, 1]],
                axis=1,
            )
            pair.tangent = tangent.reshape(-1, 3, 3)
            if self.kinematics == "tied":
                pair.traction = pair.traction - pair.gamma[:, None] * relative
                pair.pressure = (pair.traction * pair.projection.normal).sum(1)
            else:
                trial = (pair.traction * pair.projection.normal).sum(1) - pair.gamma * pair.gap
                pair.pressure = np.where(pair.projection.found & (trial > 0), trial, 0.0)
        self._raise_together(failure)
        return self._extend_pattern([p.projection.facet for p in self.pairings])

    def _raise_together(self, failure: str | None) -> None:
        """Raise `ProjectionError` on every rank if any rank reports a ``failure``, and forget the pairs."""
        failures = [f for f in self.comm.allgather(failure) if f]
        if failures:
            self.search()
            raise ProjectionError(failures[0])

    @staticmethod
    def _opposite_displacement(pair: _Pairing, motion: Array) -> Array:
        if isinstance(pair.opposite, RigidCircle):
            return motion
        return np.einsum("ma,mai->mi", pair.fixed.shape, motion[pair.fixed.nodes])

    def _forces(self, pair: _Pairing) -> Array:
        """Weighted contact force ``(m, 2)`` of each point on its own body."""
        w = pair.share * pair.side.weight.ravel()
        if self.kinematics == "tied":
            return np.where(pair.projection.found, w, 0.0)[:, None] * pair.traction
        return (w * pair.pressure)[:, None] * pair.projection.normal

    def add_force(self, force: Array) -> None:
        """Subtract the contact forces of the last evaluation from the residual ``force`` ``(n, 2)`` of owned nodes."""
        on_curve = {id(side): np.zeros((len(side.curve_dofs), 2)) for side in self.sides}
        for pair in self.pairings:
            side, f = pair.side, self._forces(pair)
            n, q = side.weight.shape
            trace_shape = np.take_along_axis(
                side.shape, np.broadcast_to(side.trace[:, None, :], (n, q, side.trace.shape[1])), axis=2
            )
            own = np.einsum("nqa,nqi->nai", trace_shape, f.reshape(n, q, 2))
            np.add.at(on_curve[id(side)], side.curve.connectivity[side.facet], -own)
            if isinstance(pair.opposite, ContactSide):
                P = pair.projection
                np.add.at(on_curve[id(pair.opposite)], P.nodes, P.shape[:, :, None] * f[:, None, :])
        for side in self.sides:
            side.add_to_owned(side.sum_over_ranks(on_curve[id(side)]), force)

    def resultant(self) -> Array:
        """Contact force ``(2,)`` on the last side (the hole's, if both bodies deform), over all ranks."""
        total = np.zeros(2)
        for pair in self.pairings:
            total += self._forces(pair).sum(0) * (1 if pair.side is self.sides[-1] else -1)
        return self.sides[0].sum_over_ranks(total)

    def plastic_points(self) -> list[PlasticPoints]:
        """The points with history of all integrated sides."""
        return [pair.side.points for pair in self.pairings if pair.side.points.has_history]

    def commit(self) -> None:
        """Accept the history of the contact points at the last evaluation."""
        for pair in self.pairings:
            pair.side.points.commit()

    def n_active(self) -> int:
        """Number of points in contact, over all ranks."""
        return self.comm.allreduce(sum(int((p.pressure > 0).sum()) for p in self.pairings))

    def state(self, side: ContactSide) -> PointState | None:
        """Gap and pressure at the points of ``side``; None if that side is not integrated."""
        for pair in self.pairings:
            if pair.side is side:
                shape = side.weight.shape
                P = pair.projection
                return PointState(
                    side.facet,
                    pair.gap.reshape(shape),
                    pair.pressure.reshape(shape),
                    P.normal.reshape(*shape, 2),
                    P.found.reshape(shape),
                )
        return None

    # ------------------------------------------------------------------ linearisation

    def tangent(self) -> tuple[np.ndarray, np.ndarray, Array]:
        """Entries ``(rows, columns, values)`` in global scalar dofs of the derivative of what `add_force` adds."""
        parts = [self._tangent_of(pair) for pair in self.pairings]
        return tuple(np.concatenate([p[k] for p in parts]) for k in range(3))

    def _tangent_of(self, pair: _Pairing) -> tuple[np.ndarray, np.ndarray, Array]:
        side, tied = pair.side, self.kinematics == "tied"
        q = side.weight.shape[1]
        on = np.flatnonzero(pair.projection.found if tied else pair.pressure > 0)
        facet = on // q
        P = pair.projection
        n, N = P.normal[on], side.outward.reshape(-1, 2)[on]
        w = pair.share * side.weight.ravel()[on]
        shape = side.shape.reshape(-1, side.shape.shape[2])[on]
        gradient = side.gradient.reshape(-1, shape.shape[1], 2)[on]
        a, k = shape.shape[1], P.nodes.shape[1]
        m = len(on)
        jump = np.concatenate([shape, -P.shape[on]], axis=1)  # (m, a + k): v(x) - v(y) from nodal v
        C = pair.tangent[on]
        gamma = pair.gamma[on]
        rows_shape = np.concatenate([np.take_along_axis(shape, side.trace[facet], axis=1), -P.shape[on]], axis=1)

        if tied:
            stress_row = _stress_rows(C, gradient, N)  # (m, 2, 2a): d t
            columns = np.zeros((m, 2, a + k, 2))
            columns[:, :, :a] = stress_row.reshape(m, 2, a, 2)
            for i in range(2):
                columns[:, i, :, i] -= gamma[:, None] * jump
            block = -w[:, None, None, None, None] * rows_shape[:, :, None, None, None] * columns[:, None]
        else:
            t, tau = pair.traction[on], P.tangent[on]
            speed = np.linalg.norm(tau, axis=1)
            unit = tau / speed[:, None]
            stress_row = np.einsum("mi,mia->ma", n, _stress_rows(C, gradient, N)).reshape(m, a, 2)
            dp = np.zeros((m, a + k, 2))
            dp[:, :a] = stress_row
            dp -= gamma[:, None, None] * jump[:, :, None] * n[:, None, :]
            p = pair.pressure[on]
            row_n = rows_shape[:, :, None] * n[:, None, :]
            block = row_n[:, :, :, None, None] * dp[:, None, None]
            if self.kinematics == "current":
                d = pair.separation[on]
                slope = np.concatenate([np.zeros((m, a)), P.slope[on]], axis=1)
                slope_rows = np.concatenate([np.zeros((m, side.trace.shape[1])), P.slope[on]], axis=1)
                d_xi = jump[:, :, None] * tau[:, None, :] + slope[:, :, None] * d[:, None, :]
                d_xi *= (P.slides[on] / (speed**2 - pair.gap[on] * P.bend[on]))[:, None, None]
                turn = (slope[:, :, None] * n[:, None, :] + P.bend[on][:, None, None] * d_xi) / speed[:, None, None]
                # n turns by -turn about the tangent; p follows through t . n and, off a vertex, through the gap
                lever = -(t * unit).sum(1) + gamma * (d * unit).sum(1)
                block += row_n[:, :, :, None, None] * (lever[:, None, None] * turn)[:, None, None]
                row_t = rows_shape[:, :, None] * unit[:, None, :]
                block -= p[:, None, None, None, None] * row_t[:, :, :, None, None] * turn[:, None, None]
                row_s = slope_rows[:, :, None] * n[:, None, :]
                block -= p[:, None, None, None, None] * row_s[:, :, :, None, None] * d_xi[:, None, None]
            block *= -w[:, None, None, None, None]

        own_rows = np.take_along_axis(side.cell_global[facet], side.trace[facet], axis=1)
        opposite = self.opposite_dofs(pair)[P.nodes[on]] if k else np.zeros((m, 0), dtype=np.int64)
        rows = _scalar(np.concatenate([own_rows, opposite], axis=1))
        columns_index = _scalar(np.concatenate([side.cell_global[facet], opposite], axis=1))
        block = block.reshape(m, rows.shape[1], columns_index.shape[1])
        return (
            np.repeat(rows, columns_index.shape[1], axis=1).ravel(),
            np.tile(columns_index, (1, rows.shape[1])).ravel(),
            block.ravel(),
        )

    @staticmethod
    def opposite_dofs(pair: _Pairing) -> np.ndarray:
        """Global dofs of the opposite curve's nodes."""
        return pair.opposite.curve_dofs

    # ------------------------------------------------------------------ matrix pattern

    def _extend_pattern(self, facets: list[np.ndarray]) -> bool:
        """Widen the ranges of opposite facets in the pattern to hold those now paired; True if any rank had to."""
        grew = False
        for pair, opposite_facet in zip(self.pairings, facets, strict=True):
            if not isinstance(pair.opposite, ContactSide):
                continue
            q = pair.side.weight.shape[1]
            last = pair.opposite.curve.n_facets - 1
            by_facet = opposite_facet.reshape(-1, q)
            low, high = by_facet.min(axis=1, initial=last), by_facet.max(axis=1, initial=0)
            if pair.reach is None:
                pair.reach = np.full((pair.side.curve.n_facets, 2), [last + 1, -1])
                outside = np.ones(len(low), dtype=bool)
            else:
                reach = pair.reach[pair.side.facet]
                outside = (low < reach[:, 0]) | (high > reach[:, 1])
            new = np.full_like(pair.reach, [last + 1, -1])
            new[pair.side.facet[outside], 0] = np.maximum(low[outside] - _PATTERN_MARGIN, 0)
            new[pair.side.facet[outside], 1] = np.minimum(high[outside] + _PATTERN_MARGIN, last)
            changed = bool(outside.any())
            if self.comm.size > 1:
                from mpi4py import MPI

                message = np.stack([new[:, 0], -new[:, 1]])
                self.comm.Allreduce(MPI.IN_PLACE, message, op=MPI.MIN)
                new = np.stack([message[0], -message[1]], axis=1)
                changed = bool((new[:, 1] >= 0).any())
            if changed:
                pair.reach[:, 0] = np.minimum(pair.reach[:, 0], new[:, 0])
                pair.reach[:, 1] = np.maximum(pair.reach[:, 1], new[:, 1])
            grew |= changed
        return grew

    def pattern(self) -> tuple[np.ndarray, np.ndarray]:
        """Block ``(rows, columns)`` in global dofs that the contact may fill, the same on every rank."""
        rows, columns = [], []
        for pair in self.pairings:
            side = pair.side
            own = side.curve_cell_dofs
            trace = side.curve_dofs[side.curve.connectivity]
            rows.append(np.repeat(trace, own.shape[1], axis=1).ravel())
            columns.append(np.tile(own, (1, trace.shape[1])).ravel())
            if not isinstance(pair.opposite, ContactSide):
                continue
            curve, dofs = pair.opposite.curve, pair.opposite.curve_dofs
            count = np.maximum(pair.reach[:, 1] - pair.reach[:, 0] + 1, 0)
            facet = np.repeat(np.arange(len(count)), count)
            other = np.concatenate([np.arange(lo, hi + 1) for lo, hi in pair.reach])
            there = dofs[curve.connectivity[other]]
            for r, c in ((trace[facet], there), (there, own[facet]), (there, there)):
                rows.append(np.repeat(r, c.shape[1], axis=1).ravel())
                columns.append(np.tile(c, (1, r.shape[1])).ravel())
        pairs = np.unique(np.stack([np.concatenate(rows), np.concatenate(columns)]), axis=1)
        return pairs[0], pairs[1]


def _stress_rows(C: Array, gradient: Array, N: Array) -> Array:
    """Derivative ``(m, 2, 2 a)`` of the traction ``sigma N`` with respect to the own cell's nodal displacements."""
    zero = np.zeros(len(N))
    projector = np.stack(
        [np.stack([N[:, 0], zero, N[:, 1]], axis=1), np.stack([zero, N[:, 1], N[:, 0]], axis=1)], axis=1
    )
    PC = projector @ C  # (m, 2, 3)
    gx, gy = gradient[..., 0], gradient[..., 1]
    x = PC[:, :, 0, None] * gx[:, None] + PC[:, :, 2, None] * gy[:, None]
    y = PC[:, :, 1, None] * gy[:, None] + PC[:, :, 2, None] * gx[:, None]
    return np.stack([x, y], axis=-1).reshape(len(N), 2, 2 * gradient.shape[1])


def _scalar(blocks: np.ndarray) -> np.ndarray:
    """Scalar dofs ``(m, 2 k)`` of block dofs ``(m, k)``."""
    return (2 * blocks[:, :, None] + np.arange(2)).reshape(len(blocks), 2 * blocks.shape[1])

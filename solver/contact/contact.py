"""Nitsche contact between two curves that may not match (Chouly, Hild and Renard 2015; theta = 0).

At a point ``x`` of a side, with closest point ``y`` on the opposite curve, ``n`` the opposite's outward normal there
and ``g = (x - y) . n`` the gap, the contact pressure is ``p = [t . n - gamma g]_+`` with ``t = sigma(u) N`` the
traction of the own body, and the virtual work of the contact forces is ``sum over sides of share * integral of p n .
(v(x) - v(y))``.

The unbiased form gives like bodies one half each; of unlike bodies the softer takes more, in proportion to the
compliances (Annavarapu, Hautefeuille and Dolbow 2012), or a stiff pin's ``gamma`` would swamp the other's. The
one-sided form integrates one side only.

``gamma`` is ``gamma_factor`` times the share times the trace constant ``c`` of each contact cell,
``|sigma_n(v)|^2 <= c a(v, v)``. The form is coercive where ``gamma > share c / 4``: Cauchy-Schwarz and ``c`` bound
``share * integral of sigma_n v_n`` by ``sqrt(a(v, v)) * share sqrt(c) |v_n|``, which ``a(v, v) + share gamma |v_n|^2``
exceeds.

Under current kinematics the closest points belong to the deformed curves and the linearisation includes the moving
``n`` and ``y``; under reference kinematics pairs are those of the undeformed curves, with the normal of the first side
(the pin) for both, and the gap is linear in the displacement. A tied contact carries the full vector
``t - gamma [[u]]`` whatever its sign.

Each side's quadrature respects the facets of the opposite curve where the undeformed curves touch
(`contact_segments`), so that meshes that match nowhere pass the patch tests.

Opposite curves may lie on other ranks: their displacement is exchanged, forces on them are summed over the ranks, and
their rows of the matrix travel with PETSc's assembly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from archord.geometry.curve import Array, ProjectionError, RigidCircle
from archord.materials.points import Points
from archord.solver.contact.pair import Kinematics, Pairing
from archord.solver.contact.quadrature import segment_rule
from archord.solver.contact.sparsity import ContactPattern
from archord.solver.contact.surface import ContactSide
from archord.solver.contact.tangent import ContactTangent, pressure_rate

GAMMA_FACTOR = 0.5  # twice the bound of coercivity; larger values stiffen the edge of the contact and cost iterations


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

    ``rigid_motion`` is the displacement of the rigid disc, set before each evaluation; ``slide`` how far pairs are
    expected to slide, for which the matrix gets room from the start. Collective; raises
    `ProjectionError` on every rank if a point on any of them finds no partner.
    """

    def __init__(
        self,
        sides: list[ContactSide],
        *,
        rigid: RigidCircle | None = None,
        kinematics: Kinematics = "current",
        gamma_factor: float = GAMMA_FACTOR,
        one_sided: int | None = None,
        slide: float = 0.0,
    ) -> None:
        self.sides = sides
        self.kinematics, self.gamma_factor = kinematics, gamma_factor
        self.rigid_motion = np.zeros(2)
        self.flips = 0  # points of this rank that opened or closed at the last evaluation
        self.comm = sides[0].comm
        opposites: list = [rigid] if rigid is not None else [sides[1], sides[0]]
        chosen = range(len(sides)) if one_sided is None else [one_sided]
        compliance = np.array([1 / sides[i].material.elastic_tangent[0, 0] for i in chosen])
        self.pairings: list[Pairing] = []
        self._unit_gammas: list[Array] = []  # gamma of each pairing's points for a factor of 1
        failure = None
        for i, share in zip(chosen, compliance / compliance.sum(), strict=True):
            try:
                if rigid is None:
                    sides[i].place_points(*segment_rule(sides[i].curve, sides[1 - i].curve))
                unit = np.repeat(share * sides[i].gamma, sides[i].weight.shape[1])
                self._unit_gammas.append(unit)
                self.pairings.append(Pairing(sides[i], opposites[i], float(share), gamma_factor * unit, kinematics))
            except ProjectionError as error:
                failure = str(error)
        self._raise_together(failure)
        if kinematics == "reference" and rigid is None:
            for pair in self.pairings:
                if pair.side is sides[0]:
                    pair.projection = replace(pair.projection, normal=-pair.side.outward.reshape(-1, 2))
        self._pattern = ContactPattern(self.comm, self.pairings, slide if kinematics == "current" else 0.0)
        self._tangent: ContactTangent | None = None

    def search(self) -> None:
        """Forget where the pairs were: the next evaluation searches them anew, over whole curves."""
        for pair in self.pairings:
            pair.search()

    def use_gamma_factor(self, factor: float) -> None:
        """Another ``gamma_factor`` than that of the contact, for the time being."""
        for pair, unit in zip(self.pairings, self._unit_gammas, strict=True):
            pair.gamma = factor * unit
        self.gamma_factor = factor

    def hold(self) -> None:
        """Keep all points on the facets they were last paired with, until `search`: the forces become smooth."""
        for pair in self.pairings:
            pair.hold()

    def evaluate(self, u: Array) -> bool:
        """Gaps, pressures and trial history at the nodal displacements ``u`` ``(n, 2)`` of this rank.

        Returns whether the matrix pattern had to grow (the pairs slid out of it). Collective; raises `ProjectionError`
        on every rank if a point on any of them finds no partner.
        """
        motions = [pair.opposite_motion(u, self.rigid_motion) for pair in self.pairings]
        failure, self.flips = None, 0
        for pair, motion in zip(self.pairings, motions, strict=True):
            try:
                before = pair.active
                pair.evaluate(u, motion)
                self.flips += int((before != pair.active).sum())
            except ProjectionError as error:
                failure = str(error)
                break
        self._raise_together(failure)
        grew = self.kinematics == "current" and self._pattern.extend()
        if grew:
            self._tangent = None
        return grew

    def anticipate(self, u: Array) -> bool:
        """Open and close the points whose pressure would change its sign with the displacements ``u`` ``(n, 2)``, to
        first order and between the same partners, while a rigid disc stands still; returns whether any does.

        Closed points carry their trial pressure, a tension too, until the next evaluation. Collective.
        """
        flips = 0
        for pair in self.pairings:
            expected = pair.trial + pressure_rate(pair, u, pair.opposite_motion(u))
            active = pair.projection.found & (expected > 0)
            flips += int((active != pair.active).sum())
            pair.press(active)
        return self.comm.allreduce(flips) > 0

    def _raise_together(self, failure: str | None) -> None:
        """Raise `ProjectionError` on every rank if any rank reports a ``failure``, and forget the pairs."""
        failures = [f for f in self.comm.allgather(failure) if f]
        if failures:
            self.search()
            raise ProjectionError(failures[0])

    def round_off(self) -> float:
        """Size of the force that rounding of this rank's contact points leaves: positions times gamma."""
        squares = 0.0
        for pair in self.pairings:
            spring = (pair.share * pair.gamma * pair.side.weight.ravel())[pair.active]
            squares += (spring**2).sum() * np.abs(pair.side.point).max(initial=0.0) ** 2
        return float(2 * np.finfo(float).eps * np.sqrt(squares))

    def add_force(self, force: Array) -> None:
        """Subtract the contact forces of the last evaluation from the residual ``force`` ``(n, 2)`` of owned nodes."""
        on_curve = {id(side): np.zeros((len(side.curve_dofs), 2)) for side in self.sides}
        for pair in self.pairings:
            pair.add_forces(on_curve[id(pair.side)], on_curve.get(id(pair.opposite), np.zeros((1, 2))))
        for side in self.sides:
            side.add_to_owned(side.sum_over_ranks(-on_curve[id(side)]), force)

    @property
    def tangent(self) -> ContactTangent:
        """Derivative of what `add_force` adds; another one whenever the pattern had to grow."""
        if self._tangent is None:
            self._tangent = ContactTangent(self.pairings, self._pattern.reach)
        return self._tangent

    def pattern(self) -> tuple[np.ndarray, np.ndarray]:
        """Block ``(rows, columns)`` in global dofs that the contact may fill, the same on every rank."""
        return self._pattern.entries()

    def resultant(self) -> Array:
        """Contact force ``(2,)`` on the last side (the hole's, if both bodies deform), over all ranks."""
        total = np.zeros(2)
        for pair in self.pairings:
            total += pair.forces.sum(0) * (1 if pair.side is self.sides[-1] else -1)
        return self.sides[0].sum_over_ranks(total)

    def plastic_points(self) -> list[Points]:
        """The points with history of all integrated sides."""
        return [pair.side.points for pair in self.pairings if pair.side.material.yields]

    def commit(self) -> None:
        """Accept the history of the contact points at the last evaluation."""
        for pair in self.pairings:
            pair.side.points.commit()

    def n_active(self) -> int:
        """Number of points in contact, over all ranks."""
        return self.comm.allreduce(sum(int((pair.pressure > 0).sum()) for pair in self.pairings))

    def state(self, side: ContactSide) -> PointState | None:
        """Gap and pressure at the points of ``side``; None if that side is not integrated."""
        for pair in self.pairings:
            if pair.side is side:
                shape, P = side.weight.shape, pair.projection
                return PointState(
                    side.facet,
                    pair.gap.reshape(shape),
                    pair.pressure.reshape(shape),
                    P.normal.reshape(*shape, 2),
                    P.found.reshape(shape),
                )
        return None

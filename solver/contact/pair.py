"""One integrated surface against its opposite: pairs, gaps and tractions at its points."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from archord.geometry.basis import Array
from archord.materials.material import Points
from archord.solver.contact.law import ContactLaw
from archord.solver.contact.surface import RigidSurface, Surface

Start = Literal["anywhere", "near", "held"]


class Pair:
    """The points of ``surface`` (``m`` on this rank) against ``opposite``; arrays are those of the
    last evaluation.

    ``share`` of the contact's virtual work is integrated here. Unless the pair ``moves``, points
    keep the partners of the undeformed surfaces. Tractions are in the frame of the ``law``. Raises
    `ProjectionError`.

    ``projection`` are the partners, ``separation`` is ``x - y`` ``(m, 2)``, ``frame`` ``(m, 2, 2)``
    normal and tangent and ``opening`` ``(m, 2)`` gap and slip; ``strayed`` ``(m, 2)`` is how far
    points that rub moved along the normal in the step, and how much the opposite's part in the slip
    grows along its facet; ``stress_vector`` ``(m, 2)`` and ``moduli`` ``(m, 2, 4)`` are those of
    the own material, ``trial``, ``traction`` ``(m, 2)`` and ``derivative`` ``(m, 2, 2)`` those of
    the law; ``active`` ``(m,)`` points touch, ``sticks`` those that also stick, and ``changes``
    went over. ``offset`` is added to the gap. The next evaluation searches partners from ``start``
    on: anywhere, near the last ones, or, until it is set again, on their facets.
    """

    def __init__(
        self,
        surface: Surface,
        opposite: Surface | RigidSurface,
        law: ContactLaw,
        share: float,
        *,
        moves: bool,
    ) -> None:
        self.surface, self.opposite, self.law, self.share, self.moves = (
            surface,
            opposite,
            law,
            share,
            moves,
        )
        x, self._outward = surface.point.reshape(-1, 2), surface.outward.reshape(-1, 2)
        self.projection = opposite.curve.closest_point(
            x, self._outward, np.zeros_like(opposite.curve.X)
        )
        self.separation = x - self.projection.point
        self.points = Points(law, len(x))
        self.traction: Array = np.zeros((len(x), 2))
        self._branch: Array = np.zeros(len(x))
        self.active, self.sticks = np.zeros((2, len(x)), dtype=bool)
        self.start: Start = "anywhere"
        self.offset = 0.0
        self._begun: tuple[Array, Array] = np.zeros((len(x), 2)), np.zeros_like(opposite.curve.X)
        self._touched_down: tuple[Array, Array] = self._begun
        self._touched = self.active
        self.strayed: Array = np.zeros((len(x), 2))

    def use_gamma(self, factor: float) -> None:
        """Nitsche's gamma ``(m, 2)``, of gap and slip, is ``factor`` times the share and the trace
        constants of the point's cell."""
        each = np.stack([self.surface.gamma, self.surface.gamma_shear], axis=1)
        self.gamma = factor * self.share * np.repeat(each, self.surface.weight.shape[1], axis=0)

    def use_own_normals(self) -> None:
        """Measure the gap along this surface's normals, reversed, for good."""
        self.projection = replace(self.projection, normal=-self._outward)

    def evaluate(self, u: Array, motion: Array) -> None:
        """Evaluate at ``u`` ``(n, 2)``, with the opposite's nodes moved by ``motion``; raises
        `ProjectionError`."""
        displacement, stress_vector, moduli = self.surface.deform(u)
        self._moved = displacement, motion
        self.stress_vector, self.moduli = (
            np.ascontiguousarray(stress_vector),
            np.ascontiguousarray(moduli),
        )
        if self.moves:
            x, curve, facet = (
                self.surface.point.reshape(-1, 2) + displacement,
                self.opposite.curve,
                self.projection.facet,
            )
            if self.start == "held":
                self.projection = curve.continued(x, self._outward, motion, facet)
            else:
                known = None if self.start == "anywhere" else facet
                self.projection, self.start = (
                    curve.closest_point(x, self._outward, motion, known),
                    "near",
                )
            self.separation = x - self.projection.point
        n = self.projection.normal
        self.frame = np.stack([n[:, 0], n[:, 1], -n[:, 1], n[:, 0]], axis=1).reshape(-1, 2, 2)
        self.opening = self._in_frame(
            self.separation if self.moves else self._relative(displacement, motion)
        )
        self.opening[:, 0] += self.offset
        if self.law.slides and not self.moves:
            self.opening[:, 0] += (self.separation * n).sum(1)
        if self.law.has_friction:
            own, nodes = self._moved_in_step(displacement, motion)
            P = self.projection
            rise, slip = self._in_frame(own - np.einsum("ma,mai->mi", P.shape, nodes)).T
            self.opening[:, 1] = slip
            drift = self._in_frame(np.einsum("ma,mai->mi", P.slope, nodes))[:, 1]
            self.strayed = np.stack([rise, drift], axis=1)
        self.trial = self._in_frame(self.stress_vector) - self.gamma * self.opening
        if self.law.has_friction:  # what has no partner has no history
            self.trial[~self.projection.found, 0] = -1.0
        self.traction = self._answer(self.trial)

    def begin(self, u: Array, motion: Array) -> None:
        """Count the slip of laws that rub from ``u`` and ``motion`` on, as `evaluate` takes
        them."""
        self._begun = self.surface.displacement(u), motion
        self._touched_down = self._begun
        self._touched = self.active.copy()

    def touch_down(self, u: Array, motion: Array) -> None:
        """Count the slip of points that did not touch when the step began from ``u`` and ``motion``
        on instead."""
        self._touched_down = self.surface.displacement(u), motion

    def _moved_in_step(self, displacement: Array, motion: Array) -> tuple[Array, Array]:
        """How far points ``(m, 2)`` and the nodes of their partners ``(m, k, 2)`` have moved since
        slip counts."""
        nodes, new = self.projection.nodes, ~self._touched
        own, before = self._begun
        own_down, down = self._touched_down
        return (
            displacement - np.where(new[:, None], own_down, own),
            motion[nodes] - np.where(new[:, None, None], down[nodes], before[nodes]),
        )

    def _in_frame(self, vectors: Array) -> Array:
        """Components ``(m, 2)`` along normal and tangent."""
        return np.einsum("mij,mj->mi", self.frame, vectors)

    def _relative(self, own: Array, motion: Array) -> Array:
        """What the points ``own`` ``(m, 2)`` and their partners have moved apart ``(m, 2)``."""
        P = self.projection
        return own - np.einsum("ma,mai->mi", P.shape, motion[P.nodes])

    def _answer(self, trial: Array) -> Array:
        """Traction of the law, none at points without a partner; its derivative and the active
        points are kept."""
        traction, self.derivative = self.points.update(*self.opening.T, trial, self.gamma)
        lone = ~self.projection.found
        if lone.any():
            traction = np.where(lone[:, None], 0.0, traction)
            self.derivative = np.where(lone[:, None, None], 0.0, self.derivative)
        before, D = self._branch, self.derivative
        self._branch = D[:, 0, 0] + 2 * D[:, 1, 1] + 4 * np.sign(D[:, 1, 0])
        self.active, self.sticks = D[:, 0, 0] != 0, D[:, 1, 1] != 0
        self.changes = int((before != self._branch).sum())
        return traction

    def expect(self, rate: Array) -> None:
        """Go over to the law's branch with ``rate`` ``(m, 2)`` added to the trial, continued to the
        present one."""
        self.traction = self._answer(self.trial + rate) - np.einsum(
            "mij,mj->mi", self.derivative, rate
        )

    @property
    def distance(self) -> Array:
        """Distance ``(n, q)`` of the points of this rank's facets from their partners, positive
        when open."""
        closed = 0.0 if self.law.slides else (self.separation * self.projection.normal).sum(1)
        return (self.opening[:, 0] + closed).reshape(self.surface.weight.shape)

    @property
    def slip(self) -> Array:
        """Displacement ``(n, q)`` of the points relative to the opposite surface, along the tangent
        of the frame."""
        return (
            (self.frame[:, 1] * self._relative(*self._moved))
            .sum(axis=1)
            .reshape(self.surface.weight.shape)
        )

    @property
    def place(self) -> Array:
        """Where the points' forces act ``(m, 2)``: on the deformed surface, if they move."""
        return self.surface.point.reshape(-1, 2) + self._moved[0] * self.moves

    @property
    def pressure(self) -> Array:
        """Pressure ``(n, q)`` at the points of this rank's facets."""
        return self.traction[:, 0].reshape(self.surface.weight.shape)

    @property
    def shear(self) -> Array:
        """Shear ``(n, q)`` on the own surface, positive along the tangent of the frame."""
        return self.traction[:, 1].reshape(self.surface.weight.shape)

    def dissipated(self) -> float:
        """Energy that the law dissipated on this rank so far."""
        return float(
            (
                self.share
                * self.surface.weight.ravel()
                * self.points.material.dissipation(self.points.trial)
            ).sum()
        )

    @property
    def forces(self) -> Array:
        """Weighted contact force ``(m, 2)`` of each point on its own body."""
        weighted = self.share * self.surface.weight.reshape(-1, 1) * self.traction
        return np.einsum("mij,mi->mj", self.frame, weighted)

    def add_forces(self, own: Array, opposite: Array) -> None:
        """Add the forces on the nodes of the own surface to ``own`` ``(nodes, 2)``, their reactions
        to ``opposite``."""
        surface, P, forces = self.surface, self.projection, self.forces
        on_facets = surface.trace_shape.swapaxes(1, 2) @ forces.reshape(*surface.weight.shape, 2)
        nodes = surface.curve.connectivity[surface.facet]
        for i in range(2):
            own[:, i] += np.bincount(nodes.ravel(), on_facets[..., i].ravel(), len(own))
            opposite[:, i] -= np.bincount(
                P.nodes.ravel(), (P.shape * forces[:, i, None]).ravel(), len(opposite)
            )

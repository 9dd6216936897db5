"""One integrated surface against its opposite: pairs, gaps and contact tractions at its
points."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import NONE
from archord.materials.material import Points
from archord.solver.contact.frame import TurningFrames, frames_at_rest, plane_frames
from archord.solver.contact.laws.law import OPEN, STICK, Branches, ContactLaw
from archord.solver.contact.slip import SlipOrigin
from archord.solver.contact.surface import RigidSurface, Surface

Start = Literal["anywhere", "near", "held"]


class Answers(NamedTuple):
    """The law's answers at ``m`` points, on which the tangent depends linearly (see `Pair`)."""

    active: np.ndarray  # (m,)
    traction: Array  # (m, d)
    by_trial: Array  # (m, d, d)
    by_opening: Array | None  # (m, d, d)


class Pair:
    """The ``m`` points of ``surface`` on this rank against ``opposite``, with a contact ``law``.

    ``share`` of the contact's virtual work is integrated here. Unless the pair ``moves``, points
    keep the partners of the undeformed surfaces. ``offset`` is added to the gap. The next
    evaluation searches partners from ``start`` on: anywhere, near the last ones, or, until it is
    set again, on their facets. Raises `ProjectionError`.

    Arrays, of the last evaluation, in the order in which they come to be; ``d`` is the number of
    components of a displacement; the frame's normal is first:

    gamma : (m, d) Nitsche's stiffness of gap and slip, of the slips along both tangents in space
    stress_vector : (m, d) force of the own body's stress per area
    moduli : (m, d, g) its derivative by the displacement gradient
    projection : the partners
    separation : (m, d) from the partner to the point
    frame : (m, d, d) normal and tangents of the opposite surface
    spin : (m, 2) of frames in space, see `TurningFrames`
    opening : (m, d) gap and slip
    strayed : (m, 1 + (d - 1)^2) motion of the step along the normal, and growth of the opposite's
        part of the slips along each coordinate of its facet; zero unless slip is counted
    trial : (m, d) Nitsche's traction of points that touch and stick
    traction : (m, d) answer of the law
    by_trial, by_opening : (m, d, d) derivatives of the traction; the second is None without
    branch : (m,) branch of the law
    active : (m,) whether points carry anything
    n_passing : number of points that lost or found a partner, as they pass the end of a surface
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
        self.surface = surface
        self.opposite = opposite
        self.law = law
        self.share = share
        self.moves = moves
        self.follows = True  # see `Contact.follow`
        self.counts_slip = law.counts_slip or law.has_friction
        self.start: Start = "anywhere"
        self.offset = 0.0
        self.dt = 0.0

        x = _flat(surface.point)
        at_rest = np.zeros_like(opposite.curve.X)
        self._outward = _flat(surface.outward)
        self._at_rest = frames_at_rest(-self._outward) if surface.in_space else None
        nothing = np.full(len(x), NONE)
        self.projection = opposite.curve.closest_point(x, self._outward, at_rest, faced=nothing)
        self._faced = np.where(self.projection.found, self.projection.facet, NONE)
        self.separation = x - self.projection.point
        self.points = Points(law, len(x))
        n_tangents = x.shape[1] - 1
        self.strayed: Array = np.zeros((len(x), 1 + n_tangents**2))
        self.traction: Array = np.zeros_like(x)
        self.branch: Branches = np.full(len(x), OPEN)
        self.active: np.ndarray = np.zeros(len(x), dtype=bool)
        self.changes = 0  # points on another branch than in the evaluation before
        self.n_passing = 0
        self._origin = SlipOrigin(np.zeros_like(x), at_rest, self.active)

    def use_gamma(self, factor: float) -> None:
        """Let Nitsche's gamma be ``factor`` times the share and the trace constants of the point's
        cell."""
        surface = self.surface
        n_tangents = self.traction.shape[1] - 1
        of_facets = np.stack([surface.gamma, *[surface.gamma_shear] * n_tangents], axis=1)
        points_per_facet = surface.weight.shape[1]
        self.gamma = factor * self.share * np.repeat(of_facets, points_per_facet, axis=0)

    def stiffening(self) -> float:
        """How many times as stiff as its elastic tangent, of which gamma is made, the own body is
        along the normal: the largest of this rank's points that carry their trial pressure, 0
        without any."""
        carry = self.active & (self.by_trial[:, 0, 0] != 0)
        if not carry.any():
            return 0.0
        surface = self.surface
        n = self._outward[carry]
        by_axis = np.column_stack([n, np.zeros(len(n))])  # none of what is over the radius
        along = n[:, surface.terms[:, 0]] * by_axis[:, surface.terms[:, 1]]
        stiffness = np.einsum("mi,mig,mg->m", n, self.moduli[carry], along)
        cut = np.einsum("mi,mik->mk", n, surface.kinematics.traction(n))
        elastic = np.einsum("mk,kl,ml->m", cut, surface.material.elastic_tangent, cut)
        return float((stiffness / elastic).max())

    def use_own_normals(self) -> None:
        """Measure the gap along this surface's normals, reversed, for good."""
        self.projection = replace(self.projection, normal=-self._outward)

    def begin(self, u: Array, motion: Array) -> None:
        """Count slip from ``u`` and ``motion`` on, as `evaluate` takes them."""
        self._origin = SlipOrigin(self.surface.displacement(u), motion, self.active)

    def touch_down(self, u: Array, motion: Array) -> None:
        """Count the slip of points that did not touch when the step began from ``u`` and ``motion``
        on instead."""
        self._origin.touch_down(self.surface.displacement(u), motion)

    def evaluate(self, u: Array, motion: Array, dt: float) -> None:
        """Evaluate at ``u`` ``(n, d)``, with the opposite's nodes moved by ``motion``, in a step of
        the length ``dt``; raises `ProjectionError`."""
        own = self.surface.deform(u)
        self.dt = dt
        self._moved = own.displacement, motion
        self.stress_vector = own.stress_vector
        self.moduli = own.moduli
        if self.moves:
            self._find_partners(own.displacement, motion)
        self._turn_frames()
        self.opening = self._opening()
        self.trial = self._in_frame(self.stress_vector) - self.gamma * self.opening
        if self.counts_slip:  # what has no partner is open, and its history ends
            lost = ~self.projection.found
            self.opening[lost, 0] = np.linalg.norm(self.separation[lost], axis=1)
            self.trial[lost, 0] = -1.0 - self.gamma[lost, 0] * self.opening[lost, 0]
        self._answer(self.opening, self.trial)
        self._evaluated = self.answers()

    def answers(self) -> Answers:
        """The law's answers, which `expect` may have changed since the last evaluation."""
        return Answers(self.active, self.traction, self.by_trial, self.by_opening)

    def changes_of_answers(self) -> Answers:
        """By how much, ``active`` where they have."""
        before = self._evaluated
        by_trial = self.by_trial - before.by_trial
        has_changed = by_trial.any(axis=(1, 2)) | (self.active != before.active)
        by_opening = None
        if self.by_opening is not None and before.by_opening is not None:
            by_opening = self.by_opening - before.by_opening
            has_changed |= by_opening.any(axis=(1, 2))
        return Answers(has_changed, self.traction - before.traction, by_trial, by_opening)

    def _turn_frames(self) -> None:
        """The frames at the normals of the partners."""
        normal = self.projection.normal
        if self._at_rest is None:
            self.frame = plane_frames(normal)
            return
        is_found = self.projection.found[:, None]
        turned = TurningFrames(self._at_rest, np.where(is_found, normal, -self._outward))
        self.frame = turned.frame
        self.spin = turned.spin

    def _find_partners(self, displacement: Array, motion: Array) -> None:
        """The closest points of the deformed surfaces.

        A body that bulges over the border that it was drawn along keeps its partners; a point
        that was drawn beyond the border has none there.
        """
        x = _flat(self.surface.point) + displacement
        curve = self.opposite.curve
        last = self.projection.facet
        had_partner = self.projection.found
        if self.start == "held":
            self.projection = curve.continued(x, self._outward, motion, last)
            self.projection.found[:] &= had_partner
        else:
            near = None if self.start == "anywhere" else last
            self.projection = curve.closest_point(x, self._outward, motion, near, self._faced)
            self.start = "near"
        self.n_passing = int((self.projection.found != had_partner).sum())
        self.separation = x - self.projection.point

    def _opening(self) -> Array:
        """Gap and slip ``(m, d)``; how far points `strayed` is kept."""
        apart = self.separation if self.moves else self._moved_apart()
        opening = self._in_frame(apart)
        opening[:, 0] += self.offset
        if self.law.slides and not self.moves:
            opening[:, 0] += self._undeformed_gap()
        if self.counts_slip:
            partners = self.projection
            own, nodes = self._origin.moved(*self._moved, partners)
            of_step = own - np.einsum("ma,mai->mi", partners.shape, nodes)
            moved = self._in_frame(of_step)
            opening[:, 1:] = moved[:, 1:]
            drifts = [
                self._in_frame(np.einsum("ma,mai->mi", slope, nodes))[:, 1:]
                for slope in partners.slopes
            ]
            self.strayed = np.concatenate([moved[:, :1], *drifts], axis=1)
        return opening

    def _in_frame(self, vectors: Array) -> Array:
        """Components ``(m, d)`` along normal and tangents."""
        return np.einsum("mij,mj->mi", self.frame, vectors)

    def _moved_apart(self) -> Array:
        """Displacement ``(m, d)`` of the points relative to their partners."""
        own, motion = self._moved
        partners = self.projection
        return own - np.einsum("ma,mai->mi", partners.shape, motion[partners.nodes])

    def _undeformed_gap(self) -> Array:
        """Gap ``(m,)`` of the undeformed surfaces, of a pair that does not move."""
        return (self.separation * self.projection.normal).sum(1)

    def false_gap(self) -> float:
        """By how much gaps that points of this rank carry pressure at differ from the gaps of the
        deformed surfaces, at most: of a pair that does not move."""
        own, motion = self._moved
        x = _flat(self.surface.point) + own
        now = self.opposite.curve.continued(x, self._outward, motion, self.projection.facet)
        gap = ((x - now.point) * now.normal).sum(axis=1) + self.offset
        apart = np.where(self.active & now.found, gap - self.opening[:, 0], 0.0)
        return float(np.abs(apart).max(initial=0.0))

    def _answer(self, opening: Array, trial: Array) -> None:
        """Let the law answer, which may write into what it gets; points without a partner carry
        nothing."""
        points = self.points
        own = (array.copy() for array in (opening, trial, self.gamma))
        response = points.acting.respond(*own, points.given(), self.dt)
        with_partner = self.projection.found
        points.trial = response.state
        if not self.counts_slip:  # what has no partner keeps its history
            points.trial = _kept(points.state, with_partner, response.state)
        self.traction = _where(with_partner, response.traction)
        self.by_trial = _where(with_partner, response.by_trial)
        self.by_opening = None
        if response.by_opening is not None:
            self.by_opening = _where(with_partner, response.by_opening)
        branch = np.where(with_partner, response.branch, OPEN)
        self.changes = int((branch != self.branch).sum())
        self.branch = branch
        self.active = branch != OPEN

    def expect(self, trial_rate: Array, opening_rate: Array) -> None:
        """Go over to the law's branch with these rates ``(m, d)`` added to trial and opening; the
        traction is continued to the present ones."""
        self._answer(self.opening + opening_rate, self.trial + trial_rate)
        change = np.einsum("mij,mj->mi", self.by_trial, trial_rate)
        if self.by_opening is not None:
            change += np.einsum("mij,mj->mi", self.by_opening, opening_rate)
        self.traction = self.traction - change

    @property
    def sticks(self) -> np.ndarray:
        """Whether points ``(m,)`` stick."""
        return self.branch == STICK

    @property
    def distance(self) -> Array:
        """Distance ``(n, q)`` of the points of this rank's facets from their partners, positive
        when open; of points without a partner from the closest point of the opposite surface."""
        closed = 0.0 if self.law.slides else self._undeformed_gap()
        to_partner = self.opening[:, 0] + closed
        away = np.linalg.norm(self.separation, axis=1)
        return self._by_facets(np.where(self.projection.found, to_partner, away))

    @property
    def slip(self) -> Array:
        """Displacement ``(n, q)`` of the points relative to the opposite surface, along the tangent
        of the frame; its size in space. Zero without a partner."""
        return self._by_facets(_along_surface(list(self._slips().T)))

    @property
    def slips(self) -> Array:
        """The same ``(n, q, d)`` as vectors."""
        return self._on_surface(np.insert(self._slips(), 0, 0.0, axis=1))

    def _slips(self) -> Array:
        """Components ``(m, d - 1)`` along the tangents of the frame."""
        slips = self._in_frame(self._moved_apart())[:, 1:]
        return np.where(self.projection.found[:, None], slips, 0.0)

    @property
    def pressure(self) -> Array:
        """Pressure ``(n, q)`` at the points of this rank's facets."""
        return self._by_facets(self.traction[:, 0])

    @property
    def shear(self) -> Array:
        """Shear ``(n, q)`` on the own surface, positive along the tangent of the frame; its size in
        space."""
        return self._by_facets(_along_surface(list(self.traction[:, 1:].T)))

    @property
    def shears(self) -> Array:
        """The same ``(n, q, d)`` as vectors."""
        return self._on_surface(self.traction)

    @property
    def tractions(self) -> Array:
        """Contact force ``(n, q, d)`` on the own body per undeformed area."""
        vectors = np.einsum("mki,mk->mi", self.frame, self.traction)
        return vectors.reshape(self.surface.point.shape)

    def _on_surface(self, components: Array) -> Array:
        """The part ``(n, q, d)`` along the tangents of vectors with these ``components``
        ``(m, d)``."""
        vectors = np.einsum("mki,mk->mi", self.frame[:, 1:], components[:, 1:])
        return vectors.reshape(self.surface.point.shape)

    def _by_facets(self, values: Array) -> Array:
        """Values ``(m,)`` of the points as those ``(n, q)`` of facets."""
        return values.reshape(self.surface.weight.shape)

    def place(self, *, on_opposite: bool, deformed: bool) -> Array:
        """Where the points' forces act ``(m, d)``: on the own surface, or their reactions on the
        opposite one; where this is now, or, as forces at small strain do, where it was."""
        own, motion = self._moved
        partners = self.projection
        if not on_opposite:
            return _flat(self.surface.point) + own * deformed
        nodes = self.opposite.curve.X + motion * deformed
        return np.einsum("ma,mai->mi", partners.shape, nodes[partners.nodes])

    @property
    def weight(self) -> Array:
        """Weights ``(m,)`` of the points; the pair integrates its share of them."""
        return self.share * self.surface.weight.ravel()

    def integral(self, density: Array | float) -> float:
        """This rank's part of the integral of a ``density`` ``(m,)`` over the surface, times the
        share."""
        return float((self.weight * density).sum())

    def stored(self) -> float:
        """This rank's part of the energy that the law stores at points that touch."""
        density = self.law.stored(self.opening.copy(), self.points.told())
        return self.integral(np.where(self.active, density, 0.0))

    @property
    def forces(self) -> Array:
        """Weighted contact force ``(m, d)`` of each point on its own body."""
        weighted = self.weight[:, None] * self.traction
        return np.einsum("mij,mi->mj", self.frame, weighted)

    def add_forces(self, own: Array, opposite: Array) -> None:
        """Add the forces on the nodes of the own surface to ``own`` ``(nodes, d)``, their reactions
        to ``opposite``."""
        surface = self.surface
        partners = self.projection
        forces = self.forces
        on_facets = surface.trace_shape.swapaxes(1, 2) @ forces.reshape(surface.point.shape)
        own_nodes = surface.curve.connectivity[surface.facet].ravel()
        opposite_nodes = partners.nodes.ravel()
        for i in range(forces.shape[1]):
            action = on_facets[..., i].ravel()
            reaction = (partners.shape * forces[:, i, None]).ravel()
            own[:, i] += np.bincount(own_nodes, action, len(own))
            opposite[:, i] -= np.bincount(opposite_nodes, reaction, len(opposite))


def _kept(old: Any, chosen: np.ndarray, new: Any) -> Any:
    """The ``new`` state of ``chosen`` points ``(m,)``, the ``old`` one of the others."""
    if new is None or chosen.all():
        return new
    kept = copy(new)
    for name, values in vars(new).items():
        vars(kept)[name] = np.where(chosen, np.transpose(values), vars(old)[name].T).T
    return kept


def _where(chosen: np.ndarray, values: Array) -> Array:
    """The ``values`` ``(m, ...)`` of ``chosen`` points ``(m,)``, zero at the others, in contiguous
    memory of float64."""
    if not chosen.all():
        shape = len(chosen), *(1 for _ in values.shape[1:])
        values = np.where(chosen.reshape(shape), values, 0.0)
    return np.ascontiguousarray(values, dtype=float)


def _flat(at_facets: Array) -> Array:
    """Vectors ``(n, q, d)`` at points of facets as those ``(m, d)`` of points."""
    return at_facets.reshape(-1, at_facets.shape[-1])


def _along_surface(components: list[Array]) -> Array:
    """The one component ``(m,)`` along a curve, or the size of two along a surface in space."""
    return components[0] if len(components) == 1 else np.hypot(*components)

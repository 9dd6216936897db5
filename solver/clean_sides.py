"""Which side carries a contact whose surfaces have other loads, too.

Nitsche's method takes the stress of a body at its surface for the contact traction. Where supports,
couplings or loads act on the same facets, that stress is theirs, too, and gaps are wrong by their
traction over gamma. The other side, on which nothing else acts, carries the contact exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from archord.materials.kinematics import Bools, Ints
from archord.solver.contact.interaction import Interaction
from archord.solver.contact.laws.named import contact_law
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.problem import Problem

# times its own gamma, as if both sides were integrated: with less, loose bodies that friction
# holds converge badly
_WITH_FRICTION = 2
_ALONG = 1e-6  # component of a normal from which on a held axis is not along the surface
_INTO = 0.1  # of a facet: how deep surfaces may be drawn into each other


class CleanSides:
    """What acts on facets of ``problem`` in its displacement space ``V`` besides contact.

    held : (n_local, d) whether the displacement of a node is prescribed
    spread : nodes (n,) of each set of facets along which a load is spread
    fault : an interaction without a side on which nothing else acts, "" if there is none
    """

    def __init__(self, problem: Problem, V: fem.FunctionSpace) -> None:
        nodes_of = {}
        spread = {load.facets for load in problem.loads if load.facets}
        spread |= {mean.facets for mean in problem.means}
        # sorted, as finding nodes is collective
        for name in sorted(spread | {support.facets for support in problem.supports}):
            nodes_of[name] = problem.mesh.dofs_in(V, name)
        index_map = V.dofmap.index_map
        n_local = index_map.size_local + index_map.num_ghosts
        self.comm = V.mesh.comm
        self.fault = ""
        self.held = np.zeros((n_local, problem.kinematics.dimension), dtype=bool)
        for support in problem.supports:
            self.held[nodes_of[support.facets], support.axis] = True
        self.spread = [nodes_of[name] for name in sorted(spread)]

    def integrated(
        self, interaction: Interaction, surfaces: Sequence[Surface | RigidSurface]
    ) -> Interaction:
        """The ``interaction`` of the ``surfaces``, integrated on one side alone where something
        acts on the other; as it is where no side is left, which is a fault. Collective."""
        law = contact_law(interaction.law, interaction.friction)
        slips = law.slides and not law.has_friction
        of_bodies = {
            name: surface
            for name, surface in zip(interaction.surfaces, surfaces, strict=True)
            if isinstance(surface, Surface)
        }
        held = [self._held_along(surface) for surface in of_bodies.values()]
        # what both sides are held along has no slip
        alike = np.logical_and.reduce(held) if len(held) > 1 else np.ones_like(held[0])
        along = np.zeros_like(alike) if slips else ~alike
        pairs = zip(interaction.surfaces, surfaces, reversed(surfaces), strict=True)
        laden = [
            name
            for name, surface, opposite in pairs
            if isinstance(surface, Surface) and self._acts(surface, opposite, along)
        ]
        if not laden or interaction.integrated in {*of_bodies} - {*laden}:
            return interaction
        clean = [name for name in of_bodies if name not in laden]
        if clean and not interaction.integrated:
            stiffer = _WITH_FRICTION if law.has_friction else 1
            gamma_factor = stiffer * interaction.gamma_factor
            return replace(interaction, integrated=clean[0], gamma_factor=gamma_factor)
        cure = f"give integrated = {clean[0]!r}" if clean else "leave them out of one of the sets"
        self.fault = (
            f"supports, couplings or loads act on facets of {' and '.join(map(repr, laden))}, too, "
            f"so that the stress there is not the contact's of {interaction.name!r}: {cure}"
        )
        return interaction

    def _held_along(self, surface: Surface) -> Bools:
        """The axes ``(d,)`` along which any facet of a ``surface`` is held. Collective."""
        found = np.atleast_1d(self._held_facets(surface).any(axis=0))
        self.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.LOR)
        return found

    def _held_facets(self, surface: Surface) -> Bools:
        """Whether all nodes of a facet are held along an axis ``(n, d)``."""
        return np.all(self.held[_nodes(surface)], axis=1)

    def _acts(self, surface: Surface, opposite: Surface | RigidSurface, along: Bools) -> bool:
        """Whether anything acts across facets of a ``surface`` that may meet the ``opposite`` one,
        or holds them ``along`` an axis ``(d,)``. Collective."""
        nodes = _nodes(surface)
        across = np.abs(surface.outward).max(axis=1) > _ALONG
        acts = (self._held_facets(surface) & (across | along)).any(axis=1)
        for spread in self.spread:
            acts |= np.isin(nodes, spread).all(axis=1)
        if isinstance(opposite, Surface):
            acts &= _beside(surface, opposite)
        else:
            acts &= _faces(surface, opposite)
        return self.comm.allreduce(bool(acts.any()), op=MPI.LOR)


def _nodes(surface: Surface) -> Ints:
    """The nodes ``(n, k)`` of this rank's facets of a ``surface``."""
    return np.take_along_axis(surface.cell_dofs, surface.trace, axis=1)


def _beside(surface: Surface, opposite: Surface) -> Bools:
    """Which of this rank's facets ``(n,)`` of a ``surface`` are in the box around the ``opposite``
    one, grown by a facet and by how far the boxes of both are apart, and face the box."""
    own = surface.curve.X
    other = opposite.curve.X
    low = other.min(axis=0)
    high = other.max(axis=0)
    apart = np.maximum(low - own.max(axis=0), own.min(axis=0) - high)
    facet = surface.facet_lengths().max()
    margin = np.maximum(apart, 0.0) + facet
    is_in = (surface.point >= low - margin) & (surface.point <= high + margin)
    farthest = np.where(surface.outward > 0, high, low)
    ahead = ((farthest - surface.point) * surface.outward).sum(axis=2)
    faces = ahead > -_INTO * facet
    return (is_in.all(axis=2) & faces).any(axis=1)


def _faces(surface: Surface, disc: RigidSurface) -> Bools:
    """Which of this rank's facets ``(n,)`` of a ``surface`` face the centre of a ``disc``, or the
    axis of a cylinder."""
    to_centre = disc.curve.centre - surface.point
    axis = disc.curve.axis
    if axis is not None:
        to_centre -= (to_centre @ axis)[..., None] * axis
    return ((to_centre * surface.outward).sum(axis=2) > 0).any(axis=1)

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

from archord.solver.contact.interaction import Interaction
from archord.solver.contact.laws.named import contact_law
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.problem import Problem

_ALONG = 1e-6  # component of a normal from which on a held axis is not along the surface


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
        self.held = np.zeros((n_local, problem.kinematics.dimension), dtype=bool)
        for support in problem.supports:
            self.held[nodes_of[support.facets], support.axis] = True
        self.fault = ""
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
        laden = [name for name, surface in of_bodies.items() if self._acts(surface, along)]
        if not laden or interaction.integrated in {*of_bodies} - {*laden}:
            return interaction
        clean = [name for name in of_bodies if name not in laden]
        if clean and not interaction.integrated:
            return replace(interaction, integrated=clean[0])
        cure = f"give integrated = {clean[0]!r}" if clean else "leave them out of one of the sets"
        self.fault = (
            f"supports, couplings or loads act on facets of {' and '.join(map(repr, laden))}, too, "
            f"so that the stress there is not the contact's of {interaction.name!r}: {cure}"
        )
        return interaction

    def _held_along(self, surface: Surface) -> np.ndarray:
        """The axes ``(d,)`` along which any facet of a ``surface`` is held. Collective."""
        found: np.ndarray = self.comm.allreduce(self._held_facets(surface).any(axis=0), op=MPI.LOR)
        return found

    def _held_facets(self, surface: Surface) -> np.ndarray:
        """Whether all nodes of a facet are held along an axis ``(n, d)``."""
        return self.held[_nodes(surface)].all(axis=1)

    def _acts(self, surface: Surface, along: np.ndarray) -> bool:
        """Whether anything acts across a ``surface``, or holds it ``along`` an axis ``(d,)``.
        Collective."""
        across = np.abs(surface.outward).max(axis=1) > _ALONG
        nodes = _nodes(surface)
        acts = bool((self._held_facets(surface) & (across | along)).any())
        acts |= any(np.isin(nodes, spread).all(axis=1).any() for spread in self.spread)
        return self.comm.allreduce(acts, op=MPI.LOR)


def _nodes(surface: Surface) -> np.ndarray:
    """The nodes ``(n, k)`` of this rank's facets of a ``surface``."""
    return np.take_along_axis(surface.cell_dofs, surface.trace, axis=1)

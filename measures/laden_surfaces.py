"""Contact surfaces on which something else acts, too.

Nitsche's method takes the stress of a body at its surface for the contact traction. Where supports,
couplings or loads act on the same facets, that stress is theirs, too, and gaps are wrong by their
traction over gamma. The other side, on which nothing else acts, carries the contact exactly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from archord.solver.contact.surface import RigidSurface, Surface

if TYPE_CHECKING:
    from archord.solver.contact.interaction import Interface
    from archord.solver.path.system import System

_ALONG = 1e-6  # component of a normal from which on a held axis is not along the surface


def laden_surfaces(system: System) -> list[str]:
    """Warnings of interactions that are integrated on a surface on which something else acts.
    Collective."""
    acting = _Acting(system)
    warnings = []
    for interface in system.contact.interfaces:
        laden = acting.laden(interface)
        integrated = {pair.surface.name for pair in interface.pairs}
        if not integrated & {*laden}:
            continue
        part = interface.interaction
        deformable = [one.name for one in interface.surfaces if isinstance(one, Surface)]
        clean = [name for name in deformable if name not in laden]
        cure = f"give integrated = {clean[0]!r}" if clean else "leave them out of one of the sets"
        warnings.append(
            f"supports, couplings or loads act on facets of {' and '.join(map(repr, laden))}, too, "
            f"and {part.name!r} takes their traction for its own: gaps are wrong by a part of what "
            f"an element there gives way; {cure}"
        )
    return warnings


class _Acting:
    """What acts on facets of a problem besides contact.

    held : (n_local, d) whether the displacement of a node is prescribed
    spread : nodes (n,) of each set of facets along which a load is spread
    """

    def __init__(self, system: System) -> None:
        problem = system.problem
        space = system.V
        index_map = space.dofmap.index_map
        n_local = index_map.size_local + index_map.num_ghosts
        self.comm = system.comm
        self.held = np.zeros((n_local, problem.kinematics.dimension), dtype=bool)
        # finding nodes is collective: in one order on all ranks
        for support in problem.supports:
            self.held[problem.mesh.dofs_in(space, support.facets), support.axis] = True
        spread = {load.facets for load in problem.loads if load.facets}
        spread |= {mean.facets for mean in problem.means}
        self.spread = [problem.mesh.dofs_in(space, name) for name in sorted(spread)]

    def laden(self, interface: Interface) -> list[str]:
        """The surfaces of an ``interface`` on which something acts. Collective."""
        law = interface.pairs[0].law
        first, second = interface.surfaces
        pairs = [(first, second), (second, first)]
        of_bodies = [(one, other) for one, other in pairs if isinstance(one, Surface)]
        along = np.zeros(self.held.shape[1], dtype=bool)
        if law.has_friction or not law.slides:
            # what both sides are held along has no slip
            held = [self._held_along(one) for one, _ in of_bodies]
            along = ~np.logical_and.reduce(held)
        return [one.name for one, other in of_bodies if self._acts(one, other, along)]

    def _held_along(self, surface: Surface) -> np.ndarray:
        """The axes ``(d,)`` along which any facet of a ``surface`` is held. Collective."""
        found = np.atleast_1d(self._held_facets(surface).any(axis=0))
        self.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.LOR)
        return found

    def _held_facets(self, surface: Surface) -> np.ndarray:
        """Whether all nodes of a facet are held along an axis ``(n, d)``."""
        return self.held[_nodes(surface)].all(axis=1)

    def _acts(self, surface: Surface, opposite: Surface | RigidSurface, along: np.ndarray) -> bool:
        """Whether anything acts across facets of a ``surface`` that may meet the ``opposite`` one,
        or holds them ``along`` an axis ``(d,)``. Collective."""
        nodes = _nodes(surface)
        across = np.abs(surface.outward).max(axis=1) > _ALONG
        acts = (self._held_facets(surface) & (across | along)).any(axis=1)
        for spread in self.spread:
            acts |= np.isin(nodes, spread).all(axis=1)
        if isinstance(opposite, Surface):
            acts &= _beside(surface, opposite)
        return self.comm.allreduce(bool(acts.any()), op=MPI.LOR)


def _nodes(surface: Surface) -> np.ndarray:
    """The nodes ``(n, k)`` of this rank's facets of a ``surface``."""
    return np.take_along_axis(surface.cell_dofs, surface.trace, axis=1)


def _beside(surface: Surface, opposite: Surface) -> np.ndarray:
    """Which of this rank's facets ``(n,)`` of a ``surface`` are in the box around the ``opposite``
    one, grown by a facet and by how far the boxes of both are apart."""
    own = surface.curve.X
    other = opposite.curve.X
    low = other.min(axis=0)
    high = other.max(axis=0)
    apart = np.maximum(low - own.max(axis=0), own.min(axis=0) - high)
    margin = np.maximum(apart, 0.0) + surface.facet_lengths().max()
    is_in = (surface.point >= low - margin) & (surface.point <= high + margin)
    return is_in.all(axis=2).any(axis=1)

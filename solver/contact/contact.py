"""Nitsche contact of deformable bodies (Chouly, Hild and Renard 2015; theta = 0): all interactions
of a problem.

At a point ``x`` of a side, with closest point ``y`` on the opposite surface, ``n`` the opposite's
outward normal there and ``g = (x - y) . n`` the gap, the trial pressure is ``t . n - gamma g`` with
``t = sigma(u) N`` the traction of the own body. The law makes a traction ``f`` of it, ``[t . n -
gamma g]_+ n`` without friction (law.py has the shear), and the virtual work of the contact
forces is ``sum over sides of share * integral of f . (v(x) - v(y))``. Linearised are ``n`` and
``y``, too.

Opposite surfaces may lie on other ranks: displacements are exchanged, and forces summed over the
ranks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dolfinx import fem

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.materials.material import Points
from archord.solver.contact.interaction import Interface, Within
from archord.solver.contact.pair import Pair
from archord.solver.contact.sparsity import Reach
from archord.solver.contact.surface import RigidSurface, Surface, on_every_rank
from archord.solver.contact.tangent import ContactTangent, point_rates


class Contact:
    """All ``interfaces``, if any, in the displacement space ``V``. Collective.

    A surface belongs to one interface. ``surfaces`` are surfaces of bodies, ``rigid`` the discs,
    and ``pairs`` the pairs of all interfaces. ``active_set_changes`` counts this rank's points that
    went over to another branch of their law at the last evaluation. ``tangent`` is the derivative
    of what `add_force` adds, renewed as the pattern grows.
    """

    def __init__(self, V: fem.FunctionSpace, interfaces: Sequence[Interface] = ()) -> None:
        self.comm = V.mesh.comm
        self.interfaces = list(interfaces)
        self._all = [surface for i in interfaces for surface in i.surfaces]
        self.surfaces = [surface for surface in self._all if isinstance(surface, Surface)]
        self.rigid = [surface for surface in self._all if isinstance(surface, RigidSurface)]
        self.pairs = [pair for i in interfaces for pair in i.pairs]
        self.has_friction = any(pair.law.has_friction for pair in self.pairs)
        self._slipping = [pair for pair in self.pairs if pair.counts_slip]
        self._block_size = V.dofmap.bs
        self._n_dofs = V.dofmap.index_map.size_global
        self._first_dof = V.dofmap.index_map.local_range[0]
        for number, surface in enumerate(self.rigid):
            surface.curve_dofs[:] = self._n_dofs + number
        self.gamma_factor = max((i.interaction.gamma_factor for i in interfaces), default=0.0)
        self.use_gamma_factor(self.gamma_factor)
        self.active_set_changes = 0
        self._reaches = [Reach(pair, i.slide) for i in interfaces for pair in i.pairs]
        self.tangent = ContactTangent(self._reaches, self._block_size)

    def move(self, levels: Array, fitted: float = 1.0) -> None:
        """Displace rigid surfaces to the drives' ``levels`` ``(d,)``, with the part ``fitted`` of
        interferences."""
        for surface in self.rigid:
            surface.motion = levels[None] @ surface.rate
        for interface in self.interfaces:
            interface.fit(fitted)

    def begin(self, u: Array) -> None:
        """Begin a step at this rank's accepted displacements ``u`` ``(n, d)``. Collective."""
        for pair in self._slipping:
            pair.begin(u, pair.opposite.curve_displacement(u))

    def touch_down(self, u: Array, levels: Array) -> None:
        """Count slip from this rank's displacements ``u`` ``(n, d)`` and the drives' ``levels``
        ``(d,)`` on, at points that did not touch in the accepted state: bodies came there without
        load. Collective."""
        self.move(levels)
        for pair in self._slipping:
            pair.touch_down(u, pair.opposite.curve_displacement(u))

    def search(self) -> None:
        """Forget where the pairs were: the next evaluation searches them over whole surfaces."""
        for pair in self.pairs:
            pair.start = "anywhere"

    def follow(self, partners: bool) -> None:
        """Whether the tangent knows that ``partners`` and normals move. Where bodies go far through
        each other the tractions are so large that this would make it indefinite."""
        for pair in self.pairs:
            pair.follows = partners

    def use_gamma_factor(self, factor: float) -> None:
        """Limit the gamma factor of all interactions to ``factor``, for the time being."""
        for interface in self.interfaces:
            for pair in interface.pairs:
                pair.use_gamma(min(interface.interaction.gamma_factor, factor))

    def evaluate(self, u: Array, dt: float = 0.0, *, reach: bool = True) -> bool:
        """Openings, tractions and trial history at this rank's displacements ``u`` ``(n, d)``, in a
        step of the length ``dt``.

        Returns whether the pattern had to grow; without ``reach`` it does not. Collective; raises
        `ProjectionError` on every rank.
        """
        motions = [pair.opposite.curve_displacement(u) for pair in self.pairs]
        try:
            with on_every_rank(self.comm):
                for pair, motion in zip(self.pairs, motions, strict=True):
                    pair.evaluate(u, motion, dt)
        except ProjectionError:
            self.search()
            raise
        self.active_set_changes = sum(pair.changes for pair in self.pairs)
        if not reach:
            return False
        grew = [each.extend() for each in self._reaches if each.pair.moves]
        if any(grew):
            del self.tangent  # with its large arrays, before the next one is made
            self.tangent = ContactTangent(self._reaches, self._block_size)
        return any(grew)

    def anticipate(self, u: Array, levels: Array) -> bool:
        """Let points go over to the branches to which increments ``u`` ``(n, d)``, and increments
        of the drives' ``levels`` ``(d,)``, would bring them, to first order, with the partners they
        have; returns whether any does.

        Points carry the continued traction of their branch, closed ones even a tension. Collective.
        """
        for pair in self.pairs:
            pair.expect(*point_rates(pair, u, levels))
        return self.comm.allreduce(sum(pair.changes for pair in self.pairs)) > 0

    def round_off(self) -> float:
        """Size of the force that rounding of this rank's contact points leaves: positions times
        gamma."""
        squares = 0.0
        for pair in self.pairs:
            stiffness = (pair.share * pair.gamma[:, 0] * pair.surface.weight.ravel())[pair.active]
            farthest = np.abs(pair.surface.point).max(initial=0.0)
            if isinstance(pair.opposite, RigidSurface):
                farthest = max(farthest, pair.opposite.curve.farthest)
            squares += (stiffness**2).sum() * farthest**2
        return float(2 * np.finfo(float).eps * np.sqrt(squares))

    def add_force(self, force: Array) -> None:
        """Subtract the contact forces of the last evaluation from the residual ``force`` ``(n, d)``
        of owned nodes."""
        on = {
            id(surface): np.zeros((len(surface.curve_dofs), force.shape[1]))
            for surface in self._all
        }
        for pair in self.pairs:
            pair.add_forces(on[id(pair.surface)], on[id(pair.opposite)])
        for surface in self.surfaces:
            surface.add_to_owned(surface.sum_over_ranks(-on[id(surface)]), force)

    def pattern(self) -> tuple[np.ndarray, np.ndarray]:
        """Block ``(rows, columns)`` that the contacts of all ranks may fill in rows of this rank,
        each once, in global dofs. Collective."""
        size = self._n_dofs
        rows = self.tangent.rows
        columns = self.tangent.columns
        of_bodies = (rows < size) & (columns < size)
        slots = (rows * size + columns)[of_bodies]
        first = self.comm.allgather(self._first_dof)
        by_owner = np.split(slots, np.searchsorted(slots, size * np.array(first[1:])))
        return np.divmod(np.unique(np.concatenate(self.comm.alltoall(by_owner))), size)

    def interface(self, name: str = "") -> Interface:
        """The interface of the interaction ``name``, the first without."""
        return next(i for i in self.interfaces if name in ("", i.interaction.name))

    def resultant(self, name: str = "") -> Array:
        """Force ``(d,)`` on the second surface of the interaction ``name``, the first without, over
        all ranks."""
        return self.interface(name).resultant()

    def moments(
        self,
        name: str,
        point: Sequence[float],
        *,
        deformed: bool,
        within: Within | None = None,
    ) -> Array:
        """Moments ``(t,)`` of this force about ``point``, over all ranks: anticlockwise in a plane,
        about x, y and z in space, none around an axis. They are of the ``deformed`` surface, or as
        it was; of places for which ``within`` is true."""
        at = np.asarray(point)
        return self.interface(name).moments(at, deformed=deformed, within=within)

    def largest_pressed(self) -> float:
        """Sum of the sizes of the points' forces of the interaction where it is largest, over all
        ranks; 0 without."""
        return max((interface.pressed() for interface in self.interfaces), default=0.0)

    def force_on_drives(self) -> Array:
        """Contact force ``(d,)`` along the rates of rigid surfaces, over all ranks; a single zero
        without any."""
        total: Array = np.zeros(1)
        for interface in self.interfaces:
            first = interface.surfaces[0]
            if isinstance(first, RigidSurface):
                total = total + first.rate @ interface.resultant()
        return total

    def histories(self) -> dict[str, tuple[np.ndarray, Points]]:
        """Numbers ``(n,)`` of this rank's pieces of facets and their ``n q`` points, of materials
        and of laws, by place."""
        found = {}
        for pair in self.pairs:
            found[f"contact {pair.surface.name}"] = pair.surface.piece, pair.surface.points
            found[f"law {pair.surface.name}"] = pair.surface.piece, pair.points
        return found

    def stored(self) -> float:
        """Energy that is stored in soft contact, this rank's part."""
        return sum(pair.stored() for pair in self.pairs)

    def dissipated(self) -> float:
        """Energy that the laws dissipated so far, this rank's part."""
        return sum(pair.integral(pair.law.dissipation(pair.points.told())) for pair in self.pairs)

    def n_active(self) -> int:
        """Number of points under pressure, over all ranks."""
        of_pairs = [int((pair.traction[:, 0] > 0).sum()) for pair in self.pairs]
        return self.comm.allreduce(sum(of_pairs))

    def pair_of(self, surface: Surface) -> Pair | None:
        """The points of ``surface`` against its opposite; None if it is not integrated."""
        return next((pair for pair in self.pairs if pair.surface is surface), None)

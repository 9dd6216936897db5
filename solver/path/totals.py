"""Forces and energies of the whole, in the last evaluation of an equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.vectors import ALIKE
from archord.solver.bulk.bulk import Bulk
from archord.solver.bulk.distortion import Distortion
from archord.solver.contact.contact import Contact
from archord.solver.contact.interaction import Within
from archord.solver.equilibrium.equilibrium import Equilibrium
from archord.solver.problem import Body, Problem

_AT_REST = 10.0  # times the round-off: forces that are none
_DIGITS = 9  # of places that are not one


class Totals:
    """Forces and energies at the ``equilibrium`` of a ``problem``, of its ``bulk`` and ``contact``:
    of the whole, with its symmetric parts and its thickness, and of a whole ring around an axis.
    Collective."""

    problem: Problem
    comm: MPI.Comm
    bulk: Bulk
    contact: Contact
    equilibrium: Equilibrium
    drive_names: list[str]
    mean_rates: Callable[[str, tuple[float, ...] | None], Array]

    def reaction(self, name: str) -> Array:
        """Force ``(d,)`` of the supports and means ``name`` on the whole."""
        forces = self.equilibrium.diagnostics.reaction(name)
        return self.problem.whole * self.comm.allreduce(forces.sum(axis=0))

    def reaction_moments(self, name: str, point: Sequence[float]) -> Array:
        """Moments ``(t,)`` of these forces at ``point``: about z in a plane, about x, y and z in
        space, none around an axis. At large strain forces act where their nodes are now."""
        kinematics = self.problem.kinematics
        forces = self.equilibrium.diagnostics.reaction(name)
        nodes = self.equilibrium.unknowns.V.tabulate_dof_coordinates()
        places = nodes[: len(forces), : kinematics.dimension]
        if self.bulk.finite:
            places = places + self.equilibrium.displacement()[: len(forces)]
        arm = places - np.asarray(point)
        here = [moment.sum() for moment in kinematics.moments(arm, forces)]
        return self.problem.whole * self.comm.allreduce(np.array(here))

    def contact_force(self, name: str = "") -> Array:
        """Force ``(d,)`` of the interaction ``name``, the first without, on its second surface."""
        return self.problem.whole * self.contact.resultant(name)

    def contact_moments(
        self, name: str, point: Sequence[float], within: Within | None = None
    ) -> Array:
        """Moments ``(t,)`` of that force at ``point``, of the whole: about z in a plane, about x, y
        and z in space, none around an axis. At large strain it acts where the surface is now, at
        small strain where it was, as reactions do. Of a part of the surface, at places ``x``
        ``(m, d)`` for which ``within(x)`` is true."""
        deformed = self.bulk.finite
        of_part = self.contact.moments(name, point, deformed=deformed, within=within)
        return self.problem.whole * of_part

    def mean_motion(self, facets: str, point: tuple[float, ...]) -> Array:
        """The rigid motion closest to the motion of a set of ``facets``, see `Mean`: the
        displacement of the ``point``, then the rotations."""
        owned = self.equilibrium.unknowns.n_owned
        u = self.equilibrium.displacement()[:owned]
        rates = self.mean_rates(facets, point)
        return self.comm.allreduce(np.einsum("knd,nd->k", rates, u))

    def driven(self) -> tuple[Array, Array]:
        """Displacements and forces ``(l,)`` of the ``drive_names`` on the whole, which do the work:
        of what a drive moves, or the mean displacement along its loads and their force."""
        levels = self.equilibrium.unknowns.levels
        conjugates = self.problem.whole * self.equilibrium.evaluation.conjugates()
        moving = self.equilibrium.drives.moving
        displacements = np.where(moving, levels, conjugates)
        forces = np.where(moving, conjugates, levels)
        n = len(self.drive_names)
        return displacements[:n], forces[:n]

    def drive_force(self, name: str) -> float:
        """Force of the drive ``name``."""
        return float(self.driven()[1][self.drive_names.index(name)])

    def drive_displacement(self, name: str) -> float:
        """Displacement of the drive ``name``."""
        return float(self.driven()[0][self.drive_names.index(name)])

    @property
    def warnings(self) -> list[str]:
        """Displacements that nodes do not follow, as supports fix them."""
        return self.equilibrium.drives.warnings

    @property
    def stabilisation_energy(self) -> float:
        """Energy that the springs of `Problem.stabilise` took up so far, of the whole."""
        springs = self.equilibrium.springs
        return self.problem.whole * springs.energy if springs else 0.0

    @property
    def hardest_held(self) -> str:
        """The body, or the interaction with a disc, on which these springs did most work in the
        last accepted step."""
        springs = self.equilibrium.springs
        works = springs.works if springs else {}
        return max(works, key=lambda name: works[name], default="")

    def energies(self) -> tuple[float, float]:
        """Elastic energy, of soft contact too, and plastic dissipation of the whole."""
        parts = np.array(self.bulk.energies(self.equilibrium.displacement()))
        parts[0] += self.contact.stored()
        stored, dissipated = self.problem.whole * self.comm.allreduce(parts)
        return float(stored), float(dissipated)

    def energy_noise(self) -> float:
        """Energy of the whole that is round-off: noise of forces along the largest displacement.
        Collective."""
        here = np.abs(self.equilibrium.displacement()).max(initial=0.0)
        largest = self.comm.allreduce(here, op=MPI.MAX)
        return float(self.problem.whole * self.equilibrium.evaluation.noise * largest)

    def friction_dissipation(self) -> float:
        """Work done against friction so far, on the whole."""
        return self.problem.whole * self.comm.allreduce(self.contact.dissipated())

    def peeq(self) -> tuple[float, float]:
        """Largest PEEQ at a quadrature point, and the integral of PEEQ over the whole."""
        here, part = self.bulk.peeq()
        largest = self.comm.allreduce(here, op=MPI.MAX)
        return largest, self.problem.whole * self.comm.allreduce(part)

    def largest_peeq(self, *bodies: Body, within: Within | None = None) -> tuple[float, ...]:
        """Largest PEEQ at a quadrature point of the ``bodies``, of those at ``x`` ``(n, d)`` for
        which ``within(x)`` is true; and the coordinates of its place, of several that differ by
        round-off the last one along x, then y, then z. Zeros without any."""
        d = self.problem.kinematics.dimension
        values: list[Array] = [np.zeros(0)]
        places: list[Array] = [np.zeros((0, d))]
        for body in bodies:
            peeq, x = self.bulk.peeq_of(self.problem.tag(body))
            if within is not None:
                peeq = np.where(within(x), peeq, 0.0)
            values.append(peeq)
            places.append(x)
        peeq = np.concatenate(values)
        x = np.concatenate(places)
        largest = self.comm.allreduce(peeq.max(initial=0.0), op=MPI.MAX)
        size = self.comm.allreduce(np.abs(x).max(initial=0.0), op=MPI.MAX)
        alike = x[peeq >= max((1 - ALIKE) * largest, np.finfo(float).tiny)]
        rounded = np.round(alike / max(size, np.finfo(float).tiny), _DIGITS)
        last = np.lexsort(rounded.T[::-1])[-1:]
        here = list(zip(rounded[last].tolist(), alike[last].tolist(), strict=True))
        of_all = [found for of_rank in self.comm.allgather(here) for found in of_rank]
        _, place = max(of_all, default=([], [0.0] * d))
        return float(largest), *place

    def distortion(self) -> Distortion:
        """How far cells are strained, turned and turned over, in the last evaluation."""
        found = self.comm.allgather(self.bulk.distortion(self.equilibrium.displacement()))
        return reduce(Distortion.joined, found)

    def force_balance(self, before: float = 0.0) -> float:
        """Largest resultant on a body over the largest force: of a support, of an interaction, as
        the sum of the sizes of its points' forces, the norm of nodal ones, as of a pure moment, or
        the force ``before``; 0 if all are round-off."""
        whole = self.problem.whole
        at = self.equilibrium
        left = [
            at.diagnostics.residual_on(at.drives.nodes_of(body)) for body in self.problem.bodies
        ]
        names = dict.fromkeys(support.name for support in self.problem.supports)
        reactions = [self.reaction(name) for name in names]
        of_supports = _largest(reactions)
        nodal = max(at.evaluation.reaction_norm, at.largest_reaction)
        on_part = max(nodal, self.contact.largest_pressed())
        largest = max(of_supports, whole * on_part, before)
        if largest <= _AT_REST * whole * at.evaluation.noise:
            return 0.0
        return whole * _largest(left) / largest


def _largest(forces: Sequence[Array]) -> float:
    """The size of the largest of ``forces``, 0 without any."""
    return max((float(np.linalg.norm(force)) for force in forces), default=0.0)

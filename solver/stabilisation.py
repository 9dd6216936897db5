"""Bodies that nothing holds before they touch: which, where they come to rest among others, and
springs that keep them.

As if rigid, bodies go where contact and forces push them; from there the elastic ones find their
equilibrium. Springs between them and their last accepted state hold what does not touch even then:
each point of a body of area ``A`` is pulled back with `WEAK` times ``M / A`` per displacement and
area, ``M`` being the modulus of uniaxial strain, so that a force moves the body by about ``1 /
WEAK`` times as much as it deforms it; rigid discs under forces, with `WEAK` ``M``. Beside a far
softer body ``M`` is `_STIFFER` times its shear modulus: springs are weak for all that carries.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.solver.bulk import assemble, matrix
from archord.solver.contact.contact import Contact
from archord.solver.contact.surface import RigidSurface
from archord.solver.contact.tangent import point_rates
from archord.solver.drives import MOVABLE, Drives
from archord.solver.problem import Interaction, Rigid

WEAK = 1e-8  # without influence, but well above the round-off of a factorisation
_STIFFER = 100.0  # most of M over the smallest shear modulus
_LEAST = (
    1e-5  # least of M over the own one: springs must stand out of the round-off of a factorisation
)
_LITTLE = 0.01  # part of the contact forces below which springs hold nothing
_MOST = 100  # iterations
_AT_REST = 1e-3  # part of the forces that may be left
_ROUND_OFF = 1e-9  # the same, of the largest forces on the way
_DAMPING = 10.0  # ratio of one damping to the next
_LOOSE = 1e-6  # part of a free motion that a body has at least which takes part in it


class RigidMotions:
    """The ``free`` motions ``(r, n_local, 2)`` that supports, means and prescribed ``drives`` leave
    to the bodies, with the ``levels`` ``(r, d)`` of unknown drives that go along; ``loose`` bodies
    take part in one. Collective."""

    def __init__(self, drives: Drives, contact: Contact) -> None:
        self.drives, self.contact, self.comm = drives, contact, drives.comm
        bodies, moving = drives.problem.bodies, drives.moving[drives.unknown]
        self._modes = np.concatenate([drives.rigid_modes(body) for body in bodies])
        k, forces = len(self._modes), drives.unknown_load[~moving] / drives.stiffness
        self._prescribed = np.hstack(
            [self._modes[:, drives.fixed].T, -drives.unknown_rate[moving][:, drives.fixed].T]
        )
        along = self._on_bodies(self._modes, forces)
        gram = self.comm.allreduce(self._prescribed.T @ self._prescribed)
        gram[:k, :k] += along @ along.T
        self._follow = np.linalg.pinv(gram, rcond=MOVABLE, hermitian=True)
        sizes, vectors = np.linalg.eigh(gram)
        free = vectors[:, sizes <= MOVABLE * sizes.max()]
        self.free = np.tensordot(free[:k].T, self._modes, 1)
        self.levels = np.zeros((free.shape[1], len(drives.rate)))
        self.levels[:, drives.unknown[moving]] = free[k:].T * drives.weight[moving]
        parts = np.abs(free[:k]).reshape(len(bodies), -1).max(axis=1, initial=0.0)
        self.loose = [body for body, part in zip(bodies, parts, strict=True) if part > _LOOSE]
        self._links = [self._linked(interface.interaction) for interface in contact.interfaces]

    def _linked(self, interaction: Interaction) -> set[str]:
        """The names of the bodies that the ``interaction`` links; a disc has none."""
        of = self.drives.problem.body_of
        return {
            "" if isinstance(surface, Rigid) else of(surface).name
            for surface in interaction.surfaces
        }

    def all_reached(self, touching: Sequence[bool]) -> bool:
        """Whether interfaces that are ``touching`` link every loose body to one that is held, or to
        a disc."""
        links = [link for link, touches in zip(self._links, touching, strict=True) if touches]
        missing = {body.name for body in self.loose}
        while missing:
            reached = {name for link in links if link - missing for name in link & missing}
            if not reached:
                return False
            missing -= reached
        return True

    def _on_bodies(self, motions: Array, forces: Array) -> Array:
        """Work ``(k, m)`` of ``forces`` ``(m, n_owned, 2)`` on nodes along ``motions`` ``(k,
        n_local, 2)``."""
        return self.comm.allreduce(
            np.tensordot(motions[:, : self.drives.n_owned], forces, ((1, 2), (1, 2)))
        )

    def at_rest(self, load: float, state: Array) -> Array:
        """A ``state`` at ``load``, with bodies moved as their supports are, and loose ones to where
        contact and forces push them; as it was where contact points find no partners on the way.
        The contact law alone resists: Newton's method finds the least energy, damped while forces
        are large (Levenberg 1944), in steps of a facet at most."""
        if not self.contact.pairs:
            return state
        drives, n = self.drives, self._modes[0].size
        u, levels = state[:n].reshape(-1, 2).copy(), drives.values(load)
        levels[drives.unknown] = state[n:][drives.unknown]
        lacking = np.tensordot(levels, drives.rate, 1)[drives.fixed] - u[drives.fixed]
        followed = self._follow @ self.comm.allreduce(self._prescribed.T @ lacking)
        u += np.tensordot(followed[: len(self._modes)], self._modes, 1)
        applied = self.levels @ drives.values(load) / drives.problem.symmetry
        applied += self._on_bodies(self.free, np.tensordot(levels, drives.applied, 1)[None])[:, 0]
        facet = min(surface.facet_lengths().mean() for surface in self.contact.surfaces)
        step: Array = np.zeros(len(self.free))
        damping, least, most = drives.stiffness, np.inf, 0.0
        try:
            for _ in range(_MOST):
                left, stiffness, pressed, openings = self._contact(u, levels, load)
                left, most = left + applied, max(most, pressed)
                size = float(np.linalg.norm(left))
                if size > 2 * least:  # back to the place before, for a smaller step
                    u, levels = u - np.tensordot(step, self.free, 1), levels - step @ self.levels
                    damping *= _DAMPING**2
                else:
                    least, damping = size, damping / _DAMPING
                    last = stiffness, left, openings
                if size <= max(
                    _AT_REST * pressed, _AT_REST * float(np.linalg.norm(applied)), _ROUND_OFF * most
                ):
                    break
                step = np.linalg.solve(last[0] + damping * np.eye(len(step)), last[1])
                farthest = max(
                    (float(np.abs(opening @ step).max(initial=0.0)) for opening in last[2]),
                    default=0.0,
                )
                step *= min(1.0, facet / (self.comm.allreduce(farthest, op=MPI.MAX) or facet))
                u, levels = u + np.tensordot(step, self.free, 1), levels + step @ self.levels
        except ProjectionError:
            return state
        return np.append(u, levels)

    def _contact(
        self, u: Array, levels: Array, load: float
    ) -> tuple[Array, Array, float, list[Array]]:
        """Forces ``(r,)`` of the contact on the free motions, their stiffness ``(r, r)``, the sum
        of all forces, and of each pair what the motions add to gap and slip ``(m, 2, r)``."""
        self.contact.move(levels, self.drives.problem.fitted(load))
        self.contact.evaluate(u, reach=False)
        r, pressed, openings = len(self.free), 0.0, []
        force, stiffness = np.zeros(r), np.zeros((r, r))
        for pair in self.contact.pairs:
            rates = [
                point_rates(pair, *motion)[0] for motion in zip(self.free, self.levels, strict=True)
            ]
            opening = -np.stack(rates, axis=2) / pair.gamma[..., None]
            weight = pair.share * pair.surface.weight.ravel()
            force += np.einsum("m,mi,mik->k", weight, pair.traction, opening)
            stiff = (weight[:, None] * pair.gamma)[:, None] * pair.by_trial
            stiffness += np.tensordot(opening, stiff @ opening, ((0, 1), (0, 1)))
            pressed += float(np.abs(pair.forces).sum())
            openings.append(opening)
        return *map(self.comm.allreduce, (force, stiffness, pressed)), openings


def spring_modulus(own: float, softest: float) -> float:
    """The modulus that the springs of a body take for ``M``: its ``own`` one where no body is far
    softer; ``softest`` is the smallest shear modulus of all bodies."""
    return max(min(own, _STIFFER * softest), _LEAST * own)


class Springs:
    """The springs of what ``rigid`` finds loose, bodies and discs; ``stiffness`` is that of discs.
    Collective.

    ``forces`` ``(n_owned dofs,)`` are those of the bodies' last displacements, ``on_levels``
    ``(d,)`` those of discs, and ``work`` what the springs took up, of the modelled part; ``energy``
    is its sum over accepted states. ``of_free`` is their matrix without prescribed displacements.
    In the last accepted state ``idle`` ones left all to contact, and ``works`` are what they took
    up then, by the names of loose bodies and of interactions with a disc.
    """

    def __init__(self, rigid: RigidMotions, stiffness: float) -> None:
        drives, contact = rigid.drives, rigid.contact
        self.rigid, self.comm, self._contact = rigid, drives.comm, contact
        self.energy, self.idle, V = 0.0, False, drives.V
        u, v, forms = ufl.TrialFunction(V), ufl.TestFunction(V), []
        softest = min(float(body.material.elastic_tangent[2, 2]) for body in drives.problem.bodies)
        self.works: dict[str, float] = {}
        for body in rigid.loose:
            dx = drives.measure(body.cells or body.name)
            area = drives.integral(fem.Constant(V.mesh, 1.0) * dx)
            own = float(body.material.elastic_tangent[0, 0])
            modulus = fem.Constant(V.mesh, WEAK * spring_modulus(own, softest) / area)
            forms.append(fem.form(modulus * ufl.inner(u, v) * dx))
        self._matrix = matrix(V, forms)
        assemble(self._matrix, forms)
        self._matrix.assemble()
        fixed = 2 * V.dofmap.index_map.local_range[0] + np.flatnonzero(
            drives.fixed[: drives.n_owned]
        )
        self.of_free = self._matrix.copy()
        self.of_free.zeroRowsColumns(fixed.astype(PETSc.IntType), 0.0)
        self._x, self._y = self._matrix.createVecs()
        none: Array = np.zeros(len(drives.rate))
        of_disc = WEAK * spring_modulus(stiffness, softest)
        self.of_levels = of_disc * sum(((disc.rate**2).sum(axis=1) for disc in contact.rigid), none)
        self.last = np.zeros(2 * drives.n_owned), none

    def pull(self, u: Array) -> Array:
        """Forces ``(n_owned dofs,)`` of displacements ``u``, alike, on the bodies' springs."""
        self._x.array[:] = u
        self._matrix.mult(self._x, self._y)
        return self._y.array_r.copy()

    def evaluate(self, u: Array, levels: Array) -> None:
        """Forces and work at the displacements ``u`` ``(n_owned dofs,)`` and drives' ``levels``
        ``(d,)``."""
        self._now, moved, turned = (
            (u.copy(), levels.copy()),
            u - self.last[0],
            levels - self.last[1],
        )
        self.forces, self.on_levels = self.pull(moved), self.of_levels * turned
        self._moved, self._turned = moved, turned
        self.work = (
            self.comm.allreduce(float(self.forces @ moved)) + float(self.on_levels @ turned)
        ) / 2

    def commit(self) -> None:
        """Accept the last evaluation: the springs rest there."""
        self.last, self.energy = self._now, self.energy + self.work
        self.works = self._works()
        self.look()

    def _works(self) -> dict[str, float]:
        """What they took up at the last evaluation, as ``works``."""
        drives, found = self.rigid.drives, dict[str, float]()
        on_nodes = (self.forces * self._moved).reshape(-1, 2).sum(axis=1) / 2
        for body in self.rigid.loose:
            nodes = np.unique(drives.V.dofmap.list[drives.problem.cells_of(body)])
            found[body.name] = self.comm.allreduce(
                float(on_nodes[nodes[nodes < drives.n_owned]].sum())
            )
        for interface in self._contact.interfaces:
            disc = interface.surfaces[0]
            if isinstance(disc, RigidSurface):
                along = (disc.rate**2).sum(axis=1) > 0
                found[interface.interaction.name] = (
                    float((self.on_levels * self._turned)[along].sum()) / 2
                )
        return found

    def look(self) -> None:
        """See whether they are `idle`."""
        pressed = [
            sum(float(np.abs(pair.forces).sum()) for pair in i.pairs)
            for i in self._contact.interfaces
        ]
        pulled, *pressed = self.comm.allreduce(np.array([np.abs(self.forces).sum(), *pressed]))
        little = pulled + np.abs(self.on_levels).sum() < _LITTLE * sum(pressed)
        self.idle = bool(little and self.rigid.all_reached([force > 0 for force in pressed]))

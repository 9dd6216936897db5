"""Bodies that float until they touch, and where contact stops them.

As if rigid, bodies go where contact and forces push them; from there the elastic ones find their
equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.solver.contact.contact import Contact
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.contact.tangent import point_rates
from archord.solver.drives import MOVABLE, Drives
from archord.solver.problem import Interaction, Rigid

_MOST = 100  # iterations
_AT_REST = 1e-3  # part of the forces that may be left
_STOPPED = 0.1  # the same where contact carries bodies, whose place hardly changes from there
_FAST = 0.1  # ratio of what is left by which iterations go on from there
_ROUND_OFF = 1e-9  # the same, of the largest forces on the way
_DAMPING = 10.0  # ratio of one damping to the next
_LEAST_DAMPING = 1e-12  # the last damping over the first, as nothing else may resist
_BALANCED = 1e-6  # part of forces below which their resultant on free motions is none
_UNHELD = 0.1  # part of forces that nothing holds however far bodies go
_DIGITS = 6  # of normals that are not one
_LOOSE = 1e-6  # part of a free motion that a body has at least which takes part in it


class _Push(NamedTuple):
    """What contact does to the free motions.

    force : (r,) on each of them
    stiffness : (r, r)
    pressed : sum of the sizes of all contact forces
    openings : of each pair (m, d, r) what the motions add to gap and slip
    """

    force: Array
    stiffness: Array
    pressed: float
    openings: list[Array]


class RigidMotions:
    """The motions that supports, means and prescribed ``drives`` leave to bodies as if rigid.
    Collective.

    free : (r, n_local, d) displacements of the nodes
    levels : (r, l) levels of unknown drives that go along
    loose : bodies that take part in a free motion
    """

    def __init__(self, drives: Drives, contact: Contact) -> None:
        self.drives = drives
        self.contact = contact
        self.comm = drives.comm
        self.problem = drives.problem
        bodies = self.problem.bodies
        moving = drives.moving[drives.unknown]
        self._modes = np.concatenate([drives.rigid_modes(body) for body in bodies])
        k = len(self._modes)
        of_modes = self._modes[:, drives.fixed].T
        of_levels = drives.unknown_rate[moving][:, drives.fixed].T
        self._prescribed = np.hstack([of_modes, -of_levels])
        gram = self.comm.allreduce(self._prescribed.T @ self._prescribed)
        means = drives.unknown_load[~moving] / drives.stiffness
        along = self._on_bodies(self._modes, means)
        gram[:k, :k] += along @ along.T
        self._follow = np.linalg.pinv(gram, rcond=MOVABLE, hermitian=True)
        sizes, vectors = np.linalg.eigh(gram)
        free = vectors[:, sizes <= MOVABLE * sizes.max()]
        self.free = np.tensordot(free[:k].T, self._modes, 1)
        self.levels = np.zeros((free.shape[1], len(drives.rate)))
        self.levels[:, drives.unknown[moving]] = free[k:].T * drives.weight[moving]
        self._of_bodies = free[:k].T.reshape(-1, len(bodies), k // len(bodies))
        parts = np.abs(self._of_bodies).max(axis=(0, 2), initial=0.0)
        self.loose = [body for body, part in zip(bodies, parts, strict=True) if part > _LOOSE]
        lengths = [surface.facet_lengths().mean() for surface in contact.surfaces]
        self._facet = min(lengths, default=np.inf)
        self._links = [self._linked(interface.interaction) for interface in contact.interfaces]

    def _linked(self, interaction: Interaction) -> set[str]:
        """The names of the bodies that the ``interaction`` links; a disc has none."""
        return {
            "" if isinstance(surface, Rigid) else self.problem.body_of(surface).name
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
        """Work ``(k, m)`` of ``forces`` ``(m, n_owned, d)`` on nodes along ``motions`` ``(k,
        n_local, d)``."""
        own = motions[:, : self.drives.n_owned]
        return self.comm.allreduce(np.tensordot(own, forces, ((1, 2), (1, 2))))

    def at_rest(self, load: float, state: Array) -> tuple[Array, bool]:
        """A ``state`` at ``load``, with bodies moved as their supports are, and loose ones to where
        contact and forces push them; as it was where contact points find no partners on the way.
        And whether forces push them there that contact carries.

        The contact law alone resists. Newton's method finds the least energy, damped while forces
        are large (Levenberg 1944), in steps of a facet at most. Slip counts from there: where
        forces push it goes on as long as it converges fast.
        """
        if not self.contact.pairs:
            return state, False
        u, levels = self._with_supports(load, state)
        try:
            u, levels, is_stopped = self._settled(load, u, levels)
        except ProjectionError:
            return state, False
        return np.append(u, levels), is_stopped

    def _with_supports(self, load: float, state: Array) -> tuple[Array, Array]:
        """Displacements and levels with bodies moved rigidly as their supports are."""
        drives = self.drives
        mode = self._modes[0]
        n = mode.size
        u = state[:n].reshape(mode.shape).copy()
        levels = drives.values(load)
        levels[drives.unknown] = state[n:][drives.unknown]
        prescribed = drives.displaced(levels)
        lacking = (prescribed - u)[drives.fixed]
        along = self.comm.allreduce(self._prescribed.T @ lacking)
        followed = self._follow @ along
        u += np.tensordot(followed[: len(self._modes)], self._modes, 1)
        return u, levels

    def _settled(self, load: float, u: Array, levels: Array) -> tuple[Array, Array, bool]:
        """Displacements and levels where contact and forces balance, and whether contact carries
        forces there. Raises `ProjectionError`."""
        applied = self._applied(load, levels)
        is_pushed = bool(np.linalg.norm(applied))
        damping = self.drives.stiffness
        least_damping = _LEAST_DAMPING * damping
        least = np.inf
        most = 0.0
        is_near = False
        is_beyond = False
        for _ in range(_MOST):
            push = self._push(u, levels, load)
            left = push.force + applied
            size = float(np.linalg.norm(left))
            most = max(most, push.pressed)
            before = least
            is_worse = size > (1 if is_near else 2) * least
            if not is_worse:
                least = size
                damping = max(damping / _DAMPING, least_damping)
                best = push, left, u, levels
                is_beyond = False
            elif best[0].pressed == 0 and not is_beyond:
                # what stops bodies that nothing resisted is known where they have gone too far
                is_beyond = True
            else:  # back to the place before, for a smaller step
                push, left, u, levels = best
                damping *= _DAMPING**2
                is_beyond = False
            if size <= _ROUND_OFF * most or (is_near and size > _FAST * before):
                break
            scale = max(push.pressed, float(np.linalg.norm(applied)))
            is_near = is_near or size <= _AT_REST * scale
            if is_near and not is_pushed:
                break
            damped = push.stiffness + damping * np.eye(len(left))
            whole_step = np.linalg.solve(damped, left)
            step = self._shortened(whole_step, push.openings)
            u = u + np.tensordot(step, self.free, 1)
            levels = levels + step @ self.levels
        _, _, u, levels = best
        return u, levels, is_pushed and least < _STOPPED * float(np.linalg.norm(applied))

    def _applied(self, load: float, levels: Array) -> Array:
        """Forces ``(r,)`` of drives and loads on the free motions."""
        drives = self.drives
        of_loads = np.tensordot(levels, drives.applied, 1)
        of_drives = self.levels @ drives.values(load) / self.problem.whole
        return of_drives + self._on_bodies(self.free, of_loads[None])[:, 0]

    def resultant(self, forces: Array, on_levels: Array) -> float:
        """Size of what ``forces`` ``(n_owned, d)`` and those ``on_levels`` ``(l,)`` do to the free
        motions."""
        on_motions = self._on_bodies(self.free, forces[None])[:, 0] + self.levels @ on_levels
        return float(np.linalg.norm(on_motions))

    def least_push(self, load: float) -> float:
        """The least resultant of the forces that single drives prescribe at the ``load``, but for
        forces that balance by themselves, or act on what is held; 0 without any."""
        drives = self.drives
        pushes: list[float] = []
        weights = {int(k): float(w) for k, w in zip(drives.unknown, drives.weight, strict=True)}
        for level, value in enumerate(drives.values(load)):
            on_levels = np.zeros(len(drives.rate))
            forces = np.zeros_like(drives.applied[level])
            size = 0.0
            if drives.moving[level]:
                on_levels[level] = value / self.problem.whole
                size = abs(on_levels[level]) * weights.get(level, 0.0)
            elif level not in drives.unknown:
                forces = value * drives.applied[level]
            push = self.resultant(forces, on_levels)
            size += self.comm.allreduce(float(np.abs(forces).sum()))
            if push > _BALANCED * size:
                pushes.append(push)
        return min(pushes, default=0.0)

    def unheld(self, load: float, *, tied: bool = False) -> str:
        """The body, or the interaction of a disc, that forces at the ``load`` push along a line on
        which no contact is in its way, however far it goes; "" without one. Collective.

        Translations of the bodies are sought that the forces drive most (a linear program), of
        which none goes against the normal of a facet of a contact. Friction counts as a tie; all
        contacts do where bodies are ``tied``.
        """
        from scipy.optimize import linprog  # few runs pay for it

        applied = self._applied(load, self.drives.values(load))
        d = self.drives.dimension
        turns = self._of_bodies[:, :, d:]
        least = self.least_push(load)
        if np.linalg.norm(applied) <= _BALANCED * least or not least:  # all but round-off balances
            return ""
        if not turns.size:  # around an axis
            return ""
        stands: list[Array] = [turns.reshape(len(applied), -1).T]
        opens: list[Array] = [np.zeros((1, len(applied)))]
        for interface in self.contact.interfaces:
            first, second = interface.surfaces
            apart = self._velocities(second) - self._velocities(first)
            law = interface.pairs[0].law
            if tied or law.has_friction or not law.unilateral:
                stands.append(apart.T)
                continue
            for surface, along in ((first, apart), (second, -apart)):
                if isinstance(surface, Surface):
                    opens.append(self._normals(surface) @ along.T)
        found = linprog(
            -applied,
            A_ub=-np.concatenate(opens),
            b_ub=np.zeros(sum(map(len, opens))),
            A_eq=np.concatenate(stands),
            b_eq=np.zeros(sum(map(len, stands))),
            bounds=(-1, 1),
        )
        if found.x is None or applied @ found.x <= _UNHELD * np.linalg.norm(applied):
            return ""
        moved = np.abs(np.tensordot(found.x, self._of_bodies, 1)).max(axis=1)
        bodies = [str(body.name) for body in self.problem.bodies]
        moves = dict(zip(bodies, moved.tolist(), strict=True))
        for interface in self.contact.interfaces:
            for surface in interface.surfaces:
                if isinstance(surface, RigidSurface):
                    along = found.x @ self._velocities(surface)
                    moves[interface.interaction.name] = float(np.abs(along).max())
        return max(moves, key=lambda name: moves[name])

    def _velocities(self, surface: Surface | RigidSurface) -> Array:
        """Translation ``(r, d)`` of the body of a ``surface`` in each free motion."""
        if isinstance(surface, RigidSurface):
            return np.asarray(self.levels @ surface.rate)
        body = self.problem.bodies.index(self.problem.body_of(surface.name))
        return np.asarray(self._of_bodies[:, body, : self.drives.dimension])

    def _normals(self, surface: Surface) -> Array:
        """The different outward normals ``(k, d)`` of a ``surface``, over all ranks."""
        own = surface.outward.reshape(-1, self.drives.dimension)
        of_ranks = self.comm.allgather(np.unique(own.round(_DIGITS), axis=0))
        return np.unique(np.concatenate(of_ranks), axis=0)

    def _shortened(self, step: Array, openings: list[Array]) -> Array:
        """The ``step``, in which no gap changes by more than a facet."""
        sizes = [float(np.abs(opening @ step).max(initial=0.0)) for opening in openings]
        farthest = self.comm.allreduce(max(sizes, default=0.0), op=MPI.MAX)
        return step if farthest <= self._facet else step * (self._facet / farthest)

    def _push(self, u: Array, levels: Array, load: float) -> _Push:
        """What contact does at these displacements and levels. Raises `ProjectionError`."""
        self.contact.move(levels, self.problem.fitted(load))
        self.contact.evaluate(u, reach=False)
        r = len(self.free)
        force = np.zeros(r)
        stiffness = np.zeros((r, r))
        pressed = 0.0
        openings: list[Array] = []
        for pair in self.contact.pairs:
            motions = zip(self.free, self.levels, strict=True)
            rates = [point_rates(pair, *motion)[0] for motion in motions]
            opening = -np.stack(rates, axis=2) / pair.gamma[..., None]
            weight = pair.share * pair.surface.weight.ravel()
            force += np.einsum("m,mi,mik->k", weight, pair.traction, opening)
            weighted = weight[:, None] * pair.gamma
            stiff = weighted[:, None] * pair.by_trial
            stiffness += np.tensordot(opening, stiff @ opening, ((0, 1), (0, 1)))
            pressed += float(np.abs(pair.forces).sum())
            openings.append(opening)
        force = self.comm.allreduce(force)
        stiffness = self.comm.allreduce(stiffness)
        return _Push(force, stiffness, self.comm.allreduce(pressed), openings)

"""Weak springs that hold bodies where nothing touches them.

Springs between bodies and their last accepted state hold what does not touch even where it has come
to rest as if rigid. Where contact stops what forces push, they begin there, so that they carry
nothing of a tiny force. Each point of a body of area ``A`` is pulled back with `WEAK` times ``M /
A`` per displacement and area, ``M`` being the modulus of uniaxial strain, so that a force moves the
body by about ``1 / WEAK`` times as much as it deforms it; rigid discs under forces, with `WEAK`
``M``. In space, where ``A`` is a volume, ``M`` is times the edge of a cube of this volume: so the
springs do not depend on the unit of length. Beside a far softer body ``M`` is `_STIFFER` times its
shear modulus: springs are weak for all that carries.
"""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.report.by_name import Amounts
from archord.solver.bulk.assembly import assemble, matrix
from archord.solver.bulk.stiffness import CellStiffness, value_terms
from archord.solver.contact.surface import RigidSurface
from archord.solver.drives import Drives
from archord.solver.equilibrium.rigid_motions import RigidMotions
from archord.solver.loads import LOAD_DEGREE
from archord.solver.problem import Body

WEAK = 1e-8  # without influence, but well above the round-off of a factorisation
_STIFFER = 100.0  # most of M over the smallest shear modulus
# least of M over the own one: springs must stand out of the round-off of a factorisation
_LEAST = 1e-5
_LARGE = 0.1  # part of a force that springs carry only where contact is lost
_LITTLE = 0.01  # part of the contact forces below which springs hold nothing


def spring_modulus(own: float, softest: float) -> float:
    """The modulus that the springs of a body take for ``M``: its ``own`` one where no body is far
    softer; ``softest`` is the smallest shear modulus of all bodies."""
    return max(min(own, _STIFFER * softest), _LEAST * own)


class Springs:
    """The springs of what ``rigid`` finds loose, bodies and discs; ``stiffness`` is the discs'.
    Collective.

    of_free : their matrix, without prescribed displacements
    of_levels : (l,) stiffness of the springs of discs
    rest : displacements (n_owned dofs,) and levels (l,) at which they have no force
    forces : (n_owned dofs,) on bodies, at the last evaluation
    on_levels : (l,) on discs
    work : what the springs took up in the step, of the modelled part
    energy : sum of the work over accepted states
    works : work in the last accepted step, by the names of loose bodies and of discs, as "contact
        disc" for the disc of the interaction "contact"
    idle : whether the springs left all to contact in the last accepted state
    """

    def __init__(self, rigid: RigidMotions, stiffness: float) -> None:
        drives = rigid.drives
        self.rigid = rigid
        self.comm = drives.comm
        self._contact = rigid.contact
        shear = [body.material.elastic_tangent[-1, -1] for body in drives.problem.bodies]
        softest = float(min(shear))
        forms = [_form(drives, body, softest) for body in rigid.loose]
        self._matrix = matrix(drives.V, forms)
        assemble(self._matrix, forms)
        self._matrix.assemble()
        self.of_free = self._matrix.copy()
        first = self._matrix.getOwnershipRange()[0]
        fixed = first + np.flatnonzero(drives.fixed[: drives.n_owned])
        self.of_free.zeroRowsColumns(fixed.astype(PETSc.IntType), 0.0)
        self._x, self._y = self._matrix.createVecs()
        self.of_levels: Array = np.zeros(len(drives.rate))
        of_disc = WEAK * spring_modulus(stiffness, softest)
        for disc in rigid.contact.rigid:
            self.of_levels += of_disc * (disc.rate**2).sum(axis=1)
        n_dofs = drives.dimension * drives.n_owned
        self.rest: tuple[Array, Array] = np.zeros(n_dofs), np.zeros(len(drives.rate))
        self.energy = 0.0
        self.works: Amounts = {}
        self.idle = False
        self._tightness = 1.0

    def pull(self, u: Array) -> Array:
        """Forces ``(n_owned dofs,)`` of displacements ``u``, alike, on the bodies' springs."""
        self._x.array[:] = u
        self._matrix.mult(self._x, self._y)
        return self._y.array_r.copy()

    def evaluate(self, u: Array, levels: Array) -> None:
        """Forces and work at the displacements ``u`` ``(n_owned dofs,)`` and drives' ``levels``
        ``(l,)``."""
        u_at_rest, levels_at_rest = self.rest
        self._now = u.copy(), levels.copy()
        self._moved = u - u_at_rest
        self._turned = levels - levels_at_rest
        self.forces = self.pull(self._moved)
        self.on_levels = self.of_levels * self._turned
        on_bodies = self.comm.allreduce(float(self.forces @ self._moved))
        self.work = (on_bodies + float(self.on_levels @ self._turned)) / 2

    def hold(self, tightness: float) -> None:
        """Let them be ``tightness`` times as stiff as they are at first."""
        change = tightness / self._tightness
        self._tightness = tightness
        if change != 1:
            self._matrix.scale(change)
            self.of_free.scale(change)
            self.of_levels = change * self.of_levels

    def rest_at(self, state: Array) -> None:
        """Let them have no force in a ``state``, an array of displacements and levels."""
        n_levels = len(self.of_levels)
        n_dofs = self.rigid.drives.dimension * self.rigid.drives.n_owned
        self.rest = state[:n_dofs].copy(), state[len(state) - n_levels :].copy()

    def commit(self) -> None:
        """Accept the last evaluation: the springs rest there."""
        self.rest = self._now
        self.energy += self.work
        self.works = self._works()
        self.idle = self._leave_all()

    def _works(self) -> Amounts:
        """What they took up at the last evaluation, as ``works``."""
        drives = self.rigid.drives
        found: Amounts = {}
        on_dofs = self.forces * self._moved / 2
        on_nodes = on_dofs.reshape(-1, drives.dimension).sum(axis=1)
        for body in self.rigid.loose:
            nodes = drives.nodes_of(body)
            owned = nodes[nodes < drives.n_owned]
            found[body.name] = self.comm.allreduce(float(on_nodes[owned].sum()))
        on_levels = self.on_levels * self._turned / 2
        for interface in self._contact.interfaces:
            disc = interface.surfaces[0]
            if isinstance(disc, RigidSurface):
                moves = disc.rate.any(axis=1)
                found[f"{interface.interaction.name} disc"] = float(on_levels[moves].sum())
        return found

    def held(self, load: float) -> str:
        """The body that they hold in place of contact at the ``load``, "" where contact carries
        what pushes. Without a force that is prescribed, they may hold a body that others push.
        Collective."""
        if not self.rigid.drives.pushes(load):
            return ""
        forces = self.forces.reshape(-1, self.rigid.drives.dimension)
        carried = self.rigid.resultant(forces, self.on_levels)
        least = self.rigid.least_push(load)
        if not 0 < _LARGE * least < carried:
            return ""
        works = self._works()
        return max(works, key=lambda name: works[name])

    def _leave_all(self) -> bool:
        """Whether they leave all to contact at the last evaluation."""
        forces = [np.abs(self.forces).sum()]
        for interface in self._contact.interfaces:
            forces.append(sum(float(np.abs(pair.forces).sum()) for pair in interface.pairs))
        pulled, *pressed = self.comm.allreduce(np.array(forces))
        is_little = pulled + np.abs(self.on_levels).sum() < _LITTLE * sum(pressed)
        return bool(is_little and self.rigid.all_reached([force > 0 for force in pressed]))


def _form(drives: Drives, body: Body, softest: float) -> fem.Form:
    """The bilinear form of the springs of a ``body``."""
    d = drives.dimension
    name = body.cells or body.name
    area = drives.comm.allreduce(drives.loads.region(name).drawn.sum())
    own = float(body.material.elastic_tangent[0, 0])
    length = np.cbrt(area) if d == 3 else 1.0
    modulus = WEAK * spring_modulus(own, softest) * length / area
    springs = CellStiffness(
        drives.V, drives.problem.kinematics, LOAD_DEGREE, value_terms(d), modulus * np.eye(d)
    )
    return springs.over(drives.loads.cells_of(name))

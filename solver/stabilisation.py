"""Springs that keep bodies in place which touch nothing yet: between them and their last accepted state.

Each point of a body of area ``A`` is pulled back with ``factor M / A`` per displacement and area, ``M`` being the
modulus of uniaxial strain: a force moves the body by about ``1 / factor`` times as much as it deforms it. Rigid discs
under forces have springs of ``factor M``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.solver.bulk import assemble, matrix
from archord.solver.contact.contact import Contact
from archord.solver.drives import Drives
from archord.solver.problem import Body

WEAK = 1e-8  # the factor of solutions: without influence, but well above the round-off of a factorisation
_LITTLE = 0.01  # part of the contact forces below which springs hold nothing


class Springs:
    """The springs of ``bodies``, and of discs of ``contact``. Collective.

    ``forces`` ``(n_owned dofs,)`` are those of the bodies' last displacements, ``on_levels`` ``(d,)`` those of discs,
    and ``work`` what the springs took up, of the modelled part; ``energy`` is its sum over accepted states.
    ``of_free`` is their matrix at a factor of 1, without rows and columns of prescribed displacements.
    """

    def __init__(self, drives: Drives, contact: Contact, bodies: Sequence[Body], stiffness: float) -> None:
        V, self.comm, self.contact, self.factor, self.energy = drives.V, drives.comm, contact, WEAK, 0.0
        u, v, forms = ufl.TrialFunction(V), ufl.TestFunction(V), []
        for body in bodies:
            dx = drives.measure(body.cells or body.name)
            area = drives.integral(fem.Constant(V.mesh, 1.0) * dx)
            modulus = fem.Constant(V.mesh, float(body.material.elastic_tangent[0, 0]) / area)
            forms.append(fem.form(modulus * ufl.inner(u, v) * dx))
        self._matrix = matrix(V, forms)
        assemble(self._matrix, forms)
        self._matrix.assemble()
        fixed = 2 * V.dofmap.index_map.local_range[0] + np.flatnonzero(drives.fixed[: drives.n_owned])
        self.of_free = self._matrix.copy()
        self.of_free.zeroRowsColumns(fixed.astype(PETSc.IntType), 0.0)
        self._x, self._y = self._matrix.createVecs()
        self.of_levels: Array = np.zeros(len(drives.rate))
        for disc in contact.rigid:
            self.of_levels += stiffness * (disc.rate**2).sum(axis=1)
        self.last: tuple[Array, Array] = np.zeros(2 * drives.n_owned), np.zeros(len(drives.rate))

    def pull(self, u: Array) -> Array:
        """Forces ``(n_owned dofs,)`` of displacements ``u``, alike, on the bodies' springs."""
        self._x.array[:] = u
        self._matrix.mult(self._x, self._y)
        return self.factor * self._y.array_r

    def evaluate(self, u: Array, levels: Array) -> None:
        """Forces and work at the displacements ``u`` ``(n_owned dofs,)`` and drives' ``levels`` ``(d,)``."""
        self._now, moved, turned = (u.copy(), levels.copy()), u - self.last[0], levels - self.last[1]
        self.forces, self.on_levels = self.pull(moved), self.factor * self.of_levels * turned
        self.work = (self.comm.allreduce(float(self.forces @ moved)) + float(self.on_levels @ turned)) / 2

    def commit(self) -> None:
        """Accept the last evaluation: the springs rest there."""
        self.last, self.energy = self._now, self.energy + self.work

    @property
    def idle(self) -> bool:
        """Whether contact holds what the springs do not, at the last evaluation."""
        forces = np.abs(self.forces).sum(), sum(float(np.abs(pair.forces).sum()) for pair in self.contact.pairs)
        pulled, pressed = self.comm.allreduce(np.array(forces))
        return bool(pulled + np.abs(self.on_levels).sum() < _LITTLE * pressed)

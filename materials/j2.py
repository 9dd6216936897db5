"""J2 plasticity with isotropic hardening as a material; its mechanics are in return_map.py."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from archord.materials.elasticity import Elastic
from archord.materials.hardening import Hardening, LinearHardening
from archord.materials.kinematics import Bools
from archord.materials.material import Array, Material
from archord.materials.return_map import PlasticState, radial_return, return_map

NEVER_YIELDS = LinearHardening(np.inf)


@dataclass(frozen=True)
class J2Material(Elastic):
    """Elastic-plastic solid of von Mises with isotropic hardening.

    It is `Elastic` below the von Mises stress that its ``hardening`` gives.

    Parameters
    ----------
    E : float
        Young's modulus. It sets the unit of stress.
    nu : float
        Poisson's ratio.
    plane : {"strain", "stress", "axisymmetric", "space"}
        How displacement becomes strain. The default becomes the problem's kinematics; another
        value must agree with them.
    hardening : LinearHardening, TabularHardening, VoceHardening or SwiftHardening
        The yield stress over PEEQ. Without it the solid never yields.

    Examples
    --------
    >>> import numpy as np
    >>> from archord import J2Material, LinearHardening
    >>> steel = J2Material(210e3, 0.3, hardening=LinearHardening(355.0, modulus=1000.0))
    >>> start = steel.state(1)
    >>> stress, _, state = steel.update(np.array([[0.0, 0.0, 0.01]]), start)
    >>> stress.round(1).tolist(), steel.peeq(state).round(5).tolist()
    ([[0.0, 0.0, 0.0, 207.4]], [0.00429])
    >>> steel.flows(start, state).tolist()
    [True]
    """

    yields = True

    hardening: Hardening = NEVER_YIELDS

    def elastic(self) -> Material:
        """The solid with a yield stress out of reach."""
        return replace(self, hardening=NEVER_YIELDS)

    def state(self, n: int) -> PlasticState:
        """``n`` points that never yielded."""
        return PlasticState(np.zeros((n, self.kinematics.n_stress)), np.zeros(n))

    def update(self, strain: Array, state: PlasticState) -> tuple[Array, Array, PlasticState]:
        """The return map, in C where it has a closed form."""
        linear = self.hardening.linear
        if linear is not None and not self.kinematics.is_thin:
            return radial_return(strain, state, self, *linear)
        return return_map(strain, state, self, self.hardening)

    def flows(self, old: PlasticState, new: PlasticState) -> Bools:
        """The points ``(n,)`` whose PEEQ has grown."""
        return new.peeq > old.peeq

    def centre(self, state: PlasticState) -> Array | float:
        """The middle of the elastic range, a deviator ``(n, n_stress)``."""
        return 0.0

    def stiffening(self, old: PlasticState, new: PlasticState) -> Array | float:
        """By how much the middle moves per PEEQ at the end of a step, as a stress ``(n,)`` in
        tension."""
        return 0.0

    def dissipation(self, state: PlasticState) -> Array:
        """Plastic work density ``(n,)``."""
        return self.hardening.work(state.peeq)

    def peeq(self, state: PlasticState) -> Array:
        """PEEQ ``(n,)``."""
        return state.peeq

"""Damping and friction of an exported force element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Contact:
    """Damping and friction that an exported force element has unless it is told others.

    Parameters
    ----------
    damping : float
        c of the factor ``1 + c d(delta)/dt`` of the force.
    mu_static, mu_dynamic : float
        The coefficients of friction, of which the static one is not smaller.
    stick_speed : float
        The slip speed up to which friction rises.

    Raises
    ------
    ValueError
        For values that no contact has.

    Examples
    --------
    >>> from archord.postprocess.laws.exports.contact import Contact
    >>> Contact(mu_static=0.2, mu_dynamic=0.15, stick_speed=1.0).damping
    0.0
    """

    damping: float = 0.0
    mu_static: float = 0.0
    mu_dynamic: float = 0.0
    stick_speed: float = 1.0

    def __post_init__(self) -> None:
        """Check the values."""
        if not 0 <= self.damping < np.inf:
            raise ValueError(f"damping = {self.damping:g} must be a number that is not negative.")
        if not 0 <= self.mu_dynamic <= self.mu_static < np.inf:
            raise ValueError(
                f"friction of {self.mu_static:g} (static) and {self.mu_dynamic:g} (dynamic): the "
                "dynamic one must not be negative, and the static one not smaller."
            )
        if not 0 < self.stick_speed < np.inf:
            raise ValueError(f"stick_speed = {self.stick_speed:g} must be a positive number.")

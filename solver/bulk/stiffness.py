"""Bilinear forms of cells: the stiffness of moduli, given once or at each integration point.

dolfinx assembles them by one kernel of archord's for all cells, orders and kinematics. A form in
UFL would be compiled for each of them, which takes half a second.
"""

from __future__ import annotations

from pathlib import Path

import basix
import numpy as np
from dolfinx import fem

from archord.geometry.basis import Array, displacement_element, table_of, tabulate
from archord.kernels.compat import cell_degree, cell_form
from archord.kernels.compiled import address
from archord.materials.kinematics import Ints, Kinematics

_SOURCE = Path(__file__).with_name("stiffness.c")


class CellStiffness:
    """The integrals of ``B^T C B`` over cells, where ``B`` takes displacements in ``V`` to ``k``
    strains, by the ``rule`` of a degree.

    Parameters
    ----------
    terms : (t, 3) array of int
        A component of the displacement, a derivative, and the strain that gets their product.
        Derivatives behind the axes are the quotient by the radius, and the value itself.
    moduli : (k, k) array or Function
        ``C``, or its values at the integration points of all cells.
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        kinematics: Kinematics,
        rule: int,
        terms: np.ndarray,
        moduli: Array | fem.Function,
    ) -> None:
        self.V = V
        cell = V.mesh.basix_cell()
        X, weight = basix.make_quadrature(cell, rule)
        nodes = tabulate(cell, cell_degree(V.mesh), X)
        basis = table_of(displacement_element(cell, V.element.basix_element.degree), X)
        swept = kinematics.measure(np.ones((1, 1)))  # the kernel multiplies by the radius
        self._functions = [moduli] if isinstance(moduli, fem.Function) else []
        k = 1 + int(terms[:, 2].max())
        sizes = [len(weight), basis.shape[-1], nodes.shape[-1], X.shape[1], k, len(terms)]
        sizes += [kinematics.has_hoop, bool(self._functions)]
        parts = [sizes, terms, swept * weight, nodes, basis]
        if not self._functions:
            parts.append(moduli)
        packed = np.concatenate([np.ravel(part) for part in parts]).astype(float)
        self._constants = fem.Constant(V.mesh, packed)

    def over(self, cells: Ints) -> fem.Form:
        """The form over these ``cells``, of this rank."""
        kernel = address(_SOURCE, "stiffness")
        return cell_form(self.V, kernel, cells, self._functions, [self._constants])


def value_terms(d: int) -> np.ndarray:
    """The terms ``(d, 3)`` with which the "strains" are the ``d`` components of the
    displacement."""
    components = np.arange(d)
    return np.column_stack([components, np.full(d, d + 1), components])

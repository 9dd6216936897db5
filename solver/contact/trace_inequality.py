"""The trace constant of Nitsche's gamma: how large the traction on a facet can be for the elastic
energy of its cell.

Warburton and Hesthaven (2003) give the constant for polynomials; here the generalised eigenvalue
problem of each contact cell is solved, with its curved geometry and its elastic moduli.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.strain import PointStrain
from archord.materials.kinematics import Kinematics

_TOGETHER = 500  # cells: products of all at once would need more memory than anything else


def trace_constants(
    moduli: Array,
    kinematics: Kinematics,
    in_cell: tuple[PointStrain, Array],
    on_facet: tuple[PointStrain, Array],
    outward: Array,
) -> tuple[Array, Array]:
    """Smallest ``gamma`` ``(n,)`` with ``|sigma_n(v)|^2 over a facet <= gamma a(v, v) over its
    cell``, any ``v``; and the same of the shear, whose components in space count together. Unit:
    stress / length.

    Strains come with the weights ``(n, q)`` of their points; ``outward`` ``(n, q, d)`` are the
    normals on the facet.
    """
    energy = _energies(moduli, *in_cell)

    force = np.moveaxis(kinematics.traction(outward), 2, 0)  # (d, n, q, k)
    n = np.moveaxis(outward, -1, 0)[..., None]
    axes = range(kinematics.dimension)
    normal = sum(n[i] * force[i] for i in axes)
    shears = [n[i] * force[j] - n[j] * force[i] for i, j in combinations(axes, 2)]
    of_strain = np.stack([normal, *shears])
    strain, weight = on_facet
    of_nodes = np.einsum("inqk,nqka->inqa", of_strain @ moduli, strain.matrix())
    traces = np.swapaxes(of_nodes, 2, 3) @ (weight[..., None] * of_nodes)

    value, vector = np.linalg.eigh(energy)
    rigid = kinematics.n_rigid
    scaled = vector[..., rigid:] / np.sqrt(value[:, None, rigid:])
    traces = np.stack([traces[0], traces[1:].sum(axis=0)])
    ratios = np.linalg.eigvalsh(np.swapaxes(scaled, 1, 2) @ traces @ scaled)
    of_normal, of_shear = ratios[..., -1]
    return of_normal, of_shear


def _energies(moduli: Array, strain: PointStrain, weight: Array) -> Array:
    """The elastic energies ``(n, b, b)`` of the cells as quadratic forms."""
    B = strain.matrix()
    parts = range(0, max(len(B), 1), _TOGETHER)  # ranks may have no cells
    together = [slice(first, first + _TOGETHER) for first in parts]
    return np.concatenate(
        [
            np.einsum("nq,nqia,ij,nqjb->nab", weight[some], B[some], moduli, B[some], optimize=True)
            for some in together
        ]
    )

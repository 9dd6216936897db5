"""The consistent linearisation of the contact forces: matrix entries of one pairing, vectorised over its points.

With ``jump = v(x) - v(y)``, the variation of the closest point is ``d xi = (jump . tau + d . v'(y)) / (|tau|^2 - g
b)``, where ``tau`` and ``b`` are the opposite curve's tangent and ``n . y''`` and ``d = x - y``; the normal turns by
``-(v'(y) . n + b d xi) / |tau|`` about the unit tangent. At a vertex of the curve ``xi`` stands still.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from archord.geometry.basis import Array
from archord.solver.contact_pairing import Pairing
from archord.solver.contact_side import ContactSide


class _Basis(NamedTuple):
    """Shape functions at the ``m`` active points: own cell's ``a`` nodes, then the opposite facet's ``k``."""

    jump: Array  # (m, a + k) of v(x) - v(y)
    slope: Array  # (m, a + k) of v'(y): zero for the own cell
    rows: Array  # (m, r + k) as jump, for the own cell's nodes on the facet only
    slope_rows: Array  # (m, r + k)


def entries(pair: Pairing) -> tuple[np.ndarray, np.ndarray, Array]:
    """Derivative of the residual: blocks ``(n, 2, 2)`` at ``rows`` and ``columns`` ``(n,)`` in global block dofs.

    A rigid opposite is the block dof behind the last. Returns ``(rows, columns, blocks)``.
    """
    on = np.flatnonzero(pair.active)
    side, P = pair.side, pair.projection
    facet = on // side.weight.shape[1]
    shape = side.shape.reshape(-1, side.shape.shape[2])[on]
    trace = np.take_along_axis(shape, side.trace[facet], axis=1)
    none = np.zeros_like
    basis = _Basis(
        np.concatenate([shape, -P.shape[on]], axis=1),
        np.concatenate([none(shape), P.slope[on]], axis=1),
        np.concatenate([trace, -P.shape[on]], axis=1),
        np.concatenate([none(trace), P.slope[on]], axis=1),
    )
    block = _tied(pair, on, basis) if pair.kinematics == "tied" else _pressed(pair, on, basis)
    block *= -(pair.share * side.weight.ravel()[on])[:, None, None, None, None]

    if isinstance(pair.opposite, ContactSide):
        opposite = pair.opposite.curve_dofs[P.nodes[on]]
    else:
        opposite = np.full((len(on), 1), side.V.dofmap.index_map.size_global)
    own_rows = np.take_along_axis(side.cell_global[facet], side.trace[facet], axis=1)
    rows = np.concatenate([own_rows, opposite], axis=1)
    columns = np.concatenate([side.cell_global[facet], opposite], axis=1)
    return (
        np.repeat(rows, columns.shape[1], axis=1).ravel(),
        np.tile(columns, (1, rows.shape[1])).ravel(),
        block.reshape(-1, 2, 2),
    )


def _tied(pair: Pairing, on: np.ndarray, basis: _Basis) -> Array:
    """Derivative ``(m, r + k, a + k, 2, 2)`` of ``jump . (t - gamma [[u]])``."""
    rows = _traction_rows(pair, on)
    change = np.zeros((*basis.jump.shape, 2, 2))
    change[:, : rows.shape[2]] = rows.swapaxes(1, 2)
    for i in range(2):
        change[:, :, i, i] -= pair.gamma[on, None] * basis.jump
    return basis.rows[:, :, None, None, None] * change[:, None]


def _pressed(pair: Pairing, on: np.ndarray, basis: _Basis) -> Array:
    """Derivative ``(m, r + k, a + k, 2, 2)`` of ``p n . (v(x) - v(y))`` with ``p = t . n - gamma g``."""
    P, gamma, p = pair.projection, pair.gamma[on], pair.pressure[on]
    n = P.normal[on]
    rows = np.einsum("mi,miaj->maj", n, _traction_rows(pair, on))
    dp = -gamma[:, None, None] * basis.jump[:, :, None] * n[:, None, :]
    dp[:, : rows.shape[1]] += rows
    along_n = basis.rows[:, :, None] * n[:, None, :]
    if pair.kinematics == "reference":
        return _outer(along_n, dp)

    tau, d, bend = P.tangent[on], pair.separation[on], P.bend[on]
    speed = np.linalg.norm(tau, axis=1)
    unit = tau / speed[:, None]
    d_xi = basis.jump[:, :, None] * tau[:, None, :] + basis.slope[:, :, None] * d[:, None, :]
    d_xi *= (P.slides[on] / (speed**2 - pair.gap[on] * bend))[:, None, None]
    turn = (basis.slope[:, :, None] * n[:, None, :] + bend[:, None, None] * d_xi) / speed[:, None, None]
    # p follows the turning normal through t . n and, where y is a vertex, through the gap
    lever = gamma * (d * unit).sum(1) - (pair.traction[on] * unit).sum(1)
    dp += lever[:, None, None] * turn
    along_unit = p[:, None, None] * basis.rows[:, :, None] * unit[:, None, :]
    sliding = p[:, None, None] * basis.slope_rows[:, :, None] * n[:, None, :]
    block = _outer(along_n, dp)
    block -= _outer(along_unit, turn)
    block -= _outer(sliding, d_xi)
    return block


def _traction_rows(pair: Pairing, on: np.ndarray) -> Array:
    """Derivative ``(m, 2, a, 2)`` of the traction ``sigma N`` with respect to the own cell's nodal displacements."""
    N = pair.side.outward.reshape(-1, 2)[on]
    gradient = pair.side.gradient.reshape(-1, *pair.side.gradient.shape[2:])[on]
    zero = np.zeros(len(N))
    projector = np.stack(
        [np.stack([N[:, 0], zero, N[:, 1]], axis=1), np.stack([zero, N[:, 1], N[:, 0]], axis=1)], axis=1
    )
    C = projector @ pair.tangent[on]  # (m, 2, 3)
    gx, gy = gradient[:, None, :, 0], gradient[:, None, :, 1]
    x = C[:, :, 0, None] * gx + C[:, :, 2, None] * gy
    y = C[:, :, 1, None] * gy + C[:, :, 2, None] * gx
    return np.stack([x, y], axis=-1)


def _outer(rows: Array, columns: Array) -> Array:
    """``(m, r, c, 2, 2)`` from ``(m, r, 2)`` and ``(m, c, 2)``."""
    return rows[:, :, None, :, None] * columns[:, None, :, None, :]

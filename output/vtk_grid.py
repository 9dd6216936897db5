"""The bodies as fields.vtkhdf has them: Lagrange cells of the degree of the displacements, lines
for the facets of contact surfaces, and on request a vertex for each integration point."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array, bulk_quadrature, lagrange_element, order_of, tabulate
from archord.geometry.meshes.cells import in_vtk_order
from archord.materials.elasticity import mean_stress, von_mises
from archord.output.files.vtkhdf import LAGRANGE, VERTEX, Grid
from archord.solver.path.mesh_order import Arrays, MeshOrder


class BodyGrid:
    """The ``grid`` of the mesh that `collect_mesh` returned as ``mesh``. ``second`` ``(m, 6 or 9)``
    are the nodes of second-order cells in its place, in basix' order. With ``points`` there is a
    vertex at every integration point."""

    def __init__(self, order: MeshOrder, mesh: Arrays, second: np.ndarray, points: bool) -> None:
        self._nodes, self._second, self._points = order.nodes_of_cell, second, points
        m, n = self._nodes.shape
        kind = order.kind
        degree = order_of(kind, n)
        self._cell_of_facet, *trace = (
            mesh["facets/nodes"].reshape(-1, degree + 2).astype(np.int64).T
        )
        self._facets = np.take_along_axis(
            self._nodes[self._cell_of_facet], np.transpose(trace), axis=1
        )
        self._from_second = tabulate(kind, 2, lagrange_element(kind, degree).points)[0]
        self._at_points = tabulate(kind, degree, bulk_quadrature(kind, degree)[0])[0]
        inner = np.arange(1, degree)
        x, corners = order.coordinates, len(lagrange_element(kind, 1).points)
        cells = [
            (LAGRANGE[corners], in_vtk_order(kind, self._nodes)),
            (LAGRANGE[2], self._facets[:, [0, -1, *inner]]),
        ]
        owner = [np.arange(m), self._cell_of_facet]
        if points:
            places = mesh["points/coordinates"]
            cells.append((VERTEX, len(x) + np.arange(places[..., 0].size)[:, None]))
            owner.append(np.repeat(owner[0], places.shape[1]))
            x = np.concatenate([x, _in_space(places.reshape(-1, 2))])
        self.grid = Grid(x, cells, {"CellData/body": mesh["mesh/body"][np.concatenate(owner)]})

    def values(self, fields: Arrays, nodal: Arrays) -> Arrays:
        """What `collect_fields` returned as VTKHDF names it, with ``nodal`` values of the
        second-order cells: "stress" and "plastic_strain" ``(k, 4)``, "peeq" ``(k,)``.

        Tensors have VTK's components: xx, yy, zz, xy, yz, xz.
        """
        at_nodes = {
            "displacement": _in_space(fields["displacement"]),
            "contact_pressure": self._pressure(fields),
        }
        at_nodes |= {name: self._on_nodes(values) for name, values in nodal.items()}
        at_cells = {
            name: v for name, v in fields.items() if "/" not in name and name != "displacement"
        }
        at_cells |= {
            name.removeprefix("cells/"): _symmetric(v)
            for name, v in fields.items()
            if "cells/" in name
        }
        force, length = np.moveaxis(self._forces(fields).sum(axis=1), -1, 0)
        at_facets = {name: values[self._cell_of_facet] for name, values in at_cells.items()}
        at_facets["contact_pressure"] = force / length
        at_cells = {
            name: np.concatenate([values, at_facets[name]]) for name, values in at_cells.items()
        }
        if self._points:
            points = self._of_points(fields, list(nodal))
            at_nodes = {
                name: np.concatenate([values, points[name]]) for name, values in at_nodes.items()
            }
            at_cells = {
                name: np.concatenate([values, points[name]]) for name, values in at_cells.items()
            }
        found = {f"PointData/{name}": values for name, values in at_nodes.items()}
        return found | {f"CellData/{name}": values for name, values in at_cells.items()}

    def _of_points(self, fields: Arrays, names: list[str]) -> Arrays:
        """The values ``(m q, ...)`` of the integration points, of which those called ``names`` are
        known."""
        found = {name: fields[f"points/{name}"] for name in names}
        found = {
            name: v.reshape(-1) if v.ndim == 2 else _symmetric(v.reshape(-1, 4))
            for name, v in found.items()
        }
        u = np.einsum("qa,mak->mqk", self._at_points, fields["displacement"][self._nodes]).reshape(
            -1, 2
        )
        stress, nothing = fields["points/stress"].reshape(-1, 4), np.zeros(len(u))
        found |= {
            "von_mises": von_mises(stress),
            "mean_stress": mean_stress(stress),
            "displacement": _in_space(u),
        }
        return found | {"contact_pressure": nothing, "contact_state": nothing}

    def _pressure(self, fields: Arrays) -> Array:
        """Contact pressure ``(n,)`` of the nodes: their force over their share of the length, which
        is exact where the pressure is linear; 0 off the contact surfaces."""
        force, length = np.zeros((2, self._nodes.max() + 1))
        for whole, parts in zip(
            (force, length), np.moveaxis(self._forces(fields), -1, 0), strict=True
        ):
            np.add.at(whole, self._facets, parts)
        return np.divide(force, length, out=np.zeros_like(force), where=length > 0)

    def _forces(self, fields: Arrays) -> Array:
        return fields["facets/pressure"].reshape(*self._facets.shape, 2)

    def _on_nodes(self, values: Array) -> Array:
        """Values at the nodes from those ``(k,)`` or ``(k, 4)`` of the second-order cells."""
        whole = np.zeros((self._nodes.max() + 1, *values.shape[1:]))
        whole[self._nodes] = np.einsum("ab,mb...->ma...", self._from_second, values[self._second])
        return _symmetric(whole) if values.ndim == 2 else whole


def _in_space(values: Array) -> Array:
    return np.pad(values, ((0, 0), (0, 1)))


def _symmetric(tensor: Array) -> Array:
    return np.pad(tensor, ((0, 0), (0, 2)))

"""archord's mesh of the joint as arrays in the node order of input decks."""

from __future__ import annotations

import numpy as np
from dolfinx.mesh import entities_to_geometry

from archord.benchmarks.deck import Ints, PlaneMesh
from archord.geometry.quarter_joint import Facets, JointMesh

# dolfinx numbers the midpoint of an edge by the corner opposite to it, Abaqus by the corner it starts from.
_COUNTERCLOCKWISE = [0, 1, 2, 5, 3, 4]
_MIRRORED = [0, 2, 1, 4, 3, 5]
_QUARTERS = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]


def quadratic_triangles(joint: JointMesh) -> PlaneMesh:
    """The mesh that archord solves on, which must live on one rank: triangles of six nodes, midpoints on the arcs."""
    mesh = joint.mesh
    x = mesh.geometry.x[:, :2]
    dofmap = np.asarray(mesh.geometry.dofmap, dtype=np.int64)
    a, b, c = (x[dofmap[:, i]] for i in range(3))
    turn = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    elements = np.where((turn > 0)[:, None], dofmap[:, _COUNTERCLOCKWISE], dofmap[:, _MIRRORED])
    mesh.topology.create_connectivity(1, 2)
    bodies = np.zeros(len(elements), dtype=np.int64)
    bodies[joint.cells.indices] = joint.cells.values
    edges = {
        tag: find_edges(elements, 3, entities_to_geometry(mesh, 1, joint.facets.find(tag))[:, :2]) for tag in Facets
    }
    return PlaneMesh(x.copy(), elements, bodies, edges)


def linear_triangles(mesh: PlaneMesh) -> PlaneMesh:
    """Each six-node triangle of ``mesh`` cut into four of three nodes; the nodes are the same."""
    elements = mesh.elements[:, _QUARTERS].reshape(-1, 3)
    edges = {}
    for tag in mesh.edges:
        first, last, middle = mesh.edge_nodes(tag).T
        edges[tag] = find_edges(elements, 3, np.concatenate([np.c_[first, middle], np.c_[middle, last]]))
    return PlaneMesh(mesh.x, elements, np.repeat(mesh.bodies, 4), edges)


def find_edges(elements: Ints, n_corners: int, ends: Ints) -> Ints:
    """Element and local edge ``(n, 2)`` of the boundary edges with the end nodes ``ends`` ``(n, 2)``, in any order."""
    corners = elements[:, :n_corners]
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    size = elements.max() + 1
    keys, wanted = sides @ [size, 1], np.sort(ends, axis=1) @ [size, 1]
    order = np.argsort(keys)
    found = order[np.searchsorted(keys, wanted, sorter=order)]
    return np.stack([found // n_corners, found % n_corners], axis=1)

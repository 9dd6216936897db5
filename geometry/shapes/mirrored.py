"""Half a mesh in space and its mirror image at z = 0, as one mesh."""

from __future__ import annotations

import numpy as np

from archord.geometry.meshes.cells import corners_of
from archord.geometry.meshes.mesh_arrays import MeshArrays

_SAME = 1e-9  # distance from the mirror over the mesh's size


def mirrored(half: MeshArrays) -> MeshArrays:
    """The mesh ``half`` at z >= 0 and its image, joined at z = 0.

    Sets have both halves. Of each facet set the part above z = 0 and the part below are sets, too:
    "hole above" and "hole below" of "hole". Its nodes at z = 0 are the point set "hole middle".
    Facets that lie at z = 0 are inside the bodies, and in no set. Cells and their images number
    their nodes alike, so that contact points mirror each other, too: determinants of images are
    negative.
    """
    n = len(half.x)
    m = len(half.cells)
    is_middle = np.abs(half.x[:, 2]) < _SAME * np.abs(half.x).max()
    x = half.x.copy()
    x[is_middle, 2] = 0.0
    numbers = np.arange(n)
    image = np.where(is_middle, numbers, n + numbers)
    cell_sets = {}
    for name, tags in half.cell_sets.items():
        members = np.flatnonzero(np.isin(half.bodies, tags))
        cell_sets[name] = np.concatenate([members, m + members])
    facet_sets = {}
    point_sets = {}
    for name in half.facet_sets:
        facets = half.facets_of(name)
        if is_middle[facets].all():
            continue
        corners = corners_of(half.kind, facets)
        facet_sets[name] = np.concatenate([corners, image[corners]])
        facet_sets[f"{name} above"] = corners
        facet_sets[f"{name} below"] = image[corners]
        nodes = np.unique(facets)
        if is_middle[nodes].any():
            point_sets[f"{name} middle"] = nodes[is_middle[nodes]]
    return MeshArrays.of_sets(
        half.kind,
        np.concatenate([x, x * [1.0, 1.0, -1.0]]),
        np.concatenate([half.cells, image[half.cells]]),
        cell_sets,
        facet_sets,
        point_sets,
    )

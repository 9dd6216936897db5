"""What run.json says of a joint: its mesh and model, and what its user should be warned of."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import bulk_quadrature, cell_basis
from archord.presets.arc import ArcProfile
from archord.presets.joint import Joint
from archord.presets.measures import Measures

_FEW_FACETS = 5
_ROUGH = 0.01  # of the clearance
APART = (
    "the bodies never touched: P is 0 in every step, as the load never presses the pin into the hole; give a "
    "displacement or a force above 0 if it should"
)
UNSEEN = (
    "no contact point was ever pressed, though delta was positive: the contact is smaller than the mesh can see; "
    "reduce joint.element_size or increase the load"
)


def facts(joint: Joint) -> dict[str, dict[str, Any]]:
    """Sizes of the mesh, and what was made of the scene."""
    lengths = {name: side.facet_lengths() for name, side in joint.sides.items()}
    mesh = {
        "cells": joint.n_cells,
        "dofs": joint.n_dofs,
        "contact_facets": {name: len(length) for name, length in lengths.items()},
        "element_size_on_arc": {name: [float(length.min()), float(length.max())] for name, length in lengths.items()},
    }
    model = {"E_star": joint.scene.E_star, "contact_shares": [pair.share for pair in joint.contact.pairs]}
    return {"mesh": mesh, "model": model}


def rough_arcs(joint: Joint) -> list[str]:
    """A warning if the parabolic facets depart too much from their circles for the clearance.

    A parabola through ends and middle of an arc of half-angle ``a`` is off by ``R (1 - cos a)^2/8``. Equal facets that
    face each other are off alike, which leaves the gap as it is.
    """
    geometry = joint.scene.joint
    if not joint.scene.pin.rigid and geometry.size_ratio == 1:
        return []
    lengths = [side.facet_lengths().max() for side in joint.sides.values()]
    off = (1 - np.cos(max(lengths) / geometry.radius / 2)) ** 2 / 8 * geometry.radius / abs(geometry.dR)
    if off <= _ROUGH:
        return []
    return [f"the elements on the arcs are too long for the clearance, they depart from the circles by {off:.1g} dR"]


def core_peeq(joint: Joint) -> float:
    """Largest PEEQ within the core of a ring's pin, whose mean displacement is delta; 0 for a block. Collective."""
    if not joint.problem.loads or joint.scene.pin.yield_stress is None:
        return 0.0
    cells, points = joint.bulk.histories()[min(joint.problem.mesh.cell_tags("pin"))]
    X, _ = bulk_quadrature(joint.V.mesh.basix_cell(), joint.bulk.degree)
    x = cell_basis(joint.V.mesh, joint.bulk.degree, cells, X).point
    core = np.linalg.norm(x, axis=-1).ravel() < joint.scene.load.core_radius * joint.scene.joint.radius
    return joint.comm.allreduce(float(np.asarray(points.peeq)[core].max(initial=0.0)), op=MPI.MAX)


def step_warnings(joint: Joint, profiles: dict[str, ArcProfile], m: Measures, residual: float) -> list[str]:
    """What to warn of after the step ``m``, which Newton's method left with a ``residual``. Collective."""
    said, squashed = [], core_peeq(joint)
    if joint.scene.joint.arc_end < np.pi and any(p.in_contact[-1] > 0 for p in profiles.values()):
        said.append("the contact reaches the end of the modelled quarter arc, beyond which it cannot spread")
    touching = max(1, min(int((p.in_contact > 0).sum()) for p in profiles.values()))
    if m.contact_area and touching < _FEW_FACETS:
        facets = "facet" if touching == 1 else "facets"
        said.append(f"only {touching} {facets} in contact; a smaller element_size would resolve it")
    if squashed > 0:
        said.append(
            f"the pin yields where the force is applied, with PEEQ up to {squashed:.1e} in its core, and delta, the "
            "mean displacement of the core, contains by how much it is squashed there; a larger load.core_radius would "
            "spread the force"
        )
    if abs(m.delta) > 0.1 * joint.scene.joint.radius:
        said.append("delta exceeds 0.1 R, too much for small-strain theory")
    if residual > 1e-8 and m.contact_area:
        said.append(f"round-off limits the residual to {residual:.1e} of the reaction")
    if m.force_balance > 1e-8:
        said.append(f"forces at pin, contact and block differ by {m.force_balance:.1e} of P")
    return said

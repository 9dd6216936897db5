"""The joint of a scene as a problem to solve.

Half of the joint is modelled, cut at its symmetry axis. "block" is the paper's quarter joint,
pressed at the pin's horizontal diameter; "ring" is half a whole pin in a ring, loaded by a force at
the pin's core (Persson's joint).
"""

from __future__ import annotations

import math

import numpy as np
from mpi4py import MPI

from archord.geometry.curve import RigidCircle
from archord.geometry.shapes.pin_in_block import pin_joint
from archord.materials.kinematics import kinematics
from archord.presets.arc import SYMMETRY
from archord.scene.presets.joint import Scene
from archord.solver.core_load import core_density
from archord.solver.problem import (
    Body,
    DeadLoad,
    Dirichlet,
    Drive,
    Guess,
    Interaction,
    Problem,
    Rigid,
)

_RATIO = 3.0  # element size over the size of the next finer mesh
_COARSEST = 0.2  # element size over R
_STEEPEST = 1.0  # growth of the element size


def joint_problem(scene: Scene, comm: MPI.Comm, partitioner=None) -> Problem:
    """The problem that ``scene`` states; ``partitioner`` as for `mesh_joint`. Collective over
    ``comm``.

    Raises `InputError` if the scene leaves the mesh open.
    """
    scene.require_mesh()
    g = scene.joint
    analysis = scene.analysis
    by_force = scene.force_controlled
    ring = g.is_ring
    rigid = scene.pin.rigid
    stiffness = (
        scene.E_star * scene.thickness if by_force else 1.0
    )  # by which a load is about a displacement
    supports = [
        Dirichlet("axis", "symmetry", 0),
        *(Dirichlet("block", "block held", axis) for axis in (0, 1)),
    ]
    if not rigid and not ring:
        supports.append(Dirichlet("pin", "pin top", 1, -1.0))
    travel = abs(g.dR) + max(map(abs, scene.targets)) / stiffness
    contact = Interaction(
        "contact",
        (
            Rigid(RigidCircle(np.array([0.0, -g.dR]), g.radius), (0.0, -1.0)) if rigid else "pin",
            "hole",
        ),
        friction=analysis.friction,
        kinematics=analysis.kinematics,
        gamma_factor=analysis.gamma_factor,
        integrated={"both": "", "pin": "pin", "block": "hole"}[analysis.integration],
        slide=travel - abs(g.dR),
    )

    core = core_density((0.0, 0.0), scene.load.core_radius * g.radius)
    drawn = g.arguments() | {"pin": "whole" if scene.pin.whole else "half"}
    if rigid:
        drawn["pin"] = "none"
    drawn["core_radius"] = scene.load.core_radius
    mesh = pin_joint(comm, degree=analysis.degree, partitioner=partitioner, **drawn)

    def guess(load: float) -> Guess:
        """The pin moved by the load, or by about what a force would press it, from where it touches
        on that side, the block at rest."""
        first_touch = math.copysign(max(g.dR, 0.0), load) if ring else 0.0
        shift = load / stiffness + first_touch
        return Guess(shift, {"pin": (0.0, -shift)})

    return Problem(
        mesh,
        [
            Body(name, solid.constitutive(analysis.plane, analysis.strain))
            for name, solid in scene.solids.items()
        ],
        [contact],
        supports,
        [DeadLoad("pin", (0.0, -1.0), core)] if ring else [],
        drives=[Drive("", control="force")] if by_force and not ring else [],
        degree=analysis.degree,
        symmetry=SYMMETRY,
        load_name="P" if by_force else "delta",
        travel=travel,
        tolerance=analysis.tolerance,
        max_iterations=analysis.max_iterations,
        guess=guess,
        from_rest=g.dR > 0,
        kinematics=kinematics(analysis.plane),
        thickness=scene.thickness,
        coarser=(lambda: joint_problem(_coarser(scene), comm)) if analysis.coarse_start else None,
    )


def _coarser(scene: Scene) -> Scene:
    """``scene`` on a mesh with elements `_RATIO` times as large, all over."""
    g = scene.joint
    sizes = {
        "element_size": max(g.h, min(_RATIO * g.h, _COARSEST * g.radius)),
        "relative_element_size": None,
        "growth": max(g.growth, min(_RATIO * g.growth, _STEEPEST)),
    }
    return scene.model_copy(update={"joint": g.model_copy(update=sizes)})

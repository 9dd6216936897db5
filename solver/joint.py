"""The joint of a scene as a problem to solve: meshes, bodies, contact and supports."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.curve import RigidCircle
from archord.geometry.joint_mesh import Cells, Facets, JointMesh
from archord.geometry.quarter_joint import quarter_joint
from archord.solver.bulk import Body, Bulk
from archord.solver.contact import Contact
from archord.solver.contact_side import ContactSide
from archord.solver.equilibrium import Equilibrium, Support
from archord.solver.scene import Scene
from archord.solver.timer import Timer

SIDES = ("pin", "hole")


class Joint:
    """Half a joint, cut at its symmetry axis, ready to be loaded; forces and energies are reported for the whole.

    ``sides`` holds the contact edges by name ("pin" unless it is rigid, and "hole"). Collective over ``comm``.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm, *, timer: Timer | None = None, partitioner=None) -> None:
        self.scene, self.comm = scene, comm
        self.timer = timer or Timer()
        geometry, analysis = scene.joint, scene.analysis
        with self.timer("mesh"):
            self.model: JointMesh = quarter_joint(
                comm,
                geometry.radius,
                geometry.dR,
                geometry.W,
                geometry.h,
                geometry.growth,
                rigid_pin=scene.pin.rigid,
                partitioner=partitioner,
            )
        with self.timer("setup"):
            self.V = fem.functionspace(self.model.mesh, ("Lagrange", 2, (2,)))
            solids = {Cells.PIN: scene.pin.solid, Cells.BLOCK: scene.block}
            materials = {tag: s.material(analysis.plane) for tag, s in solids.items() if s is not None}
            self.bulk = Bulk(self.V, self.model.cells, [Body(tag, m) for tag, m in materials.items()])
            self.sides: dict[str, ContactSide] = {}
            for name, cells, facets in zip(SIDES, Cells, (Facets.PIN_ARC, Facets.HOLE_ARC), strict=True):
                if cells in materials:
                    self.sides[name] = ContactSide(self.V, self.model.facets, facets, materials[cells])
            rigid = RigidCircle(np.array([0.0, -geometry.dR]), geometry.radius) if scene.pin.rigid else None
            one_sided = {"both": None, "pin": 0, "block": len(self.sides) - 1}[analysis.integration]
            self.contact = Contact(
                list(self.sides.values()),
                rigid=rigid,
                kinematics=analysis.kinematics,
                gamma_factor=analysis.gamma_factor,
                one_sided=one_sided,
            )
            self.equilibrium = Equilibrium(
                self.V,
                self.bulk,
                self._supports(),
                self.contact,
                None if rigid is None else np.array([0.0, -1.0]),
                tolerance=analysis.tolerance,
                max_iterations=analysis.max_iterations,
                timer=self.timer,
            )

    def _supports(self) -> list[Support]:
        supports = [
            Support("axis", 0, self._nodes(Facets.SYMMETRY)),
            Support("block", 0, self._nodes(Facets.BLOCK_HELD)),
            Support("block", 1, self._nodes(Facets.BLOCK_HELD)),
        ]
        if not self.scene.pin.rigid:
            supports.append(Support("pin", 1, self._nodes(Facets.PIN_TOP), -1.0))
        return supports

    def _nodes(self, tag: Facets) -> np.ndarray:
        return fem.locate_dofs_topological(self.V, 1, self.model.facets.find(tag))

    def rigid_translation(self, delta: float) -> Array:
        """Nodal displacements ``(n, 2)`` of this rank with the pin moved down by ``delta`` and the block at rest."""
        u = np.zeros((self.equilibrium.n_local, 2))
        if not self.scene.pin.rigid:
            cells = self.model.cells.find(Cells.PIN)
            u[np.unique(self.V.dofmap.list[cells]), 1] = -delta
        return u

    def forces(self) -> dict[str, float]:
        """Downward force of the whole joint at pin, contact and block's support, per unit thickness."""
        contact = -2 * self.contact.resultant()[1]
        block = 2 * self.equilibrium.reaction("block")[1]
        pin = contact if self.scene.pin.rigid else -2 * self.equilibrium.reaction("pin")[1]
        return {"pin": pin, "contact": contact, "block": block}

    @property
    def n_dofs(self) -> int:
        """Number of displacement dofs, prescribed ones included."""
        return 2 * self.V.dofmap.index_map.size_global

    @property
    def n_cells(self) -> int:
        """Number of triangles."""
        return self.model.mesh.topology.index_map(2).size_global

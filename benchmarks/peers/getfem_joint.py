"""The paper's quarter joint by GetFEM: ``python3 getfem_joint.py --case plastic --steps 20 --output
r.json``.

Needs Debian's python3-getfem and python3-gmsh, and nothing of archord but `joint_script` beside it.

- Bodies: curved second-order triangles (gmsh's, nodes on the circles), P2 displacements.
- Contact: kinematics "current", GetFEM's integral large sliding contact brick with raytracing from
the pin's deformed
  arc: augmented Lagrangian, P1 multipliers there, augmentation E*/h (Poulios and Renard 2015).
- Plasticity: GetFEM's brick "plane strain Prandtl Reuss" (J2, perfect, backward Euler, return
mapping).
- GetFEM's Newton solver with its sequential MUMPS.
"""

from __future__ import annotations

import re
from pathlib import Path

import getfem as gf
import numpy as np
from joint_script import (
    BLOCK,
    DR,
    ITERATIONS,
    LAME,
    MU,
    PIN,
    SIGY,
    axis_pressure,
    main,
    mesh_bodies,
)

# regions; LOADED is the pin's top and the block's held edge
ARC = 1
LOADED = 2
AXIS = 3


def mesh_body(body: tuple[float, float], size: float, growth: float):
    """The pin or the block as a GetFEM mesh of second-order triangles with its regions."""
    points, cells = mesh_bodies(size, growth, body)
    # gmsh: corners, then midpoints; GetFEM: row by row.
    cells = cells[:, [0, 3, 1, 5, 4, 2]]
    made = gf.Mesh("empty", 2)
    made.add_convex(gf.GeoTrans("GT_PK(2,2)"), points[cells].transpose(2, 1, 0))
    (px, py) = made.pts()
    (y, radius) = body
    on_arc = np.abs(np.hypot(px, py - y) - radius) < 1e-9
    for region, on in ((ARC, on_arc), (LOADED, np.abs(py - y) < 1e-9), (AXIS, np.abs(px) < 1e-9)):
        made.set_region(region, made.faces_from_pid(made.pid()[on]))
    return made


class Joint:
    """GetFEM's model of half of the joint below the pin's diameter."""

    def __init__(self, size: float, growth: float, order: int, plastic: bool) -> None:
        self.md = md = gf.Model("real")
        self.laws = []
        self.kept = []  # a model does not keep what it consists of alive
        for name, value in (("lambda", LAME), ("mu", MU), ("sigY", 1e9), ("r", 1 / size)):
            md.add_initialized_data(name, [value])
        meshes = {
            name: mesh_body(body, size, growth) for name, body in (("pin", PIN), ("block", BLOCK))
        }
        for name, mesh in meshes.items():
            u = f"u_{name}"
            mf = self._space(mesh, 2)
            mim = self._points(mesh, 2)
            md.add_fem_variable(u, mf)
            if plastic:
                md.add_fem_data(f"Previous_{u}", mf)
                scalar = gf.MeshImData(mim, -1, [1])
                tensor = gf.MeshImData(mim, -1, [2, 2])
                self.kept += [scalar, tensor]
                md.add_im_data(f"xi_{name}", scalar)
                md.add_im_data(f"Previous_xi_{name}", scalar)
                md.add_im_data(f"Ep_{name}", tensor)
                data = f"xi_{name}", f"Ep_{name}", "lambda", "mu", "sigY", "1", "1"
                self.laws.append((mim, "plane strain Prandtl Reuss", 0, u, *data))
                md.add_small_strain_elastoplasticity_brick(*self.laws[-1])
            else:
                md.add_isotropic_linearized_elasticity_brick(mim, u, "lambda", "mu")
            self._hold(mesh, name, "axis", AXIS)
        md.add_Dirichlet_condition_with_simplification("u_block", LOADED)
        self._hold(meshes["pin"], "pin", "top", LOADED)

        self.arc = self._points(meshes["pin"], 6)
        self.multipliers = self._space(meshes["pin"], 2, degree=1)
        md.add_filtered_fem_variable("pressure", self.multipliers, ARC)
        contact = md.add_integral_large_sliding_contact_brick_raytracing("r", 20 * DR)
        md.add_slave_contact_boundary_to_large_sliding_contact_brick(
            contact, self.arc, ARC, "u_pin", "pressure"
        )
        hole = self._points(meshes["block"], 6)
        md.add_master_contact_boundary_to_large_sliding_contact_brick(contact, hole, ARC, "u_block")
        self.dofs = md.nbdof()
        self.zero = md.from_variables()

    def _space(self, mesh, components: int, degree: int = 2):
        self.kept.append(gf.MeshFem(mesh, components))
        self.kept[-1].set_fem(gf.Fem(f"FEM_PK(2,{degree})"))
        return self.kept[-1]

    def _points(self, mesh, degree: int):
        self.kept.append(gf.MeshIm(mesh, gf.Integ(f"IM_TRIANGLE({degree})")))
        return self.kept[-1]

    def _hold(self, mesh, name: str, what: str, region: int) -> None:
        """Prescribe the normal displacement on a straight edge, with multipliers."""
        force = f"{what}_force_{name}"
        value = f"{what}_{name}"
        self.md.add_filtered_fem_variable(force, self._space(mesh, 1), region)
        self.md.add_initialized_data(value, [0.0])
        points = self._points(mesh, 4)
        self.md.add_normal_Dirichlet_condition_with_multipliers(
            points, f"u_{name}", force, region, value
        )

    def elastic(self, delta: float):
        """The state at ``delta`` of bodies that do not yield; from then on they do."""
        # Not quite rigid: the tangent of the plasticity brick is undefined where there is no
        # deviatoric strain.
        for name, shift in (("u_pin", -1.0), ("u_block", 0.0)):
            y = self.md.mesh_fem_of_variable(name).basic_dof_nodes()[1]
            self.md.set_variable(
                name, delta * np.where(np.arange(len(y)) % 2, shift + 1e-6 * y, 0.0)
            )
        found = self.solve(self.md.from_variables(), delta)[0]
        self.md.set_variable("sigY", [SIGY])
        return found

    def solve(self, guess, delta: float):
        """State of equilibrium from ``guess`` on, and iterations."""
        self.md.set_variable("top_pin", [-delta])
        self.md.to_variables(guess)
        limits = ("max_iter", ITERATIONS, "max_res", 1e-10, "diverged_res", 1e2)
        search = ("lsolver", "mumps", "lsearch", "simplest", "alpha min", 0.3)
        iterations, converged = self.md.solve(*limits, *search)
        if not converged:
            raise RuntimeError("no equilibrium")
        return self.md.from_variables(), int(iterations)

    def commit(self) -> None:
        """Take over the plastic strain of the present displacement."""
        for law in self.laws:
            self.md.small_strain_elastoplasticity_next_iter(*law)

    def results(self) -> dict[str, float | None]:
        """Force of the whole joint, and pressure on the axis from the multipliers."""
        force = 2 * gf.asm("generic", self.arc, 0, "pressure(2)", ARC, self.md)
        x, y = self.multipliers.basic_dof_nodes()[:, self.multipliers.basic_dof_on_region(ARC)][
            :, ::2
        ]
        pressure = np.hypot(*self.md.variable("pressure").reshape(-1, 2).T)
        return {"P": float(force), "p0": axis_pressure(np.arctan2(x, -y - DR), pressure)}


if __name__ == "__main__":
    gf.util_trace_level(0)
    gf.util_warning_level(0)
    version = re.search(
        r"libgetfem\.so\.(\S+)", Path("/proc/self/maps").read_text()
    )  # the Python package has none
    main(Joint, "current", version[1] if version else "unknown")

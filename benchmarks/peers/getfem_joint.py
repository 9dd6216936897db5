"""The paper's quarter joint by GetFEM: ``python3 getfem_joint.py --case plastic --steps 20 --output r.json``.

Needs Debian's python3-getfem and python3-gmsh, and nothing of archord. Units: R = 1, E* = 1.

- Bodies: curved second-order triangles (gmsh's, nodes on the circles), P2 displacements, small strains, plane strain.
  Elements have the size h on the arcs and grow by 0.25 times the distance from there, below h = 0.04 by 6.25 h times.
- Contact: kinematics "current", GetFEM's integral large sliding contact brick with raytracing from the pin's deformed
  arc to the hole's, without friction: augmented Lagrangian, P1 multipliers on the pin's arc, augmentation E*/h
  (Poulios and Renard 2015).
- Plasticity: GetFEM's brick "plane strain Prandtl Reuss" (J2, perfect, backward Euler, return mapping).
- GetFEM's Newton solver with its sequential MUMPS; where it fails, the step is cut.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path

import numpy as np

R, DR, WIDTH, NU = 1.0, 0.005, 100.0, 0.3
E = 2 * (1 - NU**2)
MU, LAME = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
SIGY = 0.002
TOLERANCE, FAR, ITERATIONS, CUTS = 1e-10, 1e2, 25, 6
ARC, LOADED, AXIS = 1, 2, 3  # regions; LOADED is the pin's top and the block's held edge


def mesh_body(name: str, size: float, growth: float):
    """The pin or the block as a GetFEM mesh of second-order triangles with its regions."""
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    geo = gmsh.model.geo
    y, radius = (-DR, R) if name == "pin" else (0.0, R + DR)
    centre, bottom, side = (geo.addPoint(*p, 0) for p in ((0, y), (0, y - radius), (radius, y)))
    outer = [(WIDTH, 0), (WIDTH, -WIDTH), (0, -WIDTH)]
    corners = [side, *([centre] if name == "pin" else (geo.addPoint(*p, 0) for p in outer)), bottom]
    arc = geo.addCircleArc(bottom, centre, side)
    geo.addPlaneSurface([geo.addCurveLoop([arc, *map(geo.addLine, corners[:-1], corners[1:])])])
    geo.mesh.setTransfiniteCurve(arc, round(np.pi / 2 / size) + 1)
    geo.synchronize()
    field = gmsh.model.mesh.field.add("MathEval")
    gmsh.model.mesh.field.setString(field, "F", f"{size} + {growth} * Abs(Sqrt(x*x + y*y) - {R + DR})")
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    for option in ("MeshSizeFromPoints", "MeshSizeExtendFromBoundary"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.model.mesh.generate(2)
    tags, x, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, dtype=int)
    place[tags] = np.arange(len(tags))
    # gmsh: corners, then midpoints; GetFEM: row by row.
    cells = place[gmsh.model.mesh.getElementsByType(9)[1].reshape(-1, 6)[:, [0, 3, 1, 5, 4, 2]].astype(int)]
    points = x.reshape(-1, 3)[:, :2]
    gmsh.finalize()

    mesh = gf.Mesh("empty", 2)
    mesh.add_convex(gf.GeoTrans("GT_PK(2,2)"), points[cells].transpose(2, 1, 0))
    px, py = mesh.pts()
    on_arc = np.abs(np.hypot(px, py - y) - radius) < 1e-9
    for region, on in ((ARC, on_arc), (LOADED, np.abs(py - y) < 1e-9), (AXIS, np.abs(px) < 1e-9)):
        mesh.set_region(region, mesh.faces_from_pid(mesh.pid()[on]))
    return mesh


class NoConvergence(RuntimeError):
    """GetFEM's Newton method found no equilibrium."""


class Joint:
    """GetFEM's model of half of the joint below the pin's diameter."""

    def __init__(self, size: float, growth: float, plastic: bool) -> None:
        self.md = md = gf.Model("real")
        self.meshes = {name: mesh_body(name, size, growth) for name in ("pin", "block")}
        self.laws: list[tuple] = []
        self.kept: list = []  # a model does not keep what it consists of alive
        for name, value in (("lambda", LAME), ("mu", MU), ("sigY", 1e9), ("r", 1 / size)):
            md.add_initialized_data(name, [value])
        for name, mesh in self.meshes.items():
            u = f"u_{name}"
            mf = gf.MeshFem(mesh, 2)
            mf.set_fem(gf.Fem("FEM_PK(2,2)"))
            mim = gf.MeshIm(mesh, gf.Integ("IM_TRIANGLE(2)"))
            self.kept += [mf, mim]
            md.add_fem_variable(u, mf)
            if plastic:
                md.add_fem_data(f"Previous_{u}", mf)
                scalar, tensor = gf.MeshImData(mim, -1, [1]), gf.MeshImData(mim, -1, [2, 2])
                self.kept += [scalar, tensor]
                md.add_im_data(f"xi_{name}", scalar)
                md.add_im_data(f"Previous_xi_{name}", scalar)
                md.add_im_data(f"Ep_{name}", tensor)
                law = (
                    mim,
                    "plane strain Prandtl Reuss",
                    0,
                    u,
                    f"xi_{name}",
                    f"Ep_{name}",
                    "lambda",
                    "mu",
                    "sigY",
                    "1",
                    "1",
                )
                md.add_small_strain_elastoplasticity_brick(*law)
                self.laws.append(law)
            else:
                md.add_isotropic_linearized_elasticity_brick(mim, u, "lambda", "mu")
            self._held(name, "axis", AXIS)
        md.add_Dirichlet_condition_with_simplification("u_block", LOADED)
        self._held("pin", "top", LOADED)

        self.arc_mim = gf.MeshIm(self.meshes["pin"], gf.Integ("IM_TRIANGLE(6)"))
        self.multipliers = gf.MeshFem(self.meshes["pin"], 2)
        self.multipliers.set_fem(gf.Fem("FEM_PK(2,1)"))
        md.add_filtered_fem_variable("pressure", self.multipliers, ARC)
        contact = md.add_integral_large_sliding_contact_brick_raytracing("r", 20 * DR)
        md.add_slave_contact_boundary_to_large_sliding_contact_brick(contact, self.arc_mim, ARC, "u_pin", "pressure")
        mim = gf.MeshIm(self.meshes["block"], gf.Integ("IM_TRIANGLE(6)"))
        md.add_master_contact_boundary_to_large_sliding_contact_brick(contact, mim, ARC, "u_block")
        self.kept.append(mim)
        self.dofs = md.nbdof()
        self.rigid = {}
        for name, shift in (("u_pin", -1.0), ("u_block", 0.0)):
            y = md.mesh_fem_of_variable(name).basic_dof_nodes()[1]
            self.rigid[name] = np.where(np.arange(len(y)) % 2, shift + 1e-6 * y, 0.0)

    def _held(self, name: str, what: str, region: int) -> None:
        """Prescribe the normal displacement on a straight edge, with multipliers."""
        mf = gf.MeshFem(self.meshes[name], 1)
        mf.set_fem(gf.Fem("FEM_PK(2,2)"))
        mim = gf.MeshIm(self.meshes[name], gf.Integ("IM_TRIANGLE(4)"))
        self.kept += [mf, mim]
        force, value = f"{what}_force_{name}", f"{what}_{name}"
        self.md.add_filtered_fem_variable(force, mf, region)
        self.md.add_initialized_data(value, [0.0])
        self.md.add_normal_Dirichlet_condition_with_multipliers(mim, f"u_{name}", force, region, value)

    def solve(self, guess, delta: float):
        """Equilibrium with the pin's top at ``-delta`` from the state ``guess`` on: state and iterations."""
        self.md.set_variable("top_pin", [-delta])
        self.md.to_variables(guess)
        iterations, converged = self.md.solve(
            "max_iter", ITERATIONS, "max_res", TOLERANCE, "diverged_res", FAR, "lsolver", "mumps",
            "lsearch", "simplest", "alpha min", 0.3,
        )  # fmt: skip
        if not converged:
            raise NoConvergence
        return self.md.from_variables(), int(iterations)

    def force(self) -> float:
        """Force of the whole joint."""
        return float(2 * gf.asm("generic", self.arc_mim, 0, "pressure(2)", ARC, self.md))

    def axis_pressure(self) -> float | None:
        """Pressure on the axis: even parabola through the multipliers within 0.2 rad."""
        dofs = self.multipliers.basic_dof_on_region(ARC)
        x, y = self.multipliers.basic_dof_nodes()[:, dofs][:, ::2]
        angle = np.arctan2(x, -y - DR)
        pressure = np.hypot(*self.md.variable("pressure").reshape(-1, 2).T)
        near = angle < 0.2
        return float(np.polyfit(angle[near] ** 2, pressure[near], 1)[1]) if near.sum() > 2 else None


def load(joint: Joint, steps: int, delta: float):
    """Press the pin down by ``delta`` in equal steps, cut where need be: returns the iterations."""
    md = joint.md
    start = md.from_variables()
    # Not quite rigid: the tangent of the plasticity brick is undefined where there is no deviatoric strain.
    for name, displacement in joint.rigid.items():
        md.set_variable(name, delta / steps * displacement)
    guess = md.from_variables()
    rate = steps * (joint.solve(guess, delta / steps)[0] - start)  # that of the elastic joint
    md.set_variable("sigY", [SIGY])
    state, t, iterations, cut = start, 0.0, 0, 0
    for step in range(1, steps + 1):
        while t < step / steps - 1e-12:
            dt = min(step / steps - t, 0.5**cut / steps)
            try:
                new, count = joint.solve(state + dt * rate, (t + dt) * delta)
            except (NoConvergence, RuntimeError):
                cut, iterations = cut + 1, iterations + ITERATIONS
                if cut > CUTS:
                    raise NoConvergence(f"no equilibrium beyond {t * delta / DR:.3f} dR") from None
                continue
            for law in joint.laws:
                md.small_strain_elastoplasticity_next_iter(*law)
            rate, state, t = (new - state) / dt, new, t + dt
            iterations, cut = iterations + count, max(cut - 1, 0)
    return iterations


def main() -> int:
    """Solve what the command line says; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--case", choices=["elastic", "plastic"], default="elastic")
    parser.add_argument("--size", type=float, default=0.04, help="edge length on the arcs over R")
    parser.add_argument("--growth", type=float, help="growth of the edges per distance; min(0.25, 6.25 size) if absent")
    parser.add_argument("--order", type=int, choices=[2], default=2)
    parser.add_argument("--steps", type=int, default=2, help="equal steps to delta = 2 dR")
    parser.add_argument("--output", type=Path, default=Path("result.json"))
    parser.add_argument("--probe", action="store_true", help="print the version if installed, else exit with 1")
    options = parser.parse_args()
    if options.probe:
        # its Python package carries no version
        print(next(iter(re.findall(r"libgetfem\.so\.(\S+)", Path("/proc/self/maps").read_text())), "unknown"))
        return 0
    gf.util_trace_level(0)
    gf.util_warning_level(0)
    growth = options.growth or min(0.25, 6.25 * options.size)
    result: dict = {"kinematics": "current", "P": None, "p0": None, "eps": None, "iterations": 0, "failed": None}
    joint = Joint(options.size, growth, options.case == "plastic")
    try:
        result["iterations"] = load(joint, options.steps, 2 * DR)
        result["P"], result["p0"] = joint.force(), joint.axis_pressure()
    except NoConvergence as error:
        result["failed"] = str(error)
    options.output.write_text(json.dumps(result | {"dofs": joint.dofs}), encoding="utf-8")
    return 0


if __name__ == "__main__":
    try:
        import getfem as gf
        import gmsh
    except ImportError as missing:
        sys.exit(f"GetFEM cannot run here: {missing}")
    sys.exit(main())

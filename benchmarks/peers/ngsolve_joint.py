"""The paper's quarter joint by NGSolve: ``python3 ngsolve_joint.py --case elastic --order 4
--output r.json``.

Needs NGSolve (of PyPI) and nothing of archord but `joint_script` beside it.

- Bodies: Netgen's triangles, curved to the order of the displacements (2 to 4). With Netgen's
grading large P2 elements
  are coarser than gmsh's and four times as wrong: 0.6 of it makes about as many.
- Contact: kinematics "reference", NGSolve's ContactBoundary paired once, in the touching
configuration: a linear gap
  along the pin's normal, and the energy k/2 <-g>^2 with k = 1e5 E*/R (penalty).
- Plasticity: J2, perfect, backward Euler. A step minimises the incremental energy, which for the
elastic trial
  deviator e is mu |e|^2 up to |e| = r/(2 mu), r = sqrt(2/3) sigY, and r |e| - r^2/(4 mu) beyond
  (the radial return; Simo and Hughes 1998, box 3.2, integrated); NGSolve differentiates it.
- Newton's method with inner unknowns condensed, NGSolve's sparse Cholesky.
"""

from __future__ import annotations

import math
from importlib.metadata import version

import ngsolve as ng
from joint_script import BLOCK, DR, LAME, MU, PENALTY, PIN, SIGY, WIDTH, main, newton
from netgen import occ

YIELD = math.sqrt(2 / 3) * SIGY


def mesh_joint(size: float, growth: float, order: int):
    """Pin and block, their edges named "arc", "top" and "axis" behind the body's name."""

    def body(name: str, circle: tuple[float, float], *outer: tuple[float, float, str]):
        y, radius = circle
        bottom = occ.WorkPlane().MoveTo(0, y - radius)
        path = bottom.Arc(radius, 90, f"{name}_arc", size)
        for x, z, edge in outer:
            path.LineTo(x, z, f"{name}_{edge}")
        outline = path.Close(f"{name}_axis").Wire()
        face = occ.Face(outline)
        face.name = name
        return face

    pin = body("pin", PIN, (0, -DR, "top"))
    block = body("block", BLOCK, (WIDTH, 0, "top"), (WIDTH, -WIDTH, ""), (0, -WIDTH, ""))
    both = occ.Compound([pin, block])
    geometry = occ.OCCGeometry(both, dim=2)
    grading = growth if order > 2 else 0.6 * growth
    straight = geometry.GenerateMesh(
        maxh=WIDTH, grading=grading, segmentsperedge=1, curvaturesafety=0.1
    )
    return ng.Mesh(straight).Curve(order)


class Joint:
    """Half of the joint below the pin's diameter, discretised."""

    def __init__(self, size: float, growth: float, order: int, plastic: bool) -> None:
        mesh = mesh_joint(size, growth, order)
        held = {"dirichletx": "pin_axis|block_axis|block_top", "dirichlety": "pin_top|block_top"}
        self.space = space = ng.VectorH1(mesh, order=order, **held)
        self.u, self.top, self.rigid = (ng.GridFunction(space) for _ in range(3))
        # Up by 1: of the pin's top what weighs the reactions, of the whole pin what the first step
        # starts from.
        self.top.components[1].Set(1, definedon=mesh.Boundaries("pin_top"))
        self.rigid.components[1].Set(1, definedon=mesh.Materials("pin"))
        self.dofs = space.ndof
        self.plastic = plastic
        self.inverse = None
        self.free = ng.Projector(space.FreeDofs(), True)
        self.residual = self.u.vec.CreateVector()
        self.step = self.u.vec.CreateVector()
        self.zero = self.u.vec.FV().NumPy().copy()

        points = ng.comp.IntegrationRuleSpace(mesh, order=2 * order - 2)
        dx = ng.dx(intrules=points.GetIntegrationRules())
        self.strain = ng.GridFunction(points**4)  # plastic strain xx, yy, zz, sqrt(2) xy
        self.next = ng.GridFunction(points**4)
        self.yielding = ng.Parameter(0.0)  # 1 where the yield stress holds, 0 for an elastic joint
        u, v = space.TnT()
        self.form = ng.BilinearForm(space, symmetric=True, condense=order > 2)
        if plastic:
            self.form += ng.Variation(self._energy(u).Compile() * dx)
            self.returned = self._returned()
        else:
            (a, e) = self._trial(u)
            (b, f) = self._trial(v)
            volumetric = (LAME + 2 * MU / 3) * a * b
            deviatoric = 2 * MU * e * f
            self.form += (volumetric + deviatoric) * dx
        self.contact = ng.ContactBoundary(mesh.Boundaries("pin_arc"), mesh.Boundaries("block_arc"))
        place = ng.CF((ng.x, ng.y))
        depth = (place + u - place.Other() - u.Other()) * self.contact.normal
        penalty = PENALTY / 2 * depth * depth
        self.contact.AddEnergy(ng.IfPos(depth, penalty, 0))
        self.contact.Update(self.u, self.form, intorder=2 * order - 2, maxdist=20 * DR)

    def _trial(self, u):
        """Trace of the strain and its deviator (xx, yy, zz, sqrt(2) xy), less the plastic strain if
        there is any."""
        grad = ng.Grad(u)
        xx = grad[0, 0]
        yy = grad[1, 1]
        trace = xx + yy
        mean = trace / 3
        shear = (grad[0, 1] + grad[1, 0]) / math.sqrt(2)
        deviator = ng.CF((xx - mean, yy - mean, -mean, shear))
        return trace, deviator - self.strain if self.plastic else deviator

    def _energy(self, u):
        """Incremental energy, quadratic within the yield surface and linear beyond."""
        trace, e = self._trial(u)
        norm = ng.sqrt(e * e + 1e-30)  # differentiable at zero
        beyond = YIELD * norm - YIELD**2 / (4 * MU)
        inside = self.yielding * norm - YIELD / (2 * MU)
        volumetric = (LAME / 2 + MU / 3) * trace * trace
        return volumetric + ng.IfPos(inside, beyond, MU * e * e)

    def _returned(self):
        """Plastic strain of the present displacement. Compiled: Interpolate takes 18 times as long
        without."""
        _, e = self._trial(self.u)
        excess = 1 - YIELD / (2 * MU) / ng.sqrt(e * e + 1e-30)
        growth = ng.IfPos(excess, excess, 0) * e
        return (self.strain + growth).Compile()

    def commit(self) -> None:
        """Take over the plastic strain of the present displacement."""
        if self.plastic:
            self.next.Interpolate(self.returned)
            self.strain.vec.data = self.next.vec

    def results(self) -> dict[str, float]:
        """Force of the whole joint; what presses on a point, NGSolve does not tell."""
        return {"P": 2 * self.reaction}

    def elastic(self, delta: float):
        """The state at ``delta`` of bodies that do not yield; from then on they do."""
        found, _ = self.solve(-delta * self.rigid.vec.FV().NumPy(), delta)
        self.yielding.Set(1.0)
        return found

    def solve(self, guess, delta: float):
        """Displacements of equilibrium from ``guess`` on, and iterations."""
        self.u.vec.FV().NumPy()[:] = guess
        iterations = newton(self._error, self._improve)
        return self.u.vec.FV().NumPy().copy(), iterations

    def _error(self) -> float:
        self.form.Apply(self.u.vec, self.residual)
        self.reaction = -ng.InnerProduct(self.residual, self.top.vec)
        self.residual.data = self.free * self.residual
        return self.residual.Norm() / abs(self.reaction)

    def _improve(self) -> None:
        form = self.form
        residual = self.residual
        step = self.step
        form.AssembleLinearization(self.u.vec)
        if self.inverse is None:
            self.inverse = form.mat.Inverse(
                self.space.FreeDofs(form.condense), inverse="sparsecholesky"
            )
        else:
            self.inverse.Update()  # keeps the ordering of the unknowns
        if form.condense:
            residual.data += form.harmonic_extension_trans * residual
        step.data = self.inverse * residual
        if form.condense:
            step.data += form.harmonic_extension * step
            step.data += form.inner_solve * residual
        self.u.vec.data -= step


if __name__ == "__main__":
    main(Joint, "reference", version("ngsolve"), (2, 3, 4))

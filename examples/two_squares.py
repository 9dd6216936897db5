"""Two elastic squares, whose meshes match nowhere, pressed together: pressure E / (1 - nu^2) times the mean strain."""

from mpi4py import MPI

from archord import Elastic, System, gmsh_to_mesh
from archord.solver.problem import Body, Interaction, Problem, Support

E, NU, DEPTH = 1.0, 0.3, 0.01


def squares(gmsh):
    """Unit squares on top of each other, 3 and 4 edges a side."""
    for name, y, edges in (("lower", 0, 3), ("upper", 1, 4)):
        face = gmsh.model.occ.addRectangle(0, y, 0, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name=name)
        sides = gmsh.model.getBoundary([(2, face)], oriented=False)
        for side, (_, line) in zip(("bottom", "right", "top", "left"), sides, strict=True):
            gmsh.model.mesh.setTransfiniteCurve(line, edges + 1)
            gmsh.model.addPhysicalGroup(1, [line], name=f"{name} {side}")


bodies = [Body(name, Elastic(E, NU, "strain")) for name in ("lower", "upper")]
contact = Interaction("contact", ("upper bottom", "lower top"))
supports = [Support("base", "lower bottom", 1), Support("lid", "upper top", 1, rate=-1.0)]
supports += [Support("left", f"{body.name} left", 0) for body in bodies]
system = System(Problem(gmsh_to_mesh(MPI.COMM_WORLD, squares), bodies, [contact], supports))
system.solve([DEPTH])
pressure, exact = -system.reaction("lid")[1], E / (1 - NU**2) * DEPTH / 2
print(f"pressure {pressure:.12g}, exact {exact:.12g}")

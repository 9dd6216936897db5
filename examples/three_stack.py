"""Three squares between walls, plane strain: the middle one yields, with pressure p = K strain +
2/3 sigY (J2)."""

from mpi4py import MPI

from archord import Elastic, J2Material, LinearHardening, System, gmsh_to_mesh
from archord.solver.problem import Body, Dirichlet, Interaction, Problem

E, NU, SIGY, DEPTH, NAMES = 1.0, 0.3, 0.002, 0.02, ("lower", "middle", "upper")


def squares(gmsh):
    """Unit squares on top of each other, their sides named by bottom, right, top and left."""
    for y, name in enumerate(NAMES):
        face = gmsh.model.occ.addRectangle(0, y, 0, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name=name)
        for side, (_, line) in zip(
            "brtl", gmsh.model.getBoundary([(2, face)], oriented=False), strict=True
        ):
            gmsh.model.mesh.setTransfiniteCurve(line, 3 + y)
            gmsh.model.addPhysicalGroup(1, [line], name=f"{name} {side}")


steel, lead = Elastic(E, NU, "strain"), J2Material(E, NU, "strain", LinearHardening(SIGY))
bodies = [Body(name, lead if name == "middle" else steel) for name in NAMES]
contacts = [
    Interaction("low", ("middle b", "lower t")),
    Interaction("high", ("upper b", "middle t")),
]
walls = [Dirichlet("walls", f"{name} {side}", 0) for name in NAMES for side in "lr"]
supports = [Dirichlet("base", "lower b", 1), Dirichlet("lid", "upper t", 1, rate=-1.0), *walls]
(
    system := System(Problem(gmsh_to_mesh(MPI.COMM_WORLD, squares), bodies, contacts, supports))
).solve([DEPTH])
K, M = (
    E / (3 * (1 - 2 * NU)),
    E * (1 - NU) / ((1 + NU) * (1 - 2 * NU)),
)  # moduli without and with shear
pressure, exact = -system.reaction("lid")[1], (DEPTH + 2 * SIGY / (3 * K)) / (2 / M + 1 / K)
print(f"pressure {pressure:.12g}, exact {exact:.12g}")

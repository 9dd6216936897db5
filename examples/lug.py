"""A lug that a pin pulls at, from gmsh calls to a picture: mm, MPa, N per mm of thickness."""

import gmsh

from archord import Body, Elastic, Interaction, Load, Problem, Support, draw_run, solve

gmsh.initialize()
draw = gmsh.model.occ
plate, _ = draw.fuse(
    [(2, draw.addRectangle(-60, -20, 0, 60, 40))], [(2, draw.addDisk(0, 0, 0, 20, 20))]
)
lug, _ = draw.cut(plate, [(2, draw.addDisk(0, 0, 0, 10, 10))])
disk = [(2, draw.addDisk(0.1, 0, 0, 9.9, 9.9))]
pin, _ = draw.intersect(disk, [(2, draw.addRectangle(0.1, -10, 0, 20, 20))])
draw.synchronize()


def lines_between(left, right):
    return set(gmsh.model.getEntitiesInBoundingBox(left, -21, -1, right, 21, 1, dim=1))


lines = {"clamp": lines_between(-61, -59), "flat": lines_between(0, 0.2)}
lines["bolt"] = lines_between(0, 11) - lines["flat"]
lines["hole"] = lines_between(-11, 11) - lines_between(0, 11)
for name, entities in (lines | {"lug": lug, "pin": pin}).items():
    dimension = 1 if name in lines else 2
    gmsh.model.addPhysicalGroup(dimension, [tag for _, tag in entities], name=name)
gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 130)  # elements around a circle

steel = Elastic(210e3, 0.3)
problem = Problem(
    gmsh,
    bodies=[Body("lug", steel), Body("pin", steel)],
    interactions=[Interaction("contact", ("bolt", "hole"))],
    supports=[Support("clamp", fixed="xy")],
    loads=[Load("pull", on="flat", direction="x", displacement=0.3)],
    steps=15,
)
run = solve(problem, "runs/lug_from_gmsh", force=True)
draw_run(run, "runs/lug_from_gmsh/picture.png")

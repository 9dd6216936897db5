"""A lug that a pin pulls at, from gmsh calls to a picture: mm, MPa, N per mm of thickness."""

import gmsh

import archord

gmsh.initialize()
cad = gmsh.model.occ
plate, _ = cad.fuse(
    [(2, cad.addRectangle(-60, -20, 0, 60, 40))], [(2, cad.addDisk(0, 0, 0, 20, 20))]
)
lug, _ = cad.cut(plate, [(2, cad.addDisk(0, 0, 0, 10, 10))])
pin, _ = cad.intersect(
    [(2, cad.addDisk(0.1, 0, 0, 9.9, 9.9))], [(2, cad.addRectangle(0.1, -10, 0, 20, 20))]
)
cad.synchronize()
within = lambda x0, x1: set(gmsh.model.getEntitiesInBoundingBox(x0, -20.1, -1, x1, 20.1, 1, 1))  # noqa: E731
edges = {
    "clamp": within(-60.1, -59.9),
    "flat": within(0, 0.2),
    "hole": within(-10.1, 10.1) - within(0, 10.1),
}
edges["bolt"] = within(0, 10.1) - edges["flat"]
for name, entities in ({"lug": lug, "pin": pin} | edges).items():
    gmsh.model.addPhysicalGroup(1 if name in edges else 2, [tag for _, tag in entities], name=name)
gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 130)  # elements around a circle
problem = archord.Problem(
    gmsh,
    bodies=[archord.Body(name=name, E=210000.0, nu=0.3) for name in ("lug", "pin")],
    interactions=[archord.Interaction(name="contact", surfaces=["bolt", "hole"])],
    supports=[archord.Support(name="clamp", on="clamp", fixed=["x", "y"])],
    loads=[archord.Load(name="pull", on="flat", direction="x", displacement=0.3)],
    path={"steps": 15},
)
run = archord.solve(problem, "runs/lug_from_gmsh", force=True)
print(run.history[["pull displacement", "pull force"]])
archord.draw_run(run, "runs/lug_from_gmsh/picture.png")

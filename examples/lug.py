"""A lug that a pin pulls at, from gmsh calls to a picture: mm, MPa, N per mm of thickness."""

from math import hypot

import gmsh

import archord

gmsh.initialize()
disc = lambda x, r: (2, gmsh.model.occ.addDisk(x, 0, 0, r, r))  # noqa: E731
box = lambda x, w, h: (2, gmsh.model.occ.addRectangle(x, -h / 2, 0, w, h))  # noqa: E731
plate, _ = gmsh.model.occ.fuse([box(-60, 60, 40)], [disc(0, 20)])
bodies = {"lug": gmsh.model.occ.cut(plate, [disc(0, 10)])[0]}
bodies["pin"] = gmsh.model.occ.intersect([disc(0.1, 9.9)], [box(0.1, 20, 20)])[0]
gmsh.model.occ.synchronize()
edges = {"clamp": [], "hole": [], "end": [], "flat": [], "pin": []}
for body, faces in bodies.items():
    gmsh.model.addPhysicalGroup(2, [face for _, face in faces], name=body)
    for _, line in gmsh.model.getBoundary(faces, oriented=False):
        x, y, _ = gmsh.model.occ.getCenterOfMass(1, line)
        of_lug = "clamp" if x < -59 else "hole" if hypot(x, y) < 9 else "end"
        edges[of_lug if body == "lug" else "flat" if x < 0.2 else "pin"].append(line)
for name, lines in edges.items():
    gmsh.model.addPhysicalGroup(1, lines, name=name)
gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 130)  # elements around a circle

steel = {"E": 210000.0, "nu": 0.3}
problem = archord.Problem(
    gmsh,
    bodies=[archord.Body(name=name, **steel) for name in bodies],
    interactions=[archord.Interaction(name="contact", surfaces=["pin", "hole"])],
    supports=[archord.Support(name="clamp", on="clamp", fixed=["x", "y"])],
    loads=[archord.Load(name="pull", on="flat", direction="x", displacement=0.3)],
    path={"steps": 15},
)
run = archord.solve(problem, "runs/lug", force=True)
print(run.history[["pull displacement", "pull force"]])

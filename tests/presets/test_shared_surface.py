"""A surface that meets two bodies, in an interaction with each."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

import archord
from archord.geometry.meshes.fenicsx import gmsh_to_mesh

SOFT = archord.Elastic(1.0, 0.3)
HARD = archord.Elastic(3.0, 0.3)


def drawn(gmsh):
    """A soft and a hard block side by side, and a plate on both, whose lower side has a point
    between the blocks."""
    polygons = {
        "soft": [(0.0, 0.0), (0.9, 0.0), (0.9, 1.0), (0.0, 1.0)],
        "hard": [(1.1, 0.0), (2.0, 0.0), (2.0, 1.0), (1.1, 1.0)],
        "plate": [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (0.0, 2.0)],
    }
    for name, corners in polygons.items():
        points = [gmsh.model.geo.addPoint(x, y, 0.0, 0.25) for x, y in corners]
        ends = points[1:] + points[:1]
        lines = [gmsh.model.geo.addLine(*pair) for pair in zip(points, ends, strict=True)]
        face = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(lines)])
        gmsh.model.geo.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name=name)
        for number, line in enumerate(lines):
            gmsh.model.addPhysicalGroup(1, [line], name=f"{name} {number}")


def stack(comm, shared):
    """The plate pressed onto the blocks: its lower side is a surface in two interactions, or ends
    between the blocks."""
    mesh = gmsh_to_mesh(comm, drawn)
    sets = mesh.facet_sets
    left, right = sets["plate 0"], sets["plate 1"]
    if shared:
        left = right = left + right
    named = {"over soft": left, "over hard": right}
    return archord.Problem(
        replace(mesh, facet_sets=sets | named),
        bodies=[
            archord.Body("soft", SOFT),
            archord.Body("hard", HARD),
            archord.Body("plate", SOFT),
        ],
        interactions=[
            archord.Interaction("left", ("over soft", "soft 2"), friction=0.2),
            archord.Interaction("right", ("over hard", "hard 2"), friction=0.2),
        ],
        supports=[
            archord.Support("soft 0"),
            archord.Support("hard 0"),
            archord.Support("plate 2", fixed="x"),
        ],
        loads=[archord.Load("press", on="plate 3", direction="y", displacement=-0.02)],
        steps=2,
    )


@pytest.mark.mpi
def test_a_surface_meets_two_bodies_as_if_it_were_two(comm, tmp_path):
    """The same forces, and the same pressure of each cell."""
    runs = [
        archord.solve(stack(comm, shared), comm.bcast(tmp_path) / name)
        for name, shared in (("one", True), ("two", False))
    ]
    for column in ("press force", "left force y", "right force x"):
        one, two = (run.columns[column] for run in runs)
        assert one == pytest.approx(two, rel=1e-9, abs=1e-12)
    pressures = []
    for run in runs:
        with h5py.File(run.folder / "fields.h5") as file:
            pressures.append(file["contact_pressure/0002"][()])
    assert np.abs(pressures[1]).max() > 0.01
    assert pressures[0] == pytest.approx(pressures[1], rel=1e-7, abs=1e-10)

"""Draws a quarter of a clevis as a CAD program writes it, three solids in clevis.step: half of the
inner plate, an outer plate behind a gap, and the pin. Lengths are in mm."""

import math
from pathlib import Path

import gmsh

RADIUS = 6.0  # of the pin
CLEARANCE = 0.03
THICKNESS = 8.0  # of an outer plate, and half of the inner one
GAP = 0.5
WIDTH = 28.0
LENGTH = 36.0  # from the hole to the clamp

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ


def plate(left, bottom):
    """The half y >= 0 of a plate with a round end, whose clamped part begins at x = left."""
    bar = occ.addBox(left, 0, bottom, LENGTH, WIDTH / 2, THICKNESS)
    end = occ.addCylinder(0, 0, bottom, 0, 0, THICKNESS, WIDTH / 2, angle=math.pi)
    outline, _ = occ.fuse([(3, bar)], [(3, end)])
    hole = occ.addCylinder(0, 0, bottom, 0, 0, THICKNESS, RADIUS + CLEARANCE)
    occ.cut(outline, [(3, hole)])


plate(-LENGTH, 0)
plate(0, THICKNESS + GAP)
occ.addCylinder(0, 0, 0, 0, 0, 2 * THICKNESS + GAP + 2, RADIUS, angle=math.pi)
occ.synchronize()
gmsh.write(str(Path(__file__).with_name("clevis.step")))
gmsh.finalize()

"""Two blocks in space that a ram presses together off their centre, by a rigid coupling: mm, MPa,
N."""

from archord import (
    Body,
    Coupling,
    Elastic,
    Interaction,
    Load,
    Problem,
    Support,
    boxes,
    solve,
)

base = (0.0, 0.0, 0.0, 20.0, 20.0, 10.0)
block = (0.0, 0.0, 10.0, 20.0, 20.0, 10.0)
problem = Problem(
    boxes({"base": base, "block": block}, size=5.0),
    bodies=[Body("base", Elastic(210e3, 0.0)), Body("block", Elastic(70e3, 0.0))],
    interactions=[Interaction("contact", ("block back", "base front"), friction=0.2)],
    supports=[Support("base back")],
    couplings=[Coupling("ram", facets="block front", point=(12.0, 9.0, 20.0))],
    loads=[Load("press", on="ram", direction="z", force=-20e3)],
    steps=2,
)
run = solve(problem, "runs/eccentric_press", force=True)
print(run.history[["press displacement", "base back z", "contact largest pressure"]])

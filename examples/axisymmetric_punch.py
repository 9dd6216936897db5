"""A rigid ball is pressed into a steel block: x is the radius, and the axis goes along y."""

from archord import (
    Body,
    Elastic,
    Interaction,
    Load,
    Problem,
    RigidCircle,
    Support,
    rectangles,
    solve,
)

radius = 40.0
ball = RigidCircle((0.0, radius), radius)
problem = Problem(
    rectangles({"block": (0, -4, 4, 4)}, size=0.1),
    bodies=[Body("block", Elastic(E=210e3, nu=0.3))],
    interactions=[Interaction("contact", (ball, "block top"))],
    supports=[Support("block bottom")],
    loads=[Load("press", on="contact", direction="y", displacement=-0.01)],
    kinematics="axisymmetric",
    steps=2,
)
run = solve(problem, "runs/axisymmetric_punch", force=True)
print(run.history[["press displacement", "press force", "contact largest pressure"]])

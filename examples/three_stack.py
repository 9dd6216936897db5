"""Three squares between walls are pressed together: the middle one is soft, and yields."""

from archord import (
    Body,
    Elastic,
    Interaction,
    J2Material,
    LinearHardening,
    Load,
    Problem,
    Support,
    rectangles,
    solve,
)

E = 1.0
nu = 0.3
yield_stress = 0.002
depth = 0.02

mesh = rectangles({"lower": (0, 0, 1, 1), "middle": (0, 1, 1, 1), "upper": (0, 2, 1, 1)}, size=0.3)
steel = Elastic(E, nu)
lead = J2Material(E, nu, hardening=LinearHardening(yield_stress))
sides = [f"{name} {side}" for name in ("lower", "middle", "upper") for side in ("left", "right")]
walls = [Support(side, fixed="x") for side in sides]
problem = Problem(
    mesh,
    bodies=[Body("lower", steel), Body("middle", lead), Body("upper", steel)],
    interactions=[
        Interaction("low", ("middle bottom", "lower top")),
        Interaction("high", ("upper bottom", "middle top")),
    ],
    supports=[Support("lower bottom", fixed="y"), *walls],
    loads=[Load("lid", on="upper top", direction="y", displacement=-depth)],
    steps=1,
)
run = solve(problem, "runs/three_stack", force=True)
pressure = -run.columns["lid force"][-1]
print(f"pressure {pressure:.12g}")

"""Three blocks in a row: one of steel presses one of rubber against one of aluminium."""

from archord import Body, Elastic, Interaction, Load, Problem, Support, rectangles, solve

mesh = rectangles(
    {"steel": (0, 0, 1, 1), "rubber": (1, 0, 1, 1), "aluminium": (2, 0, 1, 1)}, size=0.4
)
problem = Problem(
    mesh,
    bodies=[
        Body("steel", Elastic(E=210e3, nu=0.3)),
        Body("rubber", Elastic(E=10.0, nu=0.45)),
        Body("aluminium", Elastic(E=70e3, nu=0.33)),
    ],
    interactions=[
        Interaction("first", ("steel right", "rubber left")),
        Interaction("second", ("rubber right", "aluminium left")),
    ],
    supports=[
        Support("wall", on="aluminium right", fixed="x"),
        Support("steel bottom", fixed="y"),
        Support("rubber bottom", fixed="y"),
        Support("aluminium bottom", fixed="y"),
    ],
    loads=[Load("push", on="steel left", direction="x", displacement=0.05)],
    kinematics="plane stress",
    thickness=5.0,
    steps=2,
)
run = solve(problem, "runs/three_bodies", force=True)
force = run.columns["push force"][-1]
print(f"force {force:.6g} N")

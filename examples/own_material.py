"""A material of one's own: a foam without lateral contraction, which gets stiffer."""

from dataclasses import dataclass

import numpy as np

from archord import Body, Load, Material, Problem, Support, rectangles, solve


@dataclass(frozen=True)
class Foam(Material):
    """Stress = E strain (1 + (strain / limit)^2) along x and y, and E/2 times the shear."""

    E: float
    limit: float
    yields = True  # its stiffness changes

    @property
    def elastic_tangent(self):
        return self.E * np.diag([1.0, 1.0, 0.5])

    def update(self, strain, state):
        growth = (strain / self.limit) ** 2 * [1, 1, 0]
        working = strain @ self.elastic_tangent * (1 + growth)
        tangent = self.elastic_tangent * (1 + 3 * growth)[:, None, :]
        stress = np.insert(working, 2, 0.0, axis=1)  # xx, yy, zz, xy
        return stress, tangent, state

    def stored(self, strain, stress, state):
        energy = 1 + (strain / self.limit) ** 2 * [0.5, 0.5, 0]
        return (strain**2 @ self.elastic_tangent * energy).sum(axis=1) / 2


mesh = rectangles({"bar": (0, 0, 2, 1)}, size=0.5)
bar = Body("bar", Foam(E=10.0, limit=0.02))
pull = Load("pull", on="bar right", direction="x", displacement=0.04)
problem = Problem(mesh, [bar], supports=[Support("bar left")], loads=[pull], steps=2)
run = solve(problem, "runs/own_material", force=True)
print(run.history[["pull displacement", "pull force"]])

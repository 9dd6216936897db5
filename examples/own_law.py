"""A contact law of one's own: wear by Archard (1953), under a roller that slides back and forth."""

from dataclasses import dataclass, make_dataclass

import numpy as np

import archord

Worn = make_dataclass("Worn", ["depth"])  # what the law remembers of each point


@dataclass(frozen=True)
class Archard(archord.ContactLaw):
    """The depth of wear grows by k times pressure times slip, and opens the gap."""

    k: float
    counts_slip = unilateral = True

    def state(self, n):
        return Worn(np.zeros(n))

    def respond(self, opening, trial, gamma, state, dt):
        pressure = np.maximum(trial[:, 0] - gamma[:, 0] * state.depth, 0.0)
        touches = (pressure > 0).astype(int)
        by_trial = touches[:, None, None] * np.diag([1.0, 0.0])
        worn = state.depth + self.k * pressure * np.abs(opening[:, 1])
        return archord.Response(pressure[:, None] * [1, 0], by_trial, None, touches, Worn(worn))

    def quantities(self, state):
        return {"worn volume": archord.Quantity(state.depth, "mm2")}


mesh = archord.rectangles({"block": (-4, -2, 8, 2)}, size=0.25)
rub = archord.Interaction("rub", (archord.RigidCircle((0, 50), 50), "block top"), law=Archard(1e-6))
press = archord.Load("press", on="rub", direction="y", force=3 * [-500.0])
slide = archord.Load("slide", on="rub", direction="x", displacement=[0.0, 0.5, -0.5])
block = archord.Body("block", archord.Elastic(210e3, 0.3))
held = [archord.Support("block bottom")]
problem = archord.Problem(mesh, [block], [rub], held, [press, slide], steps=[4, 10, 20])
run = archord.solve(problem, "runs/own_law", force=True)

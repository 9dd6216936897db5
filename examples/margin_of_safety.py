"""A lug's finite element forces beside those of a hand calculation: net section, bearing, shear-out.

archord solve scenes/lug.toml && python3 examples/margin_of_safety.py runs/lug
"""

import sys
from math import cos, radians, sqrt

import numpy as np

import archord

run = archord.load(sys.argv[1] if len(sys.argv) > 1 else "runs/lug")
shape = getattr(getattr(run.scene, "mesh", None), "shape", None)
if getattr(shape, "kind", "") != "lug" or run.scene.body[-1].yield_stress is None:
    sys.exit(f"{run.folder} is no run of a [lug] that can yield, whose sections are known here")
lug, fy, t = shape.arguments(), run.scene.body[-1].yield_stress, run.scene.thickness
R, D = lug["radius"], 2 * (lug["radius"] + lug["clearance"])

hand = {
    "net section": fy * (lug["width"] - D) * t,
    "bearing": 1.5 * fy * 2 * R * t,
    "shear-out": 2 * (lug["edge_distance"] - D / 2 * cos(radians(40))) * t * fy / sqrt(3),
}
history = run.history
P, peeq = history["pull force"], history["lug peeq_max"]
found = {
    "last step without yielding": P[peeq == 0].max(),
    "PEEQ of 1 % at the hole": np.interp(0.01, peeq, P),
    "at the largest displacement": P.iloc[-1],
}
for kind, forces in (("by hand", hand), ("finite elements", found)):
    for name, force in forces.items():
        print(f"{kind:>15s}  {name:28s} {force:8.0f} {history.attrs['units']['pull force']}")
weakest = min(hand, key=hand.get)
margin = found["PEEQ of 1 % at the hole"] / hand[weakest] - 1
print(f"{weakest} is the weakest by hand; the force at which PEEQ reaches 1 % is {margin:+.0%} of it away")

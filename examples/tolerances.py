"""A tolerance study: how much the force of a joint scatters, as clearances and yield stresses do.

``python3 examples/tolerances.py [PICTURE [JOINTS]]``: a fit H8/e8 of 20 mm, two steels in plane
strain, pressed by 0.05 mm. Each joint costs some milliseconds.
"""

import sys
from time import perf_counter

import numpy as np
import pandas as pd

from archord.postprocess.laws.general.many import loads
from archord.report.figure import new_figure

number = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
random = np.random.default_rng(1)
hole = random.uniform(20.000, 20.033, number)  # H8: diameters in mm
pin = random.uniform(19.927, 19.960, number)  # e8
joints = pd.DataFrame({"radius": pin / 2, "clearance": (hole - pin) / 2})
joints["pin_yield"] = random.normal(450.0, 25.0, number)  # MPa
joints["block_yield"] = random.normal(355.0, 20.0, number)
steel = joints.assign(E_star=115385.0, plane="strain", nu=0.3)
begun = perf_counter()
found = loads(steel, delta=0.05)
seconds = perf_counter() - begun
joints["P"] = found.load
low, high = joints.P.quantile([0.025, 0.975])
print(f"{number} joints in {seconds:.1f} s, {(found.reason != '').sum()} outside the range")
print(f"P = {joints.P.mean():.0f} N/mm, 95 % of the joints from {low:.0f} to {high:.0f}")
print("correlation with P:", joints.corr(method="spearman").P.drop("P").round(2).to_dict())

figure = new_figure(9, 3.6)
scatter, histogram = figure.subplots(1, 2)
points = scatter.scatter(1e3 * joints.clearance, joints.P, c=joints.block_yield, s=6)
figure.colorbar(points, ax=scatter, label="yield stress of the block [MPa]")
scatter.set(xlabel="radial clearance [um]", ylabel="P at 0.05 mm [N/mm]")
histogram.hist(joints.P, bins=30)
histogram.set(xlabel="P at 0.05 mm [N/mm]", ylabel="joints")
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "tolerances.png", dpi=110)

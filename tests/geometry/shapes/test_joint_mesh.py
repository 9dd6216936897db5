"""The drawing of joints: sizes as gmsh reads them."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.shapes.joint_mesh import mesh_joint
from archord.geometry.shapes.sketch import Sketch, around
from tests.geometry.shapes.measures import area


@pytest.mark.parametrize("x", [-2.0, 0.0, 2.0])
def test_a_pin_may_be_drawn_anywhere_on_the_axis(x):
    """A faulty expression of a size would abort Python."""
    sketch = Sketch(["pin"], ["pin", "flat", "axis"])
    sketch.pin(x, 1, "whole")
    sketch.sizes["pin"] = f"0.2 + 0.1 * {around(x)}"
    joint = mesh_joint(MPI.COMM_SELF, sketch, radius=10.0)
    assert area(joint, "pin") == pytest.approx(50.0 * np.pi, rel=1e-4)
    np.testing.assert_allclose(joint.point_sets["centre"], [[10.0 * x, 0.0]])

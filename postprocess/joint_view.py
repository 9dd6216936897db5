"""What tables, pictures and exports must know of the runs of a [joint]: its one force, its arcs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from archord.postprocess.curve import CURVES
from archord.postprocess.problem_view import ProblemView, given, plane_words
from archord.scene.scene import Scene


class JointView(ProblemView):
    """The runs of a ``scene`` with a [joint]."""

    path_name = "delta"
    needed = (*CURVES, "delta/dR", "P/(E* R)", "p0/E*")
    sides = ("pin", "hole")
    has_contact = True

    @property
    def forces(self) -> dict[str, str]:
        """The column of the force on the joint."""
        return {"P": "P"}

    @property
    def pulls(self) -> dict[str, str]:
        """The same."""
        return self.forces

    def facts(self) -> Iterator[tuple[str, str]]:
        """The joint, its analysis and its bodies."""
        scene = self.scene
        g = scene.joint
        length = scene.units.length
        sizes = f"R = {g.radius:g} {length}, dR = {g.dR:g} {length}, dR/R = {g.dR / g.radius:g}"
        yield "joint", f"{g.model}, {sizes}"
        stiffness = f"E* = {scene.E_star:g} {scene.units.stress}"
        yield "", f"{plane_words(scene)}, contact {scene.analysis.kinematics}, {stiffness}"
        yield "pin", given(scene.pin)
        yield "block", given(scene.block)


def view_of(scene: Any) -> ProblemView:
    """The view of the runs of a ``scene``."""
    return JointView(scene) if isinstance(scene, Scene) else ProblemView(scene)

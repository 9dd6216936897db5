"""An identified joint, solved: the path that the curve took, and by how much the solution
differs."""

from __future__ import annotations

import numpy as np

from archord.materials.material import Array
from archord.postprocess.curve import rms
from archord.postprocess.laws.general.general_law import law_of_joint
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.identification.identification import Identification
from archord.report.by_name import ByName

_STEPS = 30  # of loading, and about as many of the way back
_REACHED = 0.995  # of the deepest displacement: a second loading may come as far
_RETURNED = 0.05  # of the deepest displacement, from which on a way back is solved


def path_of(found: Identification) -> ByName:
    """The keys of the load: to the deepest displacement and back."""
    delta = found.predicted.delta
    deepest = float(delta.max())
    last = int(np.argmax(delta > _REACHED * deepest))
    least = max(float(delta[last:].min()), 0.0)
    turns = [deepest]
    if least < (1 - _RETURNED) * deepest:
        turns.append(least)
    return {"load.displacement_absolute": turns, "load.steps": _STEPS}


def compared(found: Identification, delta: Array, load: Array) -> list[str]:
    """How far the law and the measured curve are from what was solved, ``delta`` and ``load``
    ``(k,)``, over the largest force."""
    scene = found.scene
    law = law_of_joint(LawJoint.from_scene(scene), extrapolate=True)
    predicted = law.at(delta, _before(delta)).load * scene.thickness
    measured = found.model.curve
    turn = int(np.argmax(delta))
    there = measured.displacement >= measured.deepest
    along = found.predicted.delta
    solved = np.interp(along, [0.0, *delta[: turn + 1]], [0.0, *load[: turn + 1]])
    if turn + 1 < len(delta):
        back = np.interp(along, delta[turn:][::-1], load[turn:][::-1])
        solved = np.where(there, solved, back)
    largest = measured.largest
    return [
        f"confirmed: the law is off the solution by {_sizes((predicted - load) / largest)}",
        f"confirmed: the curve is off the solution by {_sizes((measured.load - solved) / largest)}",
    ]


def _before(delta: Array) -> Array:
    """The deepest displacement before each step of a way back, 0 of first loading."""
    deepest = np.maximum.accumulate(delta)
    return np.where(delta < deepest, deepest, 0.0)


def _sizes(errors: Array) -> str:
    return f"{rms(errors):.2%} rms, {np.abs(errors).max():.2%} at worst, of the largest force"

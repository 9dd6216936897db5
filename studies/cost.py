"""What a case will cost, before it is solved: good enough to begin with the longest."""

from __future__ import annotations

from archord.scene.scene import Scene

_DOFS_PER_CELL = {2: 4.3, 3: 9.5}
_ITERATIONS = 5.5  # Newton iterations of an output step
_SETUP = 0.1, 2e-5  # seconds of a joint, and per dof
_STEP = 0.02  # seconds of output and checkpoint
_ITERATION = {False: 3e-6, True: 5e-6}  # seconds per dof of an elastic and of a plastic iteration
_LINEAR = 3e4  # dofs up to which an iteration costs in proportion to them


def expected_dofs(scene: Scene) -> float:
    """About how many dofs the mesh of ``scene`` will have; a rigid pin, a tenth of them or less, counts as meshed."""
    return _DOFS_PER_CELL[scene.analysis.degree] * scene.joint.expected_cells


def expected_seconds(scene: Scene) -> float:
    """About how long ``scene`` will take on one rank of a machine of 2020, in a process that has solved before.

    Fitted by hand to runs of 2 450 to 8 336 dofs, elastic and plastic (README); beyond ``_LINEAR`` dofs the
    factorisation of a plane mesh grows as dofs^1.5 (George 1973).
    """
    dofs = expected_dofs(scene)
    iteration = _ITERATION[scene.plastic] * dofs * max(1.0, (dofs / _LINEAR) ** 0.5)
    return _SETUP[0] + _SETUP[1] * dofs + len(scene.targets) * (_STEP + _ITERATIONS * iteration)

"""Joints in space by CalculiX, on the mesh that archord solves on."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from archord.benchmarks.peers.calculix import process
from archord.benchmarks.space.case import Case, Compared, Solved, force
from archord.benchmarks.timing import run_once
from archord.presets.words import words_of

_LONG = 3600.0  # seconds


def solved_by_calculix(case: Case, size: float = 0.0) -> Solved:
    """What CalculiX gives for the forces of a ``case``, as `solved` of archord; seconds are of its
    process alone. Needs one rank, and raises `Failure` where CalculiX stops."""
    size = size or case.size
    problem = replace(case.problem(size), steps=case.steps)
    with tempfile.TemporaryDirectory() as folder:
        whole = process(words_of(problem, "joint.msh"), Path(folder), problem)
        run = run_once(replace(whole, limit=_LONG))
    opinion = run.result
    forces = next(iter(opinion.forces.values()))
    result = Solved(case, size, n_dofs=opinion.mesh.x.size, newton=opinion.iterations)
    result.seconds = run.seconds
    for reference in case.references:
        step = round(reference.displacement / case.deepest * case.steps)
        if reference.computed is force:
            result.compared.append(Compared(reference, abs(float(forces[step - 1]))))
    return result

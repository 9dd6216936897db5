"""Margins of safety: what a run found beside the usual sections of a hand calculation.

Margins are ``MS = allowable / applied - 1``. Forces are of the whole, as in history.csv: per unit
thickness where the scene has none. The applied force is ``load`` for the yield margins and
``load * factor`` for the ultimate ones. `archord.postprocess.judgement.sections` has the hand
formulas. By finite elements the allowable is the largest force that the run had reached when the
PEEQ of the part passed a limit at an integration point. A note tells how much the mesh counts for
it.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.material import Array
from archord.postprocess.judgement.parts import Part, no_sections, parts_of
from archord.postprocess.judgement.sections import proof_strength, tensile_strength
from archord.report.by_name import Amounts
from archord.report.errors import InputError
from archord.report.table import Table
from archord.scene.sections.bodies import Solid

if TYPE_CHECKING:
    from archord.postprocess.run import Run

YIELD_PEEQ = 0.01
_NO_PULL = 1e-9  # of the largest force: round-off


@dataclass(frozen=True)
class StrengthCheck:
    """One allowable: ``kind`` is "yield" or "ultimate", ``by`` is "hand" or "FE", ``bound`` tells
    that the run did not reach it, so that the ``allowable`` is the largest force that was solved,
    ``peeq`` is the limit of it, if there is one."""

    kind: str
    by: str
    name: str
    allowable: float
    applied: float
    bound: bool = False
    peeq: float = 0.0

    @property
    def margin(self) -> float | None:
        """``allowable / applied - 1``, at least that much of a bound; None where the run tells
        nothing of it."""
        if self.bound and self.allowable < self.applied:
            return None
        return self.allowable / self.applied - 1


@dataclass(frozen=True)
class Margins:
    """The ``checks`` of a part under a ``load``, the ``strengths`` that the hand formulas used,
    with a word on each, and ``notes``: what is assumed, and what the run cannot tell. ``part`` is
    what a clevis' part or a body is called, "" for a lug."""

    load: float
    factor: float
    unit: str
    stress: str
    strengths: dict[str, tuple[float, str]]
    checks: list[StrengthCheck]
    notes: list[str]
    part: str = ""

    def weakest(self, kind: str, by: str) -> StrengthCheck | None:
        """The check of this ``kind`` and origin with the smallest allowable."""
        found = [check for check in self.checks if (check.kind, check.by) == (kind, by)]
        return min(found, key=lambda check: check.allowable) if found else None


def margins(
    run: Run,
    load: float,
    *,
    part: str = "",
    factor: float = 1.0,
    proof: float | None = None,
    tensile: float | None = None,
    yield_peeq: float = YIELD_PEEQ,
    ultimate_peeq: float | None = None,
) -> Margins:
    """The margins of safety of a lug, of a part of a clevis or of a body under a force.

    Parameters
    ----------
    run : Run
        any run whose bodies yield under one load; a lug and a clevis have sections by hand
    load : float
        force on the whole, positive, in the unit of history.csv; on a whole clevis in its unit
        of force
    part : str
        "inner", "outer" or, in space, "pin" of a clevis; a body of any other scene, which may be
        left out if one body alone yields
    factor : float
        what the load is multiplied by for the ultimate margins, 1.5 if it is a limit load
    proof, tensile : float, optional
        strengths of the hand formulas; the run's hardening curve's if absent
    yield_peeq, ultimate_peeq : float
        largest PEEQ of the part at the yield load and at the ultimate load; the latter is the end
        of the hardening curve if absent

    Raises `InputError` for other runs, for numbers that are not positive, and for an elastic part
    without strengths.
    """
    given = {"--load": load, "--factor": factor, "--proof": proof, "--tensile": tensile}
    given |= {"--yield-peeq": yield_peeq, "--ultimate-peeq": ultimate_peeq}
    for name, value in given.items():
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} {value:g}: must be a positive number.")
    judged = _chosen(parts_of(run), part)
    applied = {"yield": load, "ultimate": load * factor}
    strengths = {}
    checks = []
    if judged.by_hand is not no_sections:
        strengths = _strengths(run, judged, proof, tensile)
        for kind, (strength, _) in strengths.items():
            for name, allowable in judged.by_hand(kind, strength).items():
                checks.append(StrengthCheck(kind, "hand", name, allowable, applied[kind]))
    notes = list(judged.notes)
    body = judged.body
    if body.yield_stress is None:
        notes.append(
            f"the {judged.noun} of this run is elastic: it has no yield, and no margins by finite "
            "elements"
        )
    else:
        last = _end_of_curve(body) if ultimate_peeq is None else ultimate_peeq
        peeq = np.asarray(run.columns[f"{body.name} peeq_max"])
        found, said = _by_elements(judged, peeq, applied, yield_peeq, last)
        checks += found
        notes += said
        if (run.folder / "fields.h5").exists():
            notes += _over_mesh(run, judged, [check for check in found if not check.bound])
    stress = run.scene.units.stress
    title = judged.noun if judged.name else ""
    return Margins(load, factor, judged.unit, stress, strengths, checks, notes, title)


def _chosen(parts: dict[str, Part], asked: str) -> Part:
    """The part that is asked for, or the only one. Raises `InputError`."""
    if not asked and len(parts) == 1:
        return next(iter(parts.values()))
    if asked in parts:
        return parts[asked]
    known = " or ".join(name for name in parts if name)
    said = f"must be {known}" if known else "is for a clevis or for bodies, and this run has a lug"
    raise InputError(f"--part {asked!r}: {said}.")


def _by_elements(
    part: Part, peeq: Array, applied: Amounts, yields: float, breaks: float | None
) -> tuple[list[StrengthCheck], list[str]]:
    """The checks of the steps' forces on a ``part`` and its largest PEEQ ``(n,)`` against the PEEQ
    at which it ``yields`` and ``breaks``, and notes on them."""
    force = part.force
    limits = [("yield", "first yield", 0.0), ("yield", f"PEEQ of {yields:.3g}", yields)]
    notes = ["first yield is local, and no failure"]
    if peeq[0] > 0:
        notes.append(
            f"the {part.noun} yields within the first step: shorter steps tell at what force"
        )
    if breaks is None:
        notes.append(
            f"no PEEQ is known at which the {part.noun} breaks, as its curve has no end: give "
            "--ultimate-peeq"
        )
    else:
        limits.append(("ultimate", f"PEEQ of {breaks:.3g}", breaks))
    checks = []
    for kind, name, limit in limits:
        allowable, reached = load_at(force, peeq, limit)
        check = StrengthCheck(kind, "FE", name, allowable, applied[kind], not reached, limit)
        checks.append(check)
        notes += _without_pull(part, peeq, limit, name)
    for kind in dict.fromkeys(check.kind for check in checks if check.margin is None):
        notes.append(
            f"the {kind} margin is not known by finite elements: {applied[kind]:g} is beyond the "
            f"largest force that was solved, {force.max():.5g}; solve further"
        )
    return checks, notes


def _over_mesh(run: Run, part: Part, checks: Sequence[StrengthCheck]) -> list[str]:
    """A note on each of the ``checks`` of a PEEQ: the force at which the mean of a cell passes it,
    mostly too late, and the force at which a value recovered at a node does, mostly too early."""
    limits = {check.name: check.peeq for check in checks if check.peeq}
    if not limits:
        return []
    largest = defaultdict(list)
    for step in range(1, run.steps + 1):
        fields = run.fields(step)
        tag = fields.bodies[part.body.name]
        largest["by means of cells"].append(fields.peeq[fields.body == tag].max())
        if fields.peeq_nodal is not None:
            at_nodes = fields.peeq_nodal[fields.body_of_node == tag]
            largest["by values recovered at nodes"].append(at_nodes.max())
    notes = []
    for name, limit in limits.items():
        said = []
        for how, found in largest.items():
            force, reached = load_at(part.force, np.array(found), limit)
            said.append(f"{'' if reached else '> '}{force:.5g} {part.unit} {how}")
        notes.append(f"the mesh counts for {name}: {', '.join(said)}")
    return notes


def _without_pull(part: Part, peeq: Array, limit: float, name: str) -> list[str]:
    """A note where the PEEQ of a ``part`` passes the ``limit`` of a criterion of this ``name`` in a
    step in which nothing pulls, as a fit or a push may be."""
    passed = np.flatnonzero(peeq > limit)
    if not len(passed) or part.force[passed[0]] > _NO_PULL * part.force.max():
        return []
    step = passed[0] + 1
    return [
        f"the {part.noun} passes {name} in step {step}, in which no force pulls: the allowable is "
        "of what came before; solve the pull alone"
    ]


def load_at(force: Array, peeq: Array, limit: float) -> tuple[float, bool]:
    """The largest of the forces ``(n,)``, step by step, until the PEEQ ``(n,)`` passes the
    ``limit``, and whether it does. Of the step in which it does the force is interpolated if it
    rises to a new largest one; at the limit 0 the step before counts, as there is no telling where
    within a step yielding begins."""
    passed = np.flatnonzero(peeq > limit)
    if not len(passed):
        return float(force.max()), False
    k = int(passed[0])
    before = float(max(force[:k].max(initial=0.0), 0.0))
    if limit == 0 or force[k] <= before:
        return before, True
    peeq_before = float(peeq[k - 1]) if k else 0.0
    force_before = max(float(force[k - 1]), 0.0) if k else 0.0
    share = (limit - peeq_before) / (peeq[k] - peeq_before)
    return max(before, force_before + share * (float(force[k]) - force_before)), True


def _strengths(
    run: Run, part: Part, proof: float | None, tensile: float | None
) -> dict[str, tuple[float, str]]:
    """The strengths of the hand formulas by kind of margin, and where they are from. Raises
    `InputError`."""
    body = part.body
    if body.yield_stress is None:
        if proof is None and tensile is None:
            raise InputError(
                run.folder,
                f"the {part.noun} is elastic: it has no yield; give --proof and "
                "--tensile for the hand formulas, or solve with a yield_stress.",
            )
        said = {"yield": proof, "ultimate": tensile}
        return {kind: (value, "given") for kind, value in said.items() if value is not None}
    if body.back_stresses and (proof is None or tensile is None):
        raise InputError(
            run.folder,
            f"the {part.noun} has back stresses, and no tension test of it is known "
            "here; give --proof and --tensile.",
        )
    found = {"yield": (proof_strength(body), "at 0.2 % plastic strain of the run's curve")}
    if proof:
        found["yield"] = (proof, "given")
    highest = "the largest engineering stress of the run's curve"
    if body.perfectly_plastic:
        highest = "the yield stress, as the run is perfectly plastic; --tensile gives another"
    found["ultimate"] = (tensile, "given") if tensile else (tensile_strength(body), highest)
    return found


def _end_of_curve(body: Solid) -> float | None:
    """PEEQ at the last point of a hardening table; None of a law, which has no end."""
    if body.yield_stress is None or isinstance(body.hardening, float):
        return None
    table = isinstance(body.hardening, list) or body.hardening.engineering is not None
    last = float(body.law.knots()[-1])
    return last if table and last > 0 else None


def margin_text(found: Margins) -> str:
    """The margins as tables, with the assumptions."""
    ultimate = ""
    if found.factor != 1:
        ultimate = f", ultimate load {found.load * found.factor:g} {found.unit}"
    title = f"{found.part}: " if found.part else ""
    lines = [f"{title}load {found.load:g} {found.unit}{ultimate}; MS = allowable / applied - 1"]
    for kind, (strength, source) in found.strengths.items():
        name = {"yield": "proof strength", "ultimate": "tensile strength"}[kind]
        lines.append(f"{name} {strength:.6g} {found.stress}: {source}")
    table = Table("margin", "by", "check", f"allowable [{found.unit}]", "MS", left=3)
    for check in found.checks:
        above = "> " if check.bound else ""
        margin = "not known" if check.margin is None else f"{above}{check.margin:+.3f}"
        table.add(check.kind, check.by, check.name, f"{above}{check.allowable:.6g}", margin)
    lines += ["", str(table), ""]
    for kind in ("yield", "ultimate"):
        hand = found.weakest(kind, "hand")
        fe = _compared(found, kind)
        if hand and fe and not fe.bound:
            off = fe.allowable / hand.allowable - 1
            lines.append(
                f"{kind}: by hand {hand.name} is the weakest; finite elements ({fe.name}) are "
                f"{off:+.1%} off it"
            )
    return "\n".join([*lines, *(f"note: {note}" for note in found.notes)])


def _compared(found: Margins, kind: str) -> StrengthCheck | None:
    """The criterion of finite elements beside a hand formula: the last, as first yield is none of a
    section."""
    by_elements = [check for check in found.checks if (check.kind, check.by) == (kind, "FE")]
    return by_elements[-1] if by_elements else None

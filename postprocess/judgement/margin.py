"""Margins of safety of lugs: what a run found beside the usual sections of a hand calculation.

Margins are ``MS = allowable / applied - 1``. Forces are of the whole lug, as in history.csv:
per unit thickness where the scene has none. The applied force is ``load`` for the yield margins and
``load * factor`` for the ultimate ones.

By hand, of a plate of width ``W``, edge distance ``e``, thickness ``t``, with a hole of diameter
``D`` and a pin of diameter ``d``, or a bushing pressed in (``d = D``), and the proof strength or
the tensile strength for ``f``:

    net section   f (W - D) t
    bearing       1.5 f d t                               EN 1993-1-8, table 3.10
    shear-out     2 (e - D/2 cos 40 deg) t f / sqrt(3)    Bruhn 1973, chapter D1

By finite elements the allowable is the largest force that the run had reached when the PEEQ of the
lug passed a limit.

Each plate of a clevis is such a lug. Its forces are of the whole clevis there: ``t`` is the
thickness of the inner plate, and of both outer plates together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.materials.material import Array
from archord.report.errors import InputError
from archord.report.table import Table
from archord.scene.presets.lug import LugShape
from archord.scene.sections.bodies import Solid

if TYPE_CHECKING:
    from archord.postprocess.run import Run

PROOF = 0.002  # plastic strain at the proof strength
YIELD_PEEQ = 0.01
_SPREAD = math.radians(40)  # where the shear-out planes leave the hole, from the load axis
_BEARING = 1.5


@dataclass(frozen=True)
class StrengthCheck:
    """One allowable: ``kind`` is "yield" or "ultimate", ``by`` is "hand" or "FE", ``bound`` tells
    that the run did not reach it, so that the ``allowable`` is the largest force that was
    solved."""

    kind: str
    by: str
    name: str
    allowable: float
    applied: float
    bound: bool = False

    @property
    def margin(self) -> float | None:
        """``allowable / applied - 1``, at least that much of a bound; None where the run tells
        nothing of it."""
        if self.bound and self.allowable < self.applied:
            return None
        return self.allowable / self.applied - 1


@dataclass(frozen=True)
class Margins:
    """The ``checks`` of a lug under a ``load``, the ``strengths`` that the hand formulas used, with
    a word on each, and ``notes``: what is assumed, and what the run cannot tell. ``plate`` is the
    plate of a clevis, "" for a lug."""

    load: float
    factor: float
    unit: str
    stress: str
    strengths: dict[str, tuple[float, str]]
    checks: list[StrengthCheck]
    notes: list[str]
    plate: str = ""

    def weakest(self, kind: str, by: str) -> StrengthCheck | None:
        """The check of this ``kind`` and origin with the smallest allowable."""
        found = [check for check in self.checks if (check.kind, check.by) == (kind, by)]
        return min(found, key=lambda check: check.allowable) if found else None


@dataclass(frozen=True)
class _Lug:
    """One lug of a run: its ``shape``, its ``body``, the load that pulls it, the ``thickness`` of
    all plates of its kind, and what its column of forces is multiplied by for the force on the
    whole, in the ``unit``."""

    shape: LugShape
    body: Any
    pull: str
    thickness: float
    factor: float
    unit: str


def plates_of(run: Run) -> list[str]:
    """What `margins` takes for ``plate``: the plates of a clevis, "" alone for a lug. Raises
    `InputError`."""
    return list(_lugs_of(run))


def margins(
    run: Run,
    load: float,
    *,
    plate: str = "",
    factor: float = 1.0,
    proof: float | None = None,
    tensile: float | None = None,
    yield_peeq: float = YIELD_PEEQ,
    ultimate_peeq: float | None = None,
) -> Margins:
    """The margins of safety of the lug of ``run`` under a pull ``load``.

    Parameters
    ----------
    run : Run
        a run of a [lug] or a [clevis], or of a general scene on the shape of one
    load : float
        force on the whole lug, positive, in the unit of history.csv; on a whole clevis in its unit
        of force
    plate : str
        "inner" or "outer" of a clevis
    factor : float
        what the load is multiplied by for the ultimate margins, 1.5 if it is a limit load
    proof, tensile : float, optional
        strengths of the hand formulas; the run's hardening curve's if absent
    yield_peeq, ultimate_peeq : float
        largest PEEQ of the lug at the yield load and at the ultimate load; the latter is the end of
        the hardening curve if absent

    Raises `InputError` for other runs, for numbers that are not positive, and for an elastic lug
    without strengths.
    """
    given = {"--load": load, "--factor": factor, "--proof": proof, "--tensile": tensile}
    given |= {"--yield-peeq": yield_peeq, "--ultimate-peeq": ultimate_peeq}
    for name, value in given.items():
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} {value:g}: must be a positive number.")
    lugs = _lugs_of(run)
    if plate not in lugs:
        fault = "must be inner or outer"
        if "" in lugs:
            fault = "is for a clevis, and this run is one of a lug"
        raise InputError(f"--plate {plate!r}: {fault}.")
    lug = lugs[plate]
    strengths = _strengths(run, lug.body, proof, tensile)
    applied = {"yield": load, "ultimate": load * factor}
    checks = [
        StrengthCheck(kind, "hand", name, allowable, applied[kind])
        for kind, (strength, _) in strengths.items()
        for name, allowable in by_hand(lug.shape, strength, lug.thickness).items()
    ]
    bears = "hole" if lug.shape.wall else "pin"
    notes = [f"bearing by hand is {_BEARING:g} times the strength on the diameter of the {bears}"]
    if lug.body.yield_stress is None:
        notes.append(
            "the lug of this run is elastic: it has no yield, and no margins by finite elements"
        )
    else:
        last = _end_of_curve(lug.body) if ultimate_peeq is None else ultimate_peeq
        force = np.asarray(run.columns[f"{lug.pull} force"]) * lug.factor
        peeq = np.asarray(run.columns[f"{lug.body.name} peeq_max"])
        found, said = _by_elements(force, peeq, applied, yield_peeq, last)
        checks += found
        notes += said
    return Margins(load, factor, lug.unit, run.scene.units.stress, strengths, checks, notes, plate)


def _by_elements(
    force: Array, peeq: Array, applied: dict[str, float], yields: float, breaks: float | None
) -> tuple[list[StrengthCheck], list[str]]:
    """The checks of the steps' forces ``(n,)`` and largest PEEQ ``(n,)`` against the PEEQ at which
    the lug ``yields`` and ``breaks``, and notes on them."""
    limits = [("yield", "first yield", 0.0), ("yield", f"PEEQ of {yields:.3g}", yields)]
    notes = ["first yield is local, at the hole, and no failure"]
    if peeq[0] > 0:
        notes.append("the lug yields within the first step: shorter steps tell at what force")
    if breaks is None:
        notes.append(
            "no PEEQ is known at which the lug breaks, as its curve has no end: give "
            "--ultimate-peeq"
        )
    else:
        limits.append(("ultimate", f"PEEQ of {breaks:.3g}", breaks))
    checks = []
    for kind, name, limit in limits:
        allowable, reached = load_at(force, peeq, limit)
        checks.append(StrengthCheck(kind, "FE", name, allowable, applied[kind], bound=not reached))
    for kind in dict.fromkeys(check.kind for check in checks if check.margin is None):
        notes.append(
            f"the {kind} margin is not known by finite elements: {applied[kind]:g} is beyond the "
            f"largest force that was solved, {force.max():.5g}; solve further"
        )
    return checks, notes


def by_hand(lug: LugShape, strength: float, thickness: float) -> dict[str, float]:
    """Forces at which the sections of a ``lug`` reach a ``strength``; what bears on it is the pin
    or the bushing."""
    edge = lug.arguments()["edge_distance"]
    bore = lug.hole
    bearing = bore if lug.wall else lug.radius
    planes = 2 * (edge - bore * math.cos(_SPREAD))
    return {
        "net section": strength * (lug.width - 2 * bore) * thickness,
        "bearing": _BEARING * strength * 2 * bearing * thickness,
        "shear-out": planes * thickness * strength / math.sqrt(3),
    }


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


def proof_strength(solid: Solid) -> float:
    """The engineering stress at a plastic strain of 0.2 %, or first yield where that is higher, as
    with a plateau."""
    first = float(solid.yield_stress or 0.0)
    true = float(solid.law.stress(np.array([PROOF]))[0])
    return max(first, true * math.exp(-PROOF - true / solid.E))


def tensile_strength(solid: Solid) -> float:
    """The largest engineering stress of the hardening curve; beyond it a bar necks (Considere)."""
    peeq = np.append(solid.law.knots(), PROOF)
    true = solid.law.stress(peeq)
    return max(proof_strength(solid), float((true * np.exp(-peeq - true / solid.E)).max()))


def _strengths(
    run: Run, plate: Solid, proof: float | None, tensile: float | None
) -> dict[str, tuple[float, str]]:
    """The strengths of the hand formulas by kind of margin, and where they are from. Raises
    `InputError`."""
    if plate.yield_stress is None:
        if proof is None and tensile is None:
            raise InputError(
                f"{run.folder}: the lug is elastic: it has no yield; give --proof and --tensile "
                "for the hand formulas, or solve with a yield_stress."
            )
        said = {"yield": proof, "ultimate": tensile}
        return {kind: (value, "given") for kind, value in said.items() if value is not None}
    if plate.back_stresses and (proof is None or tensile is None):
        raise InputError(
            f"{run.folder}: the lug has back stresses, and no tension test of it is known here; "
            "give --proof and --tensile."
        )
    found = {"yield": (proof_strength(plate), "at 0.2 % plastic strain of the run's curve")}
    if proof:
        found["yield"] = (proof, "given")
    highest = "the largest engineering stress of the run's curve"
    if plate.perfectly_plastic:
        highest = "the yield stress, as the run is perfectly plastic; --tensile gives another"
    found["ultimate"] = (tensile, "given") if tensile else (tensile_strength(plate), highest)
    return found


def _end_of_curve(plate: Solid) -> float | None:
    """PEEQ at the last point of a hardening table; None of a law, which has no end."""
    if plate.yield_stress is None or isinstance(plate.hardening, float):
        return None
    table = isinstance(plate.hardening, list) or plate.hardening.engineering is not None
    last = float(plate.law.knots()[-1])
    return last if table and last > 0 else None


def _lugs_of(run: Run) -> dict[str, _Lug]:
    """The lugs of a run: the inner and the outer plate of a clevis, or "". Raises `InputError` for
    other runs, and where no load pulls."""
    shape = getattr(getattr(run.scene, "mesh", None), "shape", None)
    kind = getattr(shape, "kind", "")
    if kind not in ("lug", "clevis"):
        raise InputError(
            f"{run.folder}: is no run of a [lug] or a [clevis], whose sections the hand formulas "
            "know."
        )
    run.number(None)
    if kind == "lug":
        lugs = {"": _lug_of(run)}
    else:
        lugs = {name: _plate_of(run, name) for name in ("inner", "outer")}
    for lug in lugs.values():
        if max(run.columns[f"{lug.pull} force"]) <= 0:
            raise InputError(
                f"{run.folder}: the pin never pulls at the lug's end: the force of {lug.pull!r} is "
                "never above 0."
            )
    return lugs


def _lug_of(run: Run) -> _Lug:
    """The lug of a run of a [lug]. Raises `InputError`."""
    pulls = [load.name for load in run.scene.load if load.direction == "x"]
    if len(pulls) != 1 or len(run.scene.load) != 1:
        names = ", ".join(load.name for load in run.scene.load)
        raise InputError(
            f"{run.folder}: is loaded by {names}; the hand formulas are for one load along the "
            "lug, in x."
        )
    pull = pulls[0]
    unit = run.units[f"{pull} force"]
    body = _body_of(run, "lug")
    shape = run.scene.mesh.shape
    thickness = run.scene.thickness if shape.space is None else shape.space.thickness
    return _Lug(shape, body, pull, thickness, 1.0, unit)


def _plate_of(run: Run, name: str) -> _Lug:
    """The inner or the outer plate of a run of a [clevis]; its columns of forces are per unit of
    its thickness. Raises `InputError`."""
    shape = run.scene.mesh.shape
    in_space = shape.space is not None
    pull = "pull" if in_space else f"{name} pull"
    drawn = getattr(shape, name)
    known = {"pull"} if in_space else {"inner pull", "outer pull"}
    if {load.name for load in run.scene.load} != known:
        names = " and ".join(map(repr, sorted(known)))
        raise InputError(f"{run.folder}: margins of a clevis are for its loads {names} alone.")
    if drawn.thickness is None:
        raise InputError(
            f"{run.folder}: mesh.shape.{name}.thickness is missing, which margins need; solve it "
            "again."
        )
    number = {"inner": 1, "outer": 2}[name]
    together = number * drawn.thickness
    lug = LugShape(radius=shape.radius, clearance=shape.clearance, **drawn.outline(shape))
    unit = run.scene.units.force_of(1.0)
    per = 1.0 if in_space else together
    return _Lug(lug, _body_of(run, name), pull, together, per, unit)


def _body_of(run: Run, cells: str) -> Any:
    return next(body for body in run.scene.body if (body.cells or body.name) == cells)


def margin_text(found: Margins) -> str:
    """The margins as tables, with the assumptions."""
    ultimate = ""
    if found.factor != 1:
        ultimate = f", ultimate load {found.load * found.factor:g} {found.unit}"
    title = f"{found.plate} plate: " if found.plate else ""
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

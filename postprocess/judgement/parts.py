"""What of a run can be judged: a lug, the plates and the pin of a clevis, or any body."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.materials.material import Array
from archord.postprocess.judgement.sections import (
    BEARING,
    ClevisPin,
    lug_forces,
    tensile_strength,
)
from archord.report.by_name import Amounts, Names
from archord.report.errors import InputError
from archord.scene.parts import BodySection
from archord.scene.presets.lug import LugShape

if TYPE_CHECKING:
    from archord.postprocess.run import Run

PLATES = {"inner": 1, "outer": 2}  # of a clevis, and how many it has of each


def no_sections(kind: str, strength: float) -> Amounts:
    """By hand of a body whose sections are not known."""
    return {}


@dataclass(frozen=True)
class Part:
    """A ``body`` of a run, and the ``force`` ``(n,)`` of each step on the whole, in ``unit``.

    ``by_hand`` gives the forces at which sections reach a strength, from the kind of margin and the
    strength. ``notes`` say what the formulas assume. ``noun`` is what messages call the body.
    """

    name: str
    body: BodySection
    force: Array
    unit: str
    noun: str
    by_hand: Callable[[str, float], Amounts] = no_sections
    notes: Names = ()


def parts_of(run: Run) -> dict[str, Part]:
    """The parts of a run that have sections by hand: "" of a lug; "inner", "outer" and in space
    "pin" of a clevis. Without such parts, the bodies by their names. Raises `InputError`."""
    run.number(None)
    kind = getattr(_shape_of(run), "kind", "")
    if kind == "lug":
        return {"": _lug(run)}
    if kind != "clevis":
        return _bodies(run)
    found = {name: _plate(run, name) for name in PLATES}
    if _shape_of(run).space is not None:
        found["pin"] = _pin(run, found["inner"])
    return found


def _shape_of(run: Run) -> Any:
    return getattr(getattr(run.scene, "mesh", None), "shape", None)


def _lug(run: Run) -> Part:
    """The lug of a run of a [lug]. Raises `InputError`."""
    pull = _only_load(run)
    if run.scene.load[0].direction != "x":
        raise InputError(
            run.folder,
            f"is loaded by {pull}; the hand formulas are for one load along the lug, in x.",
        )
    shape = _shape_of(run)
    thickness = run.scene.thickness
    bears = math.inf
    if shape.space is not None:
        thickness = shape.space.thickness
        # a bushing is as long as its hole
        if not shape.wall:
            pin = shape.space.arguments()["pin_length"]
            bears = min(pin, thickness - 2 * shape.space.blunt)
    force = _pulling(run, pull)
    unit = run.units[f"{pull} force"]
    return _sectioned("", _body_of(run, "lug"), force, unit, shape, thickness, bears)


def _plate(run: Run, name: str) -> Part:
    """The inner or the outer plate of a run of a [clevis]; its columns of forces are per unit of
    its thickness. Raises `InputError`."""
    shape = _shape_of(run)
    in_space = shape.space is not None
    known = {"pull"} if in_space else {f"{plate} pull" for plate in PLATES}
    if {load.name for load in run.scene.load} != known:
        names = " and ".join(map(repr, sorted(known)))
        raise InputError(run.folder, f"margins of a clevis are for its loads {names} alone.")
    drawn = getattr(shape, name)
    if drawn.thickness is None:
        raise InputError(
            run.folder,
            f"mesh.shape.{name}.thickness is missing, which margins need; solve it again.",
        )
    together = PLATES[name] * drawn.thickness
    bears = math.inf
    if in_space and not shape.wall:
        bears = PLATES[name] * (drawn.thickness - 2 * shape.space.blunt)
    outline = drawn.outline(shape)
    lug = LugShape(
        radius=shape.radius, clearance=shape.clearance, wall=shape.wall or None, **outline
    )
    force = _pulling(run, "pull" if in_space else f"{name} pull")
    if not in_space:
        force = force * together
    unit = run.scene.units.force_of(1.0)
    return _sectioned(name, _body_of(run, name), force, unit, lug, together, bears)


def _sectioned(
    name: str,
    body: BodySection,
    force: Array,
    unit: str,
    lug: LugShape,
    thickness: float,
    bears: float = math.inf,
) -> Part:
    """A part with the sections of a ``lug`` by hand, on which a pin ``bears`` over this length."""
    inner = "hole" if lug.wall else "pin"
    note = f"bearing by hand is {BEARING:g} times the strength on the diameter of the {inner}"
    if bears < thickness:
        note += f", over the length {bears:g} on which the pin lies"

    def by_hand(_: str, strength: float) -> Amounts:
        return lug_forces(lug, strength, thickness, bears)

    noun = f"{name} plate" if name else "lug"
    return Part(name, body, force, unit, noun, by_hand, (note,))


def _pin(run: Run, inner: Part) -> Part:
    """The pin of a clevis in space, under the force on its ``inner`` plate."""
    shape = _shape_of(run)
    both_rims = 2 * shape.space.blunt
    pin = ClevisPin(
        shape.radius,
        shape.space.bore,
        shape.inner.thickness - both_rims,
        shape.outer.thickness - both_rims,
        shape.space.gap + both_rims,
    )
    plates = [_plate(run, name) for name in PLATES]
    notes = ["by hand the proof strength counts at the surface, the tensile one all over a section"]
    weakest = None
    if all(plate.body.yield_stress is not None for plate in plates):
        weakest = (_weakest(plates[0]), _weakest(plates[1]))
        notes.append("where ends bear, the plates press with their ultimate forces per thickness")
    else:
        notes.append("where the ends of plates bear is not known of plates without a yield stress")

    def by_hand(kind: str, strength: float) -> Amounts:
        return pin.forces(kind, strength, weakest)

    return Part("pin", _body_of(run, "pin"), inner.force, inner.unit, "pin", by_hand, tuple(notes))


def _weakest(plate: Part) -> float:
    """The smallest force at which a section of a ``plate`` reaches its tensile strength."""
    return min(plate.by_hand("ultimate", tensile_strength(plate.body)).values())


def _bodies(run: Run) -> dict[str, Part]:
    """Every body that yields, under the only load. Raises `InputError`."""
    pull = _only_load(run)
    if f"{pull} force" not in run.columns:
        raise InputError(run.folder, f"has no column of the force {pull!r}, which margins need.")
    note = "no section of this body is known by hand; those of [lug] and [clevis] are"
    force = np.abs(np.asarray(run.columns[f"{pull} force"]))
    unit = run.units[f"{pull} force"]
    found = {
        body.name: Part(body.name, body, force, unit, f"body {body.name!r}", notes=(note,))
        for body in run.scene.body
        if body.yield_stress is not None
    }
    if not found:
        raise InputError(run.folder, "no body yields, so there is no margin to tell.")
    return found


def _only_load(run: Run) -> str:
    loads = getattr(run.scene, "load", None)
    if not isinstance(loads, list) or len(loads) != 1:
        raise InputError(
            run.folder,
            f"margins are for a scene of bodies under one load, and this run has {_named(loads)}.",
        )
    return loads[0].name


def _named(loads: Any) -> str:
    if not isinstance(loads, list):
        return "the loads of a [joint]"
    return ", ".join(load.name for load in loads) or "none"


def _pulling(run: Run, pull: str) -> Array:
    """The force ``(n,)`` of a load. Raises `InputError` where it never pulls."""
    force = np.asarray(run.columns[f"{pull} force"])
    round_off = 1e-12 * max(body.E for body in run.scene.body) * _shape_of(run).radius
    if max(force) <= round_off:
        raise InputError(
            run.folder,
            f"the pin never pulls at the lug's end: the force of {pull!r} is never above 0.",
        )
    return force


def _body_of(run: Run, cells: str) -> Any:
    return next(body for body in run.scene.body if (body.cells or body.name) == cells)

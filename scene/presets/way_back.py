"""Pins that are moved back from the side of the hole that they press: what presets do not model
there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

_MOVED = ("flat", "centre")  # the sets by which presets move a pin, in +x
_MOVED_DOWN = ("pin top", "contact")  # of a [joint], the set and the rigid disc, in -y
_WHOLE = 'mesh.shape.pin = "whole" (pin.whole = true in a preset) has both sides'
_TWO_SCENES = "a joint that is loaded both ways takes two scenes, one for each direction"


class _Load(Protocol):
    """A load of a general scene."""

    name: str
    on: str
    direction: Any

    @property
    def kind(self) -> str: ...

    @property
    def stages(self) -> list[float]: ...


def doubts_of_way_back(shape: Any, loads: Sequence[_Load]) -> Iterator[str]:
    """What to warn of where ``loads`` move the pin of a preset's ``shape``, if there is one, so far
    back that it would press the other side of the hole, and that side or this half of the pin is
    not there."""
    if shape is None:
        return
    places = _MOVED
    sign = 1.0
    cure = _WHOLE
    if shape.kind == "joint":
        places = _MOVED_DOWN
        sign = -1.0
        cure = _TWO_SCENES
    elif shape.pin != "half" or (shape.kind == "clevis" and shape.space is not None):
        return  # the pin is whole, as it always is in a clevis in space
    room = _room_behind(shape)
    for load in loads:
        place = load.on.removeprefix("inner ").removeprefix("outer ")
        if place not in places or load.direction != ("x" if sign > 0 else "y"):
            continue
        least = min(sign * value for value in load.stages)
        moved = f'load "{load.name}".{load.kind} = {sign * least:g} moves the pin back'
        if load.kind == "force" and least < 0:
            yield f"{moved}, where nothing is modelled that it presses: no result counts; {cure}"
        if load.kind == "displacement" and least < -room:
            yield (
                f"{moved} by more than {room:g}: it would press the other side of the hole there, "
                f"which is not modelled, so its force is missing; {cure}"
            )


def _room_behind(shape: Any) -> float:
    """How far the pin of a ``shape`` may go back before a whole one would touch."""
    if shape.kind == "bushing":
        clearance = shape.rings[0][0] - shape.radius
    elif shape.kind == "joint":
        clearance = shape.dR
    else:
        clearance = shape.clearance
    touches = getattr(shape, "touching", True)
    return float(max(clearance, 0.0) * (2 if touches else 1))

"""Warnings of a run's steps: each kind is told once, from its first step on, as it is at its
worst."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

_STEP = re.compile(r"^step \d+: ")
_NAME = re.compile(r"('[^']*')")
_NUMBER = re.compile(r"[0-9.e+-]+")


class Doubt(str):
    """A warning; of two of a kind the one of the larger ``size`` is worse."""

    __slots__ = ("size",)
    size: float

    def __new__(cls, said: str, size: float) -> Doubt:
        """The sentence ``said``, with how bad it is."""
        doubt = super().__new__(cls, said)
        doubt.size = float(size)
        return doubt


def kind(said: str) -> str:
    """What two warnings of a kind share: all but their step and the numbers outside of quoted
    names."""
    parts = _NAME.split(_STEP.sub("", said))
    parts[::2] = [_NUMBER.sub("#", part) for part in parts[::2]]
    return "".join(parts)


def of_cases(warnings: Iterable[tuple[int, Iterable[str]]]) -> list[str]:
    """Each kind of the ``warnings`` of cases by their numbers once, with the first case that has it
    and how many more have."""
    found: dict[str, list[tuple[int, str]]] = {}
    for number, said in warnings:
        own = {kind(warning): warning for warning in reversed(list(said))}
        for name, warning in own.items():
            found.setdefault(name, []).append((number, warning))
    told = []
    for (number, warning), *others in found.values():
        more = f" and {len(others)} more" if others else ""
        told.append(f"case {number}{more}: {warning}")
    return told


@dataclass
class Told:
    """A kind of warning: what is ``said`` of the step ``worst``, and the ``first`` step that gave
    it."""

    said: str
    size: float
    first: int
    worst: int

    def __str__(self) -> str:
        """The sentence, which begins with its first step."""
        later = f" (at its worst in step {self.worst})" if self.worst > self.first else ""
        return f"step {self.first}: {self.said}{later}"


def tell(told: dict[str, Told], step: int, warnings: Iterable[str]) -> None:
    """Add the ``warnings`` of a ``step`` to what is ``told``, by kinds."""
    for said in warnings:
        size = getattr(said, "size", 0.0)
        known = told.setdefault(kind(said), Told(str(said), size, step, step))
        if size > known.size:
            known.said = str(said)
            known.size = size
            known.worst = step

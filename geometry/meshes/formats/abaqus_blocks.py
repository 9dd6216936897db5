"""The blocks of an Abaqus or CalculiX input file: keywords with options and rows, the files that it
includes, and the parts of an assembly, each as often as it has an instance."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.meshes.formats.beside import beside

Options = dict[str, str]
Rows = list[list[str]]

_DEEPEST = 5  # files included in each other
_NUMBERS = 2**40  # of the nodes or elements of an instance


class Block(NamedTuple):
    """A keyword in capitals, its options by names in capitals, and the rows of data below it."""

    keyword: str
    options: Options
    rows: Rows


@dataclass(frozen=True)
class Scope:
    """An instance of a part, the ``index``-th, or with the number 0 and no name what lies beside
    all instances.

    Its nodes are moved by ``shift`` ``(3,)``, then turned by the matrix ``turn`` ``(3, 3)`` about
    the point ``centre`` ``(3,)``.
    """

    name: str = ""
    index: int = 0
    shift: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: np.eye(3))
    centre: Array = field(default_factory=lambda: np.zeros(3))

    def key(self, number: str) -> int:
        """A node or element by its ``number`` here as one among all instances. Raises
        ValueError."""
        if not number.isdecimal() or int(number) >= _NUMBERS:
            raise ValueError(f"{number!r} is no number of a node or an element")
        return self.index * _NUMBERS + int(number)

    def qualified(self, name: str) -> str:
        """The ``name`` of a set here among all instances."""
        return f"{self.name}.{name}" if self.name else name

    def placed(self, x: list[float]) -> list[float]:
        """Where the instance has the point ``x`` ``(3,)`` of its part."""
        if not self.index:
            return x
        moved = np.array(x) + self.shift - self.centre
        return list(map(float, self.centre + self.turn @ moved))


def number_of(key: int) -> int:
    """The number in its instance of what has this ``key``."""
    return key % _NUMBERS


def scoped_blocks(path: Path) -> Iterator[tuple[Scope, Block]]:
    """The blocks of the file ``path``, the blocks of a part in every instance of it; of parts
    without any instance, in their own place. Raises ValueError."""
    parts: dict[str, tuple[str, list[Block]]] = {}
    scopes: dict[str, Scope] = {}
    beside_all = Scope()
    scope = beside_all
    part: list[Block] | None = None
    for block in _blocks(path):
        keyword, options, rows = block
        if keyword == "PART":
            name = _new(options, "PART", parts)
            part = []
            parts[name.upper()] = name, part
        elif keyword == "END PART":
            part = None
        elif keyword == "INSTANCE":
            name = _new(options, "INSTANCE", scopes)
            scope = _instance(name, len(scopes) + 1, rows)
            scopes[name.upper()] = scope
            of_part = options.get("PART", "")
            if of_part.upper() not in parts:
                raise ValueError(f"there is no *PART {of_part!r} above its instance {name!r}")
            yield from ((scope, one) for one in parts[of_part.upper()][1])
        elif keyword == "END INSTANCE":
            scope = beside_all
        elif part is not None:
            part.append(block)
        elif "INSTANCE" in options and keyword in ("NSET", "ELSET"):
            named = options["INSTANCE"]
            if named.upper() not in scopes:
                raise ValueError(f"there is no *INSTANCE {named!r} above a set of it")
            yield scopes[named.upper()], block
        else:
            yield scope, block
    if not scopes:
        for index, (name, blocks) in enumerate(parts.values(), 1):
            alone = Scope(name if len(parts) > 1 else "", index)
            yield from ((alone, one) for one in blocks)


def _new(options: Options, keyword: str, known: dict) -> str:
    """The name of a part or an instance. Raises ValueError for none, and for one that is
    ``known``."""
    name = options.get("NAME", "")
    if not name or name.upper() in known:
        raise ValueError(
            f"the *{keyword} {name!r} is there twice" if name else f"a *{keyword} has no name"
        )
    return name


def _instance(name: str, index: int, rows: Rows) -> Scope:
    """An instance that is moved by its first row, and turned about the axis between two points by
    an angle in degrees in its second. Raises ValueError."""
    numbers = [[float(value or 0) for value in row] for row in rows]
    if (
        len(numbers) > 2
        or any(len(row) > 3 for row in numbers[:1])
        or any(len(row) != 7 for row in numbers[1:])
    ):
        raise ValueError(
            f"the *INSTANCE {name!r} must have a row of 3 numbers to move it, and one of 7 to "
            "turn it"
        )
    shift = np.zeros(3)
    if numbers:
        shift[: len(numbers[0])] = numbers[0]
    if len(numbers) < 2:
        return Scope(name, index, shift)
    start, end = np.array(numbers[1][:6]).reshape(2, 3)
    angle = np.radians(numbers[1][6])
    length = np.linalg.norm(end - start)
    if not length > 0:
        raise ValueError(
            f"the *INSTANCE {name!r} is turned about an axis between two points that are one"
        )
    x, y, z = (end - start) / length
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    of_sine = np.sin(angle) * cross
    of_cosine = (1 - np.cos(angle)) * cross @ cross
    turn = np.eye(3) + of_sine + of_cosine  # Rodrigues
    return Scope(name, index, shift, turn, start)


def _lines(path: Path, mesh: Path, depth: int = 0) -> Iterator[str]:
    """The lines of a file, keywords whole, and the lines of the files that it includes, which
    lie in the folder of the ``mesh``."""
    if depth > _DEEPEST:
        raise ValueError(f"{path.name} includes itself")
    text = path.read_text(encoding="utf-8", errors="replace")
    for line in map(str.strip, re.sub(r",[ \t]*\n(?=[^*\n]*=)", ",", text).splitlines()):
        if line and not line.startswith("**"):
            if not line.upper().startswith("*INCLUDE"):
                yield line
            if file := re.match(r"\*.*,\s*INPUT\s*=([^,]*)", line, re.IGNORECASE):
                yield from _lines(beside(mesh, file[1].strip(' "')), mesh, depth + 1)


def _blocks(path: Path) -> list[Block]:
    """The blocks of the file ``path`` as they stand there."""
    blocks = [Block("", {}, [])]
    for line in _lines(path, path):
        # a blank first place stands for a number, too
        first, *others = (part.strip(' "') for part in line.rstrip(", ").split(","))
        if line.startswith("*"):
            pairs = (option.partition("=") for option in others)
            options = {key.strip().upper(): value.strip(' "') for key, _, value in pairs}
            blocks.append(Block(" ".join(first[1:].upper().split()), options, []))
        else:
            blocks[-1].rows.append([first, *others])
    return blocks

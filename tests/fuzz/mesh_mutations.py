"""Meshes as people and programs get them wrong: numbers, rows and elements of an input file, which
stays one."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

Rows = list[list[str]]
_VALUES = ("nan", "inf", "-inf", "1e300", "-1e-300", "1e9", "0", "", "x", "0.5", "1.0", "-1")


def mutate_mesh(rng: Random, text: str) -> tuple[str, str]:
    """The kinds of one to three changes, and what they make of the input file ``text``."""
    lines = text.splitlines()
    kinds = [rng.choice(list(_KINDS)) for _ in range(rng.choice((1, 1, 1, 2, 3)))]
    for kind in kinds:
        _KINDS[kind](rng, lines)
    return " and ".join(kinds), "\n".join(lines) + "\n"


def _rows(lines: list[str], keyword: str) -> list[int]:
    """Where the rows below a keyword stand."""
    found = []
    inside = False
    for k, line in enumerate(lines):
        if line.startswith("*"):
            inside = line.upper().startswith(f"*{keyword}")
        elif inside:
            found.append(k)
    return found


def _change(
    rng: Random, lines: list[str], keyword: str, change: Callable[[list[str]], list[str]]
) -> None:
    """Change the entries of a row below the ``keyword``."""
    k = rng.choice(_rows(lines, keyword) or [0])
    lines[k] = ", ".join(change([entry.strip() for entry in lines[k].split(",")]))


def _node_moved(rng: Random, lines: list[str]) -> None:
    by = rng.choice((1e-12, 1e-3, 0.1, 0.4, 1.0, 100.0)) * rng.choice((-1, 1))
    axis = rng.choice((1, 2))

    def change(row: list[str]) -> list[str]:
        return [*row[:axis], _moved(row[axis], by), *row[axis + 1 :]]

    _change(rng, lines, "NODE", change)


def _moved(entry: str, by: float) -> str:
    try:
        return repr(float(entry) + by)
    except ValueError:
        return repr(by)


def _value(rng: Random, lines: list[str]) -> None:
    keyword = rng.choice(("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE"))
    new = rng.choice(_VALUES)
    place = rng.randrange(5)
    _change(rng, lines, keyword, lambda row: [*row[:place], new, *row[place + 1 :]])


def _nodes_swapped(rng: Random, lines: list[str]) -> None:
    i, j = rng.sample(range(1, 5), 2)

    def change(row: list[str]) -> list[str]:
        if len(row) == 5:
            row[i], row[j] = row[j], row[i]
        return row

    _change(rng, lines, "ELEMENT", change)


def _reversed(rng: Random, lines: list[str]) -> None:
    _change(rng, lines, "ELEMENT", lambda row: [row[0], *row[:0:-1]])


def _collapsed(rng: Random, lines: list[str]) -> None:
    _change(rng, lines, "ELEMENT", lambda row: [*row[:-1], row[-2 % len(row)]])


def _scaled(rng: Random, lines: list[str]) -> None:
    """All coordinates along one or both axes, by a power of ten or turned over."""
    factors = rng.choice(
        ((1e-3, 1e-3), (1e3, 1e3), (-1, 1), (1, -1), (1, 1e-6), (1e6, 1), (0, 1), (1e-200, 1e-200))
    )
    for k in _rows(lines, "NODE"):
        number, *place = lines[k].split(",")
        try:
            x = [float(value) * factor for value, factor in zip(place, factors, strict=False)]
        except ValueError:
            continue
        lines[k] = ", ".join([number, *map(repr, x)])


def _line(rng: Random, lines: list[str]) -> None:
    """One dropped, doubled or moved."""
    line = lines.pop(rng.randrange(len(lines)))
    for _ in range(rng.choice((0, 1, 2))):
        lines.insert(rng.randrange(len(lines) + 1), line)


def _cut(rng: Random, lines: list[str]) -> None:
    """The end is missing."""
    del lines[rng.randrange(2, len(lines)) :]


def _merged(rng: Random, lines: list[str]) -> None:
    """The bodies share a node, or a node is another one everywhere."""
    rows = _rows(lines, "NODE")
    if len(rows) < 2:
        return
    kept, gone = (lines[k].split(",")[0].strip() for k in rng.sample(rows, 2))
    for k in _rows(lines, "ELEMENT"):
        number, *nodes = (entry.strip() for entry in lines[k].split(","))
        lines[k] = ", ".join([number, *(kept if node == gone else node for node in nodes)])


_KINDS = {
    "node moved": _node_moved,
    "value": _value,
    "nodes swapped": _nodes_swapped,
    "element reversed": _reversed,
    "element collapsed": _collapsed,
    "scaled": _scaled,
    "line": _line,
    "cut": _cut,
    "nodes merged": _merged,
}

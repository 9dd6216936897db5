"""Scene files gone wrong, reproducibly: bytes, tokens, structure and values of a good scene,
changed at random.

A mutation takes a random generator and the text of a scene and returns the bytes of another;
nothing is promised about those, and most are still TOML.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, get_args

import tomli_w
from pydantic import BaseModel

from archord.scene.file import parse_any, resolved
from archord.scene.presets.joint import Scene
from archord.scene.presets.known import PRESETS
from archord.scene.problem import ProblemScene
from archord.scene.reference import example

SCENES = Path(__file__).resolve().parents[2] / "scenes"
GENERAL = Path(__file__).with_name(
    "scenes"
)  # general ones and presets, of few elements in two steps

_TOKENS = (
    *(
        "0",
        "-0.0",
        "-1",
        "1",
        "1e308",
        "-1e308",
        "1e-308",
        "5e-324",
        "1e400",
        "nan",
        "-nan",
        "inf",
        "-inf",
        "1e16",
    ),
    *(
        "9223372036854775807",
        "-9223372036854775808",
        "1" + "0" * 40,
        "9" * 5000,
        "0x7fffffff",
        "0b1",
        "0o7",
        "1_000",
    ),
    *(
        "true",
        "false",
        '""',
        '"10"',
        '"ten"',
        "'\\'",
        '"\\u0000"',
        '"\\n"',
        '"😀"',
        '"' + "x" * 5000 + '"',
        "0.1.2",
    ),
    *(
        "[]",
        "[1.0]",
        "[[1], [2]]",
        "{}",
        "{ a = 1 }",
        "{ value = 1.0, unit = 'mm' }",
        "[" * 50 + "]" * 50,
        "-",
        "+1",
    ),
    *(
        "1979-05-27",
        "07:32:00",
        "1979-05-27T07:32:00Z",
        "null",
        "None",
        "1,5",
        "10 mm",
        "''''''",
        '"""a\nb"""',
        "",
    ),
)
_NAMES = (
    "",
    " ",
    "ключ",
    "a.b",
    "__class__",
    "model_config",
    "\u202e",
    "x" * 3000,
    "mesh",
    "radius",
    "E",
    "force",
)
_WORDS = (
    *("block", "ring", "strain", "stress", "current", "reference", "both", "pin", "Block", ""),
    *(
        "hole",
        "flat",
        "clamp",
        "axis",
        "centre",
        "sleeve 1 inside",
        "bore",
        "lug",
        "tied",
        "rigid",
        "distributing",
    ),
    *(
        "x",
        "y",
        "rotation",
        "half",
        "whole",
        "none",
        "round",
        "square",
        "S355",
        ["x", "rotation"],
        ["pin", "hole"],
    ),
    *(
        [0.1, -0.1],
        [0.1, 0.2, 0.0],
        [1, 2],
        [[0.0, 300.0], [0.1, 400.0]],
        [[1e4, 100.0]],
        [],
        {},
        [{}],
        [[]],
    ),
    *(
        {"centre": [0.0, 0.0], "radius": 9.0},
        {"saturation": 500.0, "rate": 20.0},
        {"engineering": [[0.0, 1.0]]},
    ),
)
_EXTREMES = (
    0.0,
    1.0,
    -1.0,
    0.5,
    0.499999,
    0.5 - 1e-12,
    1 - 1e-12,
    0,
    1,
    3,
    50,
    -5,
    10**12,
    True,
    False,
)
_UNITS = (  # keys of one unit
    (
        "radius",
        "clearance",
        "block_size",
        "element_size",
        "displacement_absolute",
        "width",
        "outer",
        "displacement",
    ),
    ("E", "yield_stress", "hardening", "force", "pressure"),
)
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")
_VALUE = re.compile(r"(?<= = )[^#\n]+")


@cache
def base_scenes() -> dict[str, str]:
    """The repository's scenes, the printed examples, and the scenes of `GENERAL` with what presets
    stand for, by name, on coarse meshes and in two steps."""
    files = [path for path in sorted(SCENES.glob("*.toml")) if not path.stem.endswith(".sweep")]
    texts = {path.stem: path.read_text(encoding="utf-8") for path in files} | {"example": example()}
    found = {name: _coarse(text) for name, text in texts.items() if "[joint]" in text}
    for path in sorted(GENERAL.glob("*.toml")):
        found[path.stem] = text = path.read_text(encoding="utf-8")
        if path.stem in PRESETS:
            found[f"{path.stem} expanded"] = resolved(parse_any(tomllib.loads(text)))
    return found | {"general example": re.sub("steps = 20", "steps = 2", example(general=True))}


def _coarse(text: str) -> str:
    text = re.sub(r"^(relative_element_size|growth|steps) = .*\n", "", text, flags=re.MULTILINE)
    text = re.sub(
        r"^(\[joint\].*\n)",
        r"\1relative_element_size = 0.25\ngrowth = 1.0\n",
        text,
        flags=re.MULTILINE,
    )
    return re.sub(r"^(\[load\].*\n)", r"\1steps = 2\n", text, flags=re.MULTILINE)


def _tables(data: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """The tables in ``data`` by the name of their section or key: one by one, in lists, and in one
    another."""
    found = []
    for name, value in data.items():
        for table in value if isinstance(value, list) else [value]:
            if isinstance(table, dict):
                found += [(name, table), *_tables(table)]
    return found


def _known_keys(kind: Any, name: str = "") -> dict[str, set[str]]:
    """The keys of all sections of a model by the name of the section or key that holds it."""
    if not (isinstance(kind, type) and issubclass(kind, BaseModel)):
        found = [_known_keys(part, name) for part in get_args(kind)]
    else:
        found = [{name: set(kind.model_fields)}]
        found += [_known_keys(field.annotation, key) for key, field in kind.model_fields.items()]
    names = {name for part in found for name in part}
    return {name: set().union(*(part.get(name, ()) for part in found)) for name in names}


_KEYS = {
    name: sorted(keys)
    for name, keys in _known_keys(tuple[(Scene, ProblemScene, *PRESETS.values())]).items()  # type: ignore[misc]
}


def mutate(rng: Random, text: str) -> tuple[str, bytes]:
    """One to three mutations of one kind on the scene ``text``; the kind's name and the bytes of
    the new file."""
    kind = rng.choices(list(KINDS), weights=[2, 3, 3, 5])[0]
    new = KINDS[kind](rng, text)
    for _ in range(rng.choice((0, 0, 1, 2))):
        try:
            new = KINDS[kind](rng, new.decode("utf-8"))
        except (UnicodeDecodeError, tomllib.TOMLDecodeError):
            break
    return kind, new


def _bytes(rng: Random, text: str) -> bytes:
    raw = text.encode() or b"\n"
    at = rng.randrange(len(raw))
    other = rng.randrange(len(raw))
    length = rng.choice((1, 1, 2, 5, 40))
    odd = rng.choice(
        (b"\0", b"\xff", b"\r", b"\x1b[31m", b"\t", b"\xc3\x28", b"\xe2\x80\xae", b"[", b'"')
    )
    many = "".join(f"k{i} = 1\n" for i in range(3000))
    changed = (
        *(raw[:at] + new + raw[at + length :] for new in (b"", rng.randbytes(length))),
        *(
            raw[:at] + new + raw[at:]
            for new in (odd, rng.randbytes(length), raw[other : other + 200])
        ),
        raw[:at] + bytes([raw[at] ^ 1 << rng.randrange(8)]) + raw[at + 1 :],
        raw[:at],
        f"# Größe\n{text}".encode(
            rng.choice(("utf-8-sig", "utf-16", "utf-32", "latin-1")), errors="replace"
        ),
        text.replace("\n", rng.choice(("\r\n", "\r", "\n\n", "\0\n"))).encode(),
        rng.choice(
            (b"", b"\n", rng.randbytes(2000), b"\x7fELF" + bytes(3000), b"[" * 20000, b"a." * 5000)
        ),
        raw + rng.choice(("# " + "x" * 2_000_000, "\n" * 500_000, many)).encode(),
    )
    return rng.choice(changed)


def _tokens(rng: Random, text: str) -> bytes:
    places = list((_NUMBER if rng.random() < 0.7 else _VALUE).finditer(text))
    if not places:
        return text.encode()
    place = rng.choice(places)
    appended = place[0] + rng.choice(("e5", "e-5", ".", "_", "__0", " ", "e", "x", "0"))
    new = rng.choices((rng.choice(_TOKENS), rng.choice(places)[0], appended), weights=(8, 1, 1))[0]
    return (text[: place.start()] + new + text[place.end() :]).encode("utf-8", "surrogatepass")


def _structure(rng: Random, text: str) -> bytes:
    """Keys, sections or lines that are missing, renamed, doubled, moved or of another kind."""
    if rng.random() < 0.3:
        lines = text.splitlines(keepends=True) or ["\n"]
        line = lines.pop(rng.randrange(len(lines)))
        for _ in range(rng.randrange(3)):
            lines.insert(rng.randrange(len(lines) + 1), line.lstrip(rng.choice(("", "# "))))
        return "".join(lines).encode()
    data = tomllib.loads(text)
    section, table = rng.choice(_tables(data) or [("", {})])
    key = rng.choice(list(table) or ["radius"])
    copy = dict(table)
    nested: Any = table.get(key, 1)
    for _ in range(rng.choice((1, 3, 30, 80))):
        nested = {key: nested}
    parent, name = rng.choice(((table, key), (data, section)))
    lists = [value for value in data.values() if isinstance(value, list) and value]
    change = rng.randrange(6 if lists else 5)
    if change == 0:
        parent.pop(name, None)
    elif change == 1:
        parent[rng.choice((name + "s", name.upper(), *_NAMES))] = parent.pop(name, 1)
    elif change == 2:
        parent[name] = rng.choice(([copy], [], [copy, copy], "text", 3, True, {}, nested))
    elif change == 3:
        data[rng.choice([*_KEYS])] = copy
    elif change == 4:
        data = {section: data}
    else:
        some = rng.choice(lists)
        other = rng.choice(lists)
        some.insert(0, other.pop(rng.randrange(len(other))) if rng.random() < 0.7 else other[-1])
    return tomli_w.dumps(data).encode()


def _values(rng: Random, text: str) -> bytes:
    """Some numbers of the scene times powers of ten, other values for any of its keys, or another
    unit."""
    data = tomllib.loads(text)
    tables = [(name, table) for name, table in _tables(data) if name in _KEYS]
    for _ in range(rng.choice((1, 1, 2, 3)) if tables else 0):
        (section, table) = rng.choice(tables)
        kind = rng.random()
        if kind < 0.1:
            names = rng.choice(_UNITS)
            scale = 10 ** rng.uniform(-40, 40)
            for _, other in tables:
                other.update(
                    {key: other[key] * scale for key in names if isinstance(other.get(key), float)}
                )
        elif kind < 0.6:
            key = rng.choice(
                [key for key, value in table.items() if isinstance(value, float)] or ["radius"]
            )
            far = rng.choice((1, 3, 12))
            value = table.get(key, 1.0)
            table[key] = (value if isinstance(value, float) else 1.0) * float(
                f"{10 ** rng.uniform(-far, far):.3g}"
            )
        else:
            pool = rng.choice(
                (_WORDS, _EXTREMES, [rng.choice((-1, 1)) * 10 ** rng.uniform(-12, 12)])
            )
            table[rng.choice(_KEYS[section])] = rng.choice(pool)
    return tomli_w.dumps(data).encode()


KINDS: dict[str, Callable[[Random, str], bytes]] = {
    "bytes": _bytes,
    "tokens": _tokens,
    "structure": _structure,
    "values": _values,
}

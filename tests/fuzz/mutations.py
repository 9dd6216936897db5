"""Scene files gone wrong, reproducibly: bytes, tokens, structure and values of a good scene, changed at random.

A mutation takes a random generator and the text of a scene and returns the bytes of another; nothing is promised about
those, and most are still TOML.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import tomli_w

from archord.scene.reference import example

SCENES = Path(__file__).resolve().parents[2] / "scenes"

_TOKENS = (
    *("0", "-0.0", "-1", "1", "1e308", "-1e308", "1e-308", "5e-324", "1e400", "nan", "-nan", "inf", "-inf", "1e16"),
    *("9223372036854775807", "-9223372036854775808", "1" + "0" * 40, "9" * 5000, "0x7fffffff", "0b1", "0o7", "1_000"),
    *("true", "false", '""', '"10"', '"ten"', "'\\'", '"\\u0000"', '"\\n"', '"😀"', '"' + "x" * 5000 + '"', "0.1.2"),
    *("[]", "[1.0]", "[[1], [2]]", "{}", "{ a = 1 }", "{ value = 1.0, unit = 'mm' }", "[" * 50 + "]" * 50, "-", "+1"),
    *("1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "null", "None", "1,5", "10 mm", "''''''", '"""a\nb"""', ""),
)
_NAMES = ("", " ", "ключ", "a.b", "__class__", "model_config", "\u202e", "x" * 3000, "mesh", "radius", "E", "force")
_SECTIONS = ("joint", "pin", "block", "load", "analysis")
_LENGTHS = ("radius", "clearance", "block_size", "element_size", "displacement_absolute")
_MODULI = ("E", "yield_stress", "hardening")
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")
_VALUE = re.compile(r"(?<= = )[^#\n]+")


class _Power(NamedTuple):
    """A random number between powers of ten, one in four negative if it is ``signed``."""

    low: float
    high: float
    signed: bool = False

    def draw(self, rng: Random) -> float:
        sign = -1.0 if self.signed and rng.random() < 0.25 else 1.0
        return sign * float(f"{10 ** rng.uniform(self.low, self.high):.3g}")


# Section, keys of which there may be one, and values for it: lengths are times R, moduli times the body's E.
_KEYS: tuple[tuple[str, tuple[str, ...], tuple[Any, ...]], ...] = (
    ("joint", ("element_size", "relative_element_size"), (_Power(-12, 1), _Power(-1.5, 0), _Power(-1.5, 0))),
    ("joint", ("clearance", "relative_clearance"), (_Power(-12, 0, True), _Power(-5, -0.5))),
    ("joint", ("growth",), (0.0, 0.01, 0.9, 0.999999, 1.0, 1.000001, 1.1, 2.0, _Power(-6, 6))),
    ("joint", ("block_size",), (2.0, 2.5, _Power(-2, 3, True), _Power(3, 30))),
    ("joint", ("radius",), (_Power(-40, 40, True),)),
    ("joint", ("model",), ("block", "ring", "Block", "")),
    ("load", ("displacement", "displacement_absolute", "force", "relative_force"), (_Power(-12, 3, True),)),
    ("load", ("steps",), (0, 1, 3, 7, 50, -5, 10**12, 2.0)),
    ("load", ("max_cutbacks",), (0, 1, 30, 31, -1, 10**9)),
    ("load", ("core_radius",), (0.0, 0.01, 0.5, 1.0, _Power(-12, 2))),
    ("body", ("nu",), (0.0, 0.3, -0.9, -1.0, 0.5, 0.49, 0.4999, 0.499999, 0.5 - 1e-12, -1 + 1e-12)),
    ("body", ("E",), (_Power(-12, 12),)),
    ("body", ("yield_stress",), (_Power(-4, -1), _Power(-30, 3))),
    ("body", ("hardening",), (0.0, 1.0, _Power(-3, 0), _Power(-20, 20))),
    ("pin", ("rigid",), (True,)),
    ("analysis", ("gamma_factor",), (_Power(-6, 9, True),)),
    ("analysis", ("tolerance",), (_Power(-16, 0),)),
    ("analysis", ("max_iterations",), (0, 1, 2, 3, 1000, 10**6, -1)),
    ("analysis", ("plane",), ("strain", "stress")),
    ("analysis", ("kinematics",), ("current", "reference")),
    ("analysis", ("integration",), ("both", "pin", "block")),
)


def base_scenes() -> dict[str, str]:
    """The repository's scenes and the printed example, by name, on coarse meshes and in two steps."""
    files = (path for path in sorted(SCENES.glob("*.toml")) if not path.stem.endswith(".sweep"))
    texts = {path.stem: path.read_text(encoding="utf-8") for path in files}
    return {name: _coarse(text) for name, text in (texts | {"example": example()}).items()}


def _coarse(text: str) -> str:
    text = re.sub(r"^(relative_element_size|growth|steps) = .*\n", "", text, flags=re.MULTILINE)
    text = re.sub(r"^(\[joint\].*\n)", r"\1relative_element_size = 0.25\ngrowth = 1.0\n", text, flags=re.MULTILINE)
    return re.sub(r"^(\[load\].*\n)", r"\1steps = 2\n", text, flags=re.MULTILINE)


def mutate(rng: Random, text: str) -> tuple[str, bytes]:
    """One to three mutations of one kind on the scene ``text``; the kind's name and the bytes of the new file."""
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
    at, other, length = rng.randrange(len(raw)), rng.randrange(len(raw)), rng.choice((1, 1, 2, 5, 40))
    odd = rng.choice((b"\0", b"\xff", b"\r", b"\x1b[31m", b"\t", b"\xc3\x28", b"\xe2\x80\xae", b"[", b'"'))
    newline = rng.choice(("\r\n", "\r", "\n\n", "\0\n"))
    many = "".join(f"k{i} = 1\n" for i in range(3000))
    changed = (
        *(raw[:at] + new + raw[at + length :] for new in (b"", rng.randbytes(length))),
        *(raw[:at] + new + raw[at:] for new in (odd, rng.randbytes(length), raw[other : other + 200])),
        raw[:at] + bytes([raw[at] ^ 1 << rng.randrange(8)]) + raw[at + 1 :],
        raw[:at],
        text.encode(rng.choice(("utf-8-sig", "utf-16", "utf-32", "utf-16-be"))),
        f"# Größe\n{text}".encode("latin-1", errors="replace"),
        text.replace("\n", newline).encode(),
        rng.choice((b"", b"\n", rng.randbytes(2000), b"\x7fELF" + bytes(3000), b"[" * 20000, b"a." * 5000)),
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
    section = rng.choice([name for name, value in data.items() if isinstance(value, dict)] or [""])
    table = data.get(section, {})
    key, copy = rng.choice(list(table) or ["radius"]), dict(table)
    nested: Any = table.get(key, 1)
    for _ in range(rng.choice((1, 3, 30, 80))):
        nested = {key: nested}
    parent, name = rng.choice(((table, key), (data, section)))
    change = rng.randrange(5)
    if change == 0:
        parent.pop(name, None)
    elif change == 1:
        parent[rng.choice((name + "s", name.upper(), *_NAMES))] = parent.pop(name, 1)
    elif change == 2:
        parent[name] = rng.choice(([copy], [], [copy, copy], "text", 3, True, {}, nested))
    elif change == 3:
        data[rng.choice((*_SECTIONS, "units"))] = copy
    else:
        data = {section: data}
    return tomli_w.dumps(data).encode()


def _values(rng: Random, text: str) -> bytes:
    """Values of every size for the keys of the scene, or all of its lengths or moduli in another unit."""
    data = tomllib.loads(text)
    data |= {name: {} for name in _SECTIONS if not isinstance(data.get(name), dict)}
    for _ in range(rng.choice((1, 1, 2, 3))):
        if rng.random() < 0.1:
            names, scale = rng.choice((_LENGTHS, _MODULI)), _Power(-40, 40).draw(rng)
            for table in (data[name] for name in _SECTIONS):
                table.update({key: table[key] * scale for key in names if isinstance(table.get(key), float)})
            continue
        section, keys, values = rng.choice(_KEYS)
        section = rng.choice(("pin", "block")) if section == "body" else section
        table = data[section]
        value, key = rng.choice(values), rng.choice(keys)
        unit = table.get("E") if key in _MODULI else data["joint"].get("radius") if key in _LENGTHS else None
        if isinstance(value, _Power):
            value = value.draw(rng)
        for other in table if key == "rigid" else keys:
            table = {name: kept for name, kept in table.items() if name != other}
        data[section] = table | {key: value * unit if isinstance(unit, float) and unit else value}
    return tomli_w.dumps(data).encode()


KINDS: dict[str, Callable[[Random, str], bytes]] = {
    "bytes": _bytes,
    "tokens": _tokens,
    "structure": _structure,
    "values": _values,
}

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
from typing import Any

import tomli_w

from archord.scene.reference import example

SCENES = Path(__file__).resolve().parents[2] / "scenes"
Mutation = Callable[[Random, str], bytes]
Data = dict[str, Any]

_TOKENS = (
    *("0", "-0.0", "-1", "1", "1e308", "-1e308", "1e-308", "5e-324", "1e400", "nan", "-nan", "inf", "-inf", "1e16"),
    *("9223372036854775807", "-9223372036854775808", "1" + "0" * 40, "9" * 5000, "0x7fffffff", "0b1", "0o7", "1_000"),
    *("true", "false", '""', '"10"', '"ten"', "'\\'", '"\\u0000"', '"\\n"', '"😀"', '"' + "x" * 5000 + '"', "0.1.2"),
    *("[]", "[1.0]", "[[1], [2]]", "{}", "{ a = 1 }", "{ value = 1.0, unit = 'mm' }", "[" * 50 + "]" * 50, "-", "+1"),
    *("1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "null", "None", "1,5", "10 mm", "''''''", '"""a\nb"""', ""),
)
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")
_VALUE = re.compile(r"(?<= = )[^#\n]+")


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
    raw = bytearray(text.encode() or b"\n")
    at, length = rng.randrange(len(raw) + 1), rng.choice((1, 1, 2, 5, 40))
    change = rng.randrange(12)
    if change == 0:
        for _ in range(length):
            raw[rng.randrange(len(raw))] = rng.randrange(256)
    elif change == 1:
        at = rng.randrange(len(raw))
        raw[at] ^= 1 << rng.randrange(8)
    elif change == 2:
        del raw[at : at + length]
    elif change == 3:
        raw[at:at] = rng.randbytes(length)
    elif change == 4:
        del raw[at:]
    elif change == 5:
        raw[at:at] = rng.choice((b"\0", b"\xff", b"\r", b"\x1b[31m", b"\t", b"\xc3\x28", b"\xe2\x80\xae", b"[", b'"'))
    elif change == 6:
        return text.encode(rng.choice(("utf-8-sig", "utf-16", "utf-32", "utf-16-be")))
    elif change == 7:
        return f"# Größe\n{text}".encode("latin-1", errors="replace")
    elif change == 8:
        return text.replace("\n", rng.choice(("\r\n", "\r", "\n\n", "\0\n"))).encode()
    elif change == 9:
        return rng.choice((b"", b"\n", rng.randbytes(2000), b"\x7fELF" + bytes(3000), b"[" * 20000, b"a." * 5000))
    elif change == 10:
        many = "".join(f"k{i} = 1\n" for i in range(3000))
        return (text + rng.choice(("# " + "x" * 2_000_000, "\n" * 500_000, many))).encode()
    else:
        start = rng.randrange(len(raw) + 1)
        raw[at:at] = raw[start : start + 200]
    return bytes(raw)


def _tokens(rng: Random, text: str) -> bytes:
    places = list((_NUMBER if rng.random() < 0.7 else _VALUE).finditer(text))
    if not places:
        return text.encode()
    place = rng.choice(places)
    new = rng.choice(_TOKENS)
    if rng.random() < 0.15:
        new = rng.choice(places)[0]
    elif rng.random() < 0.1:
        new = place[0] + rng.choice(("e5", "e-5", ".", "_", "__0", " ", "e", "x", "0"))
    return (text[: place.start()] + new + text[place.end() :]).encode("utf-8", "surrogatepass")


def _structure(rng: Random, text: str) -> bytes:
    if rng.random() < 0.3:
        return _lines(rng, text)
    data = tomllib.loads(text)
    tables = [name for name, value in data.items() if isinstance(value, dict)] or [""]
    section = rng.choice(tables)
    table = data.get(section, data)
    key = rng.choice(list(table)) if table else "radius"
    change = rng.randrange(10)
    if change == 0:
        table.pop(key, None)
    elif change == 1:
        data.pop(section, None)
    elif change == 2:
        table[rng.choice((key + "s", key.upper(), "", " ", "ключ", "a.b", "__class__", "model_config", "x" * 3000))] = (
            1.0
        )
    elif change == 3:
        data[rng.choice((section + "s", section.upper(), "", "mesh", "\u202e", "__init__"))] = data.pop(section, 1)
    elif change == 4:
        table[key] = {key: table.get(key, 1)}
    elif change == 5:
        data[section] = rng.choice(([table], [], [table, table], "text", 3, True, {}))
    elif change == 6:
        data[rng.choice(("joint", "pin", "block", "load", "analysis", "units"))] = table
    elif change == 7:
        table[rng.choice(("clearance", "relative_clearance", "element_size", "displacement", "force", "E"))] = 0.01
    elif change == 8:
        nested: Any = 1
        for _ in range(rng.choice((3, 30, 80))):
            nested = {"a": nested}
        table[key] = nested
    else:
        data = {section: data}
    return tomli_w.dumps(data).encode()


def _lines(rng: Random, text: str) -> bytes:
    lines = text.splitlines(keepends=True) or ["\n"]
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    change = rng.randrange(4)
    if change == 0:
        lines.insert(b, lines[a])
    elif change == 1:
        lines[a], lines[b] = lines[b], lines[a]
    elif change == 2:
        del lines[a]
    else:
        lines[a] = lines[a].lstrip("# ")
    return "".join(lines).encode()


def _values(rng: Random, text: str) -> bytes:
    data = tomllib.loads(text)
    sections = [data.get(name) for name in ("joint", "pin", "block", "analysis", "load")]
    joint, pin, block, analysis, load = (table if isinstance(table, dict) else {} for table in sections)
    data |= {"joint": joint, "pin": pin, "block": block, "analysis": analysis, "load": load}
    R = joint.get("radius", 1.0)
    R = R if isinstance(R, float) else 1.0

    def power(low: float, high: float) -> float:
        return float(f"{10 ** rng.uniform(low, high):.3g}")

    def sign() -> float:
        return rng.choice((1.0, 1.0, 1.0, -1.0))

    def one_of(table: Data, names: tuple[str, ...], name: str, value: Any) -> None:
        for other in names:
            table.pop(other, None)
        table[name] = value

    def size() -> None:
        value = power(-12, 1) if rng.random() < 0.3 else power(-1.5, 0)
        absolute = rng.random() < 0.5
        name = "element_size" if absolute else "relative_element_size"
        one_of(joint, ("element_size", "relative_element_size"), name, value * R if absolute else value)

    def clearance() -> None:
        value, absolute = sign() * power(-12, 0), rng.random() < 0.5
        name = "clearance" if absolute else "relative_clearance"
        one_of(joint, ("clearance", "relative_clearance"), name, value * R if absolute else value)

    def loading() -> None:
        names = ("displacement", "displacement_absolute", "force", "relative_force")
        ring = joint.get("model") == "ring"
        name = rng.choice(names if rng.random() < 0.2 else names[2:] if ring else names[:2])
        scale = {"displacement": 1.0, "displacement_absolute": 0.01 * R, "force": R, "relative_force": 1.0}[name]
        one_of(load, names, name, sign() * scale * power(-12, 3))

    def poisson() -> None:
        near = rng.choice((0.0, 0.3, -0.9, -1.0, 0.5, 0.49, 0.4999, 0.499999, 0.5 - 1e-12, -1 + 1e-12))
        rng.choice((pin, block))["nu"] = near

    def stiffness() -> None:
        body = rng.choice((pin, block))
        body["E"] = float(body["E"] if isinstance(body.get("E"), float) else 1.0) * power(-12, 12)

    def strength() -> None:
        body = rng.choice((pin, block))
        E = body["E"] if isinstance(body.get("E"), float) else 1.0
        body["yield_stress"] = E * power(*rng.choice(((-4, -1), (-30, 3))))
        if rng.random() < 0.6:
            body["hardening"] = E * rng.choice((0.0, 1.0, power(-3, 0), power(-20, 20)))

    def units() -> None:
        scale = power(-40, 40) if rng.random() < 0.5 else rng.choice((1e-9, 1e9))
        for table in (joint, load):
            for name in ("radius", "clearance", "block_size", "element_size", "displacement_absolute"):
                if isinstance(table.get(name), float):
                    table[name] *= scale

    def modulus_units() -> None:
        scale = power(-40, 40)
        for table in (pin, block):
            for name in ("E", "yield_stress", "hardening"):
                if isinstance(table.get(name), float):
                    table[name] *= scale

    def rigid() -> None:
        pin.clear()
        pin["rigid"] = True

    changes: list[Callable[[], Any]] = [
        *(size, clearance, clearance, loading, loading, poisson, stiffness, strength, strength, units, modulus_units),
        lambda: joint.update(growth=rng.choice((0.0, 0.01, 0.9, 0.999999, 1.0, 1.000001, 1.1, 2.0, power(-6, 6)))),
        lambda: joint.update(block_size=sign() * R * rng.choice((2.0, 2.5, power(-2, 3), power(3, 30)))),
        lambda: joint.update(radius=sign() * power(-40, 40)),
        lambda: joint.update(model=rng.choice(("block", "ring", "Block", ""))),
        lambda: load.update(steps=rng.choice((0, 1, 3, 7, 50, int(power(0, 9)), -5, 10**12, 2.0))),
        lambda: load.update(max_cutbacks=rng.choice((0, 1, 30, 31, -1, 10**9))),
        lambda: load.update(core_radius=rng.choice((0.0, 0.01, 0.5, 1.0, power(-12, 2)))),
        lambda: analysis.update(gamma_factor=sign() * power(-6, 9)),
        lambda: analysis.update(tolerance=power(-16, 0)),
        lambda: analysis.update(max_iterations=rng.choice((0, 1, 2, 3, 1000, int(power(0, 6)), -1))),
        lambda: analysis.update(plane=rng.choice(("strain", "stress"))),
        lambda: analysis.update(kinematics=rng.choice(("current", "reference"))),
        lambda: analysis.update(integration=rng.choice(("both", "pin", "block"))),
        rigid,
    ]
    for _ in range(rng.choice((1, 2, 3))):
        rng.choice(changes)()
    return tomli_w.dumps(data).encode()


KINDS: dict[str, Mutation] = {"bytes": _bytes, "tokens": _tokens, "structure": _structure, "values": _values}

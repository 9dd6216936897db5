"""Scene files: TOML to a checked scene and back."""

from __future__ import annotations

import difflib
import json
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from archord.report.by_name import ByName, Names
from archord.report.errors import InputError
from archord.report.readable import require_file
from archord.scene.presets.joint import CHOSEN, Scene
from archord.scene.presets.known import PRESETS
from archord.scene.problem import ProblemScene
from archord.scene.sections.faults import keys_of, shortened
from archord.scene.sections.loading import LOADS

ALTERNATIVES: dict[str, list[Names]] = {
    "joint": [("clearance", "relative_clearance"), ("element_size", "relative_element_size")],
    "load": [(*LOADS, "pressure", "path")],
}
ABSENT = "none"  # the value that drops a key, so that its default holds
_BROUGHT = {"material": ("E", "nu", "yield_stress", "hardening")}
_LARGEST_FILE = 2 * 10**6  # bytes
_DEEPEST = 20  # dotted parts of a key: tomllib's time grows with their square and more
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?")
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{_DEEPEST}}}")

AnyScene = Scene | ProblemScene


def parse_scene(data: ByName) -> Scene:
    """The joint of ``data``. Raises `InputError`."""
    return Scene(**data)


def parse_any(
    data: ByName, source: str = "scene", origin: Mapping[str, str] | None = None
) -> AnyScene:
    """The scene of ``data`` read from ``source``, or as ``origin`` says of its keys, elsewhere: a
    joint, a general scene or a preset that stands for one. Raises `InputError`."""
    preset: Any = next((scene for name, scene in PRESETS.items() if name in data), None)
    if preset is None and {"joint", "space"} <= data.keys():
        preset = Scene
    if preset is not None:
        data = preset(source, origin, **data).general()
        origin = None
    general = "joint" not in data and not {"mesh", "body", "interaction"}.isdisjoint(data)
    scene: Any = ProblemScene if general else Scene
    return scene(source, origin, **data)


def load_scene(path: str | Path, overrides: Sequence[str] = ()) -> AnyScene:
    """Read and check the scene file ``path``, with ``overrides`` like ``"joint.clearance=0.01"`` on
    top.

    A mesh file is looked for beside it. Raises `InputError` with one sentence per fault: file, key,
    value, what may be.
    """
    file = Path(path)
    if file.is_dir():
        raise InputError(
            path, f"is a folder, not a scene; the scene of a run is {file / 'scene.toml'}."
        )
    data = read_toml(path)
    if "base" in data and "joint" not in data:
        raise InputError(path, "is a sweep, not a scene; archord sweep solves it.")
    _give_way(data, overrides)
    origin = {override_key(data, o): f"--set {o}" for o in in_order(overrides, "--set ")}
    read_targets(data, file)
    find_mesh(data.get("mesh"), file.parent)
    return parse_any(data, str(path), origin)


def find_mesh(mesh: Any, folder: Path) -> None:
    """Let the file of the section ``mesh`` count from ``folder``, and the scene be read from
    anywhere."""
    if isinstance(mesh, dict) and isinstance(mesh.get("file"), str):
        file = folder / mesh["file"]
        mesh["file"] = str(file.absolute())


def in_order(overrides: Iterable[str], by: str = "") -> list[str]:
    """The last of ``overrides`` of each key: those that drop it come first, then a rigid pin and
    materials, so that what they drop is what the file says, not another override. Raises
    `InputError`, which begins with ``by``, for two keys that are alternatives, as two loads are."""
    last = {override.partition("=")[0].strip(): override for override in overrides}
    given: dict[Names, str] = {}
    for key, override in last.items():
        part, _, name = key.rpartition(".")
        section, *_ = part.split(".")
        for names in ALTERNATIVES.get(section, []):
            if name not in names or _drops(override):
                continue
            other = given.setdefault((part, *names), override)
            if other != override:
                said = f"does not go with {other}; give one of them"
                raise InputError(f"{by}{override}: {said}.")
    brought = sorted(last, key=lambda key: not key.endswith((".rigid", ".material")))
    return sorted((last[key] for key in brought), key=lambda override: not _drops(override))


def _drops(override: str) -> bool:
    """Whether a ``key=value`` drops its key."""
    _, _, value = override.partition("=")
    return value.strip().strip("\"'") == ABSENT


def files_read(path: Path, overrides: Sequence[str] = ()) -> list[Path]:
    """The files that `load_scene` and a solve read: the scene, the file of its load.path, its
    mesh.
    Raises `InputError`."""
    data = read_toml(path)
    for override in overrides:
        override_key(data, override)
    tables = (data.get("load"), "path"), (data.get("mesh"), "file")
    named = [table.get(key) for table, key in tables if isinstance(table, dict)]
    return [path, *(path.parent / name for name in named if isinstance(name, str))]


def _give_way(data: ByName, overrides: Sequence[str]) -> None:
    """Drop from the file's ``data`` a mesh and steps if an accuracy is given instead, and the other
    way round."""
    given = {override.partition("=")[0].strip() for override in overrides if not _drops(override)}
    dropped: Sequence[str] = ()
    if "analysis.accuracy" in given:
        dropped = CHOSEN
    elif given & {*CHOSEN}:
        dropped = ("analysis.accuracy",)
    for section, name in (key.split(".") for key in dropped):
        if isinstance(data.get(section), dict):
            data[section].pop(name, None)


def read_targets(data: ByName, scene: Path) -> None:
    """Put the targets of the file ``load.path``, beside the file ``scene``, into ``data``; each is
    one step by default.

    Raises `InputError`.
    """
    load = data.get("load")
    if not isinstance(load, dict):
        return
    has_path = isinstance(load.get("path"), str)
    if not has_path or not load.keys().isdisjoint(LOADS):
        return
    file = scene.parent / load.pop("path")
    lines = read_text(file).rstrip().splitlines() or [""]
    name, *values = [line.strip().strip('"') for line in lines]
    if name not in LOADS:
        known = f"{', '.join(LOADS[:-1])} or {LOADS[-1]}"
        raise InputError(file, f"must have one column, headed by {known}, not {shortened(name)!r}.")
    if not values:
        raise InputError(file, f"must have a number below the heading {name}.")
    for row, value in enumerate(values, 2):
        if not _NUMBER.fullmatch(value):
            said = "a decimal number like 0.5 and nothing else in every row"
            raise InputError(file, f"must have {said}; row {row} has {shortened(value)!r}.")
    load[name] = [float(value) for value in values]
    load.setdefault("steps", 1)


def read_text(path: str | Path) -> str:
    """The text of the file ``path``. Raises `InputError`."""
    try:
        with require_file(path).open("rb") as file:
            raw = file.read(_LARGEST_FILE + 1)
        if len(raw) > _LARGEST_FILE:
            raise OSError(None, f"it is larger than {_LARGEST_FILE // 10**6} MB")
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(path, "cannot be read: it is not UTF-8 text.") from None
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or error
        raise InputError(path, f"cannot be read: {said}.") from None


def read_toml(path: str | Path) -> ByName:
    """What the TOML file ``path`` holds. Raises `InputError`."""
    text = read_text(path)
    try:
        return _parsed(text)
    except (
        ValueError,
        RecursionError,
    ) as error:  # also whole numbers of thousands of digits, dates like 0000-00-00
        raise InputError(path, f"is not valid TOML: {shortened(str(error))}.") from None


def _parsed(text: str) -> ByName:
    """What the TOML ``text`` says. Raises ValueError, RecursionError."""
    if _LONG_KEY.search(text):
        raise ValueError(f"a key has more than {_DEEPEST} dotted parts")
    return tomllib.loads(text)


def override_key(data: ByName, override: str) -> str:
    """Set one ``a.b=value`` in ``data``, or ``a.NAME.b=value`` in a table by its name, or number
    from 1 (value: TOML, a number, else text; none: drop it); returns the key as faults name it.
    Raises `InputError`."""
    key, sign, text = override.partition("=")
    section, dot, name = key.strip().partition(".")
    if sign and not text.strip():
        raise InputError(f"--set {override!r}: must have a value; {ABSENT} drops the key.")
    value = _value(text.strip())
    tables = data.get(section)
    if not isinstance(tables, list):
        inner = None
        if isinstance(tables, dict) and name.startswith("shape."):
            inner = tables.get("shape")
        if isinstance(inner, dict):
            name = name.removeprefix("shape.")
        is_key = sign and dot and section and name and "." not in name
        if "\n" in override or not is_key:
            raise InputError(
                f"--set {override!r}: must read section.key=value, like joint.clearance=0.01."
            )
        if isinstance(inner, dict):
            kind = str(inner.get("kind"))
            put({kind: inner}, kind, name, value, f"--set {override}")
            return f"{section}.shape.{name}"
        put(data, section, name, value, f"--set {override}")
        return f"{section}.{name}"
    numbered = [(k, table) for k, table in enumerate(tables, 1) if isinstance(table, dict)]
    known = {str(table.get("name", k)): table for k, table in reversed(numbered)}
    part, _, name = name.rpartition(".")
    if not (sign and name and part in known):
        example = f"{section}.{['1', *known][-1]}.{name}={text}"
        said = f"must read {section}.NAME.key=value, like {example!r}, with a name among"
        raise InputError(f"--set {override!r}: {said} {', '.join(reversed(known))}.")
    put({section: known[part]}, section, name, value, override)
    return f"{section} {json.dumps(part) if 'name' in known[part] else part}.{name}"


def put(data: ByName, section: str, name: str, value: Any, said: str) -> None:
    """Set a key of scene ``data``, or drop it if ``value`` is `ABSENT`; what it is an alternative
    to goes, too.

    Raises `InputError`, beginning with ``said``, if there can be no such section, or no such key
    where one is dropped.
    """
    table = data.setdefault(section, {})
    if not isinstance(table, dict):
        raise InputError(said, f"{section} is not a section of the scene.")
    instead = next((names for names in ALTERNATIVES.get(section, []) if name in names), (name,))
    there = name in table
    for other in (*instead, *_BROUGHT.get(name, ())):
        table.pop(other, None)
    if value == ABSENT and not there:
        require_key(section, name, said)
    if (section, name, value) == ("pin", "rigid", True):
        table.clear()
    if value != ABSENT:
        table[name] = value


def require_key(section: str, name: str, said: str) -> None:
    """Raise `InputError`, beginning with ``said``, unless a kind of scene has the key ``name`` in
    this ``section``."""
    kinds = [Scene, ProblemScene, *PRESETS.values()]
    known = keys_of(kinds, section)
    if name in known:
        return
    near = difflib.get_close_matches(name, known, 1)
    meant = "".join(f"; did you mean {section}.{found}?" for found in near) or "."
    raise InputError(said, f"there is no key {section}.{name}{meant}")


def _value(text: str) -> Any:
    """A value of TOML, a number, else text."""
    for read in (lambda text: _parsed(f"value = {text}")["value"], float):
        with suppress(ValueError, RecursionError):
            return read(text)
    return text


def resolved(scene: AnyScene, beside: Path | None = None) -> str:
    """The scene as TOML, with every default filled in but for what an accuracy chooses; it loads as
    the same scene.

    The mesh file ``beside`` the scene's file, if there is one, is named without its folder, which
    may move then."""
    import tomli_w

    data = scene.resolved_data()
    if beside is not None and "file" in data.get("mesh", {}):
        mesh = Path(data["mesh"]["file"])
        if mesh.resolve() == beside.resolve():
            data["mesh"]["file"] = mesh.name
    return tomli_w.dumps(data)


def scene_keys(scene: AnyScene) -> ByName:
    """Every key of the resolved scene by its dotted name."""
    found: ByName = {}
    for section, keys in tomllib.loads(resolved(scene)).items():
        found |= (
            {f"{section}.{k}": v for k, v in keys.items()}
            if isinstance(keys, dict)
            else {section: keys}
        )
    return found

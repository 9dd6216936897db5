"""Scene files: TOML to a checked scene and back."""

from __future__ import annotations

import csv
import json
import re
import tomllib
from pathlib import Path
from typing import Any

from archord.scene.errors import InputError
from archord.scene.faults import shortened
from archord.scene.scene import CHOSEN, Scene, parse_scene
from archord.scene.sections import LOADS

ALTERNATIVES: dict[str, list[tuple[str, ...]]] = {
    "joint": [("clearance", "relative_clearance"), ("element_size", "relative_element_size")],
    "load": [(*LOADS, "path")],
}
_LARGEST_FILE = 10**6  # bytes
_DEEPEST = 20  # dotted parts of a key: tomllib's time grows with their square and more
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_CHAIN = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{_DEEPEST}}}")


def load_scene(path: str | Path, overrides: list[str] | tuple[str, ...] = ()) -> Scene:
    """Read and check the scene file ``path``, with ``overrides`` like ``"joint.clearance=0.01"`` on top.

    Raises `InputError` with one sentence per fault: file, key, value, and what is allowed.
    """
    data = read_toml(path)
    if "base" in data and "joint" not in data:
        raise InputError(f"{path}: is a sweep, not a scene; archord sweep solves it.")
    origin = {}
    _give_way(data, overrides)
    for override in overrides:
        origin[override_key(data, override)] = f"--set {override}"
    read_targets(data, Path(path))
    return parse_scene(data, str(path), origin)


def files_read(path: Path, overrides: list[str] | tuple[str, ...] = ()) -> list[Path]:
    """The files that `load_scene` reads: the scene and, if it has one, that of its load.path. Raises `InputError`."""
    data = read_toml(path)
    for override in overrides:
        override_key(data, override)
    load = data.get("load")
    targets = load.get("path") if isinstance(load, dict) else None
    return [path, path.parent / targets] if isinstance(targets, str) else [path]


def _give_way(data: dict[str, Any], overrides: list[str] | tuple[str, ...]) -> None:
    """Drop from the file's ``data`` a mesh and steps if an accuracy is given instead, and the other way round."""
    given = {key.strip() for key, _, value in (o.partition("=") for o in overrides) if value.strip()}
    chosen = {f"{section}.{name}" for section, name in CHOSEN}
    dropped = chosen if "analysis.accuracy" in given else {"analysis.accuracy"} if given & chosen else set()
    for section, name in (key.split(".") for key in dropped):
        if isinstance(data.get(section), dict):
            data[section].pop(name, None)


def read_targets(data: dict[str, Any], scene: Path) -> None:
    """Put the targets of the file ``load.path``, beside the file ``scene``, into ``data``; each is one step by default.

    Raises `InputError`.
    """
    load = data.get("load")
    if not isinstance(load, dict) or not isinstance(load.get("path"), str):
        return
    both = next((name for name in LOADS if name in load), None)
    if both:
        raise InputError(f"{scene}: load.path must not be given together with {both}.")
    file = scene.parent / load.pop("path")
    try:
        reader = csv.reader(file.open(newline="", encoding="utf-8-sig"))
        (_, heading), *rows = [(reader.line_num, row) for row in reader if row] or [(0, [])]
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror or error}.") from None
    except (UnicodeDecodeError, csv.Error):
        raise InputError(f"{file}: is not a CSV file of text in UTF-8.") from None
    name = heading[0].strip() if len(heading) == 1 else None
    if name not in LOADS:
        raise InputError(f"{file}: must have one column, headed by {', '.join(LOADS[:-1])} or {LOADS[-1]}.")
    load[name] = [_target(file, line, row) for line, row in rows]
    load.setdefault("steps", 1)


def _target(file: Path, line: int, row: list[str]) -> float:
    """The number in ``row`` of the ``file`` of targets. Raises `InputError`."""
    try:
        (value,) = row  # 0,5 with a decimal comma would be two
        return float(value)
    except ValueError:
        given = shortened(json.dumps(",".join(row), ensure_ascii=False))
        raise InputError(
            f"{file}: line {line}: {given} must be one number, as every row below the heading (0.5, not 0,5)."
        ) from None


def read_toml(path: str | Path) -> dict[str, Any]:
    """What the TOML file ``path`` holds. Raises `InputError`."""
    try:
        with Path(path).open("rb") as file:
            raw = file.read(_LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}.") from None
    if len(raw) > _LARGEST_FILE:
        raise InputError(f"{path}: cannot be read: it is larger than {_LARGEST_FILE // 10**6} MB.")
    try:
        text = raw.decode("utf-8-sig").replace("\r\n", "\n")
        if _LONG_CHAIN.search(text):
            raise InputError(f"{path}: is not a scene: it has a key of more than {_DEEPEST} dotted parts.")
        return tomllib.loads(text)
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read: it is not UTF-8 text.") from None
    except RecursionError:
        raise InputError(f"{path}: is not a scene: its arrays or tables are nested too deeply.") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {shortened(str(error))}.") from None
    except InputError:
        raise
    except ValueError as error:  # whole numbers of thousands of digits, dates like 0000-00-00
        raise InputError(f"{path}: is not valid TOML: {shortened(str(error))}.") from None


def override_key(data: dict[str, Any], override: str) -> str:
    """Set one ``a.b=value`` in ``data`` (value: TOML, a number, else text; nothing: drop it); returns the dotted
    key."""
    key, sign, text = override.partition("=")
    if "\n" in text or "\n" in key:
        raise InputError(f"--set {override!r}: must be one line.")
    key = key.strip()
    section, dot, name = key.partition(".")
    if not (sign and dot and section and name and "." not in name):
        raise InputError(f"--set {override}: must read section.key=value, like joint.clearance=0.01.")
    put(data, section, name, _value(text.strip()) if text.strip() else None, f"--set {override}")
    return key


def put(data: dict[str, Any], section: str, name: str, value: Any, said: str) -> None:
    """Set a key of scene ``data``, or drop it if ``value`` is None; what it is an alternative to goes, too.

    Raises `InputError`, beginning with ``said``, if there can be no such section.
    """
    table = data.setdefault(section, {})
    if not isinstance(table, dict):
        raise InputError(f"{said}: {section} is not a section of the scene.")
    for pair in ALTERNATIVES.get(section, []):
        if name in pair:
            for other in pair:
                table.pop(other, None)
    if value is None:
        table.pop(name, None)
        return
    if (section, name, value) == ("pin", "rigid", True):
        table.clear()
    table[name] = value


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        pass
    try:
        return float(text)
    except ValueError:
        return text


def resolved(scene: Scene) -> str:
    """The scene as TOML, with every default filled in but for what an accuracy chooses; it loads as the same scene."""
    import tomli_w

    data = scene.model_dump(exclude_none=True)
    joint = data["joint"]
    joint["block_size"] = scene.joint.W
    if scene.analysis.accuracy is not None:
        for section, key in CHOSEN:
            data[section].pop(key, None)
    elif "element_size" not in joint:
        joint.setdefault("relative_element_size", 0.04)
    if scene.pin.rigid:
        data["pin"] = {"rigid": True}
    return tomli_w.dumps(data)

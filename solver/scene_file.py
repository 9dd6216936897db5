"""Scene files: TOML to a checked scene and back, and one sentence for every fault."""

from __future__ import annotations

import csv
import difflib
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from archord.solver.scene import LOADS, Scene, SceneError
from archord.solver.scene_format import key_names, limits_in_words, toml_value

ALTERNATIVES = {
    "joint": [("clearance", "relative_clearance"), ("element_size", "relative_element_size")],
    "load": [(*LOADS, "path")],
}


def load_scene(path: str | Path, overrides: list[str] | tuple[str, ...] = ()) -> Scene:
    """Read and check the scene file ``path``, with ``overrides`` like ``"joint.clearance=0.01"`` on top.

    Raises `SceneError` with one sentence per fault: file, key, value, and what is allowed.
    """
    try:
        data = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror or error}.") from None
    except UnicodeDecodeError:
        raise SceneError(f"{path}: cannot be read: it is not UTF-8 text.") from None
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{path}: is not valid TOML: {error}.") from None
    origin = {}
    for override in overrides:
        origin[_override(data, override)] = f"--set {override}"
    _read_targets(data, Path(path))
    return parse_scene(data, str(path), origin)


def _read_targets(data: dict[str, Any], scene: Path) -> None:
    """Put the targets of the file ``load.path``, beside the file ``scene``, into ``data``; each is one step by default.

    Raises `SceneError`.
    """
    load = data.get("load")
    if not isinstance(load, dict) or not isinstance(load.get("path"), str):
        return
    both = next((name for name in LOADS if name in load), None)
    if both:
        raise SceneError(f"{scene}: load.path must not be given together with {both}.")
    file = scene.parent / load.pop("path")
    try:
        heading, *rows = [row for row in csv.reader(file.open(newline="", encoding="utf-8-sig")) if row] or [[]]
    except OSError as error:
        raise SceneError(f"{file}: cannot be read: {error.strerror or error}.") from None
    except (UnicodeDecodeError, csv.Error):
        raise SceneError(f"{file}: is not a CSV file of text in UTF-8.") from None
    name = heading[0].strip() if len(heading) == 1 else None
    if name not in LOADS:
        raise SceneError(f"{file}: must have one column, headed by {', '.join(LOADS[:-1])} or {LOADS[-1]}.")
    try:
        load[name] = [float(row[0]) for row in rows]
    except ValueError as error:
        raise SceneError(f"{file}: {error}; every row below the heading must be a number.") from None
    load.setdefault("steps", 1)


def parse_scene(data: dict[str, Any], source: str = "scene", origin: dict[str, str] | None = None) -> Scene:
    """Check scene ``data`` as read from ``source``; ``origin`` names another source of some keys. Raises
    `SceneError`."""
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        sentences = [_sentence(e, data, source, origin or {}) for e in _meant(error.errors(), data)]
        raise SceneError("\n".join(sentences)) from None


def _override(data: dict[str, Any], override: str) -> str:
    """Set one ``a.b=value`` in ``data`` (value: TOML, a number, else text; nothing: drop it); returns the dotted
    key."""
    key, sign, text = override.partition("=")
    if "\n" in text:
        raise SceneError(f"--set {override!r}: must be one line.")
    key = key.strip()
    section, dot, name = key.partition(".")
    if not (sign and dot and section and name and "." not in name):
        raise SceneError(f"--set {override}: must read section.key=value, like joint.clearance=0.01.")
    table = data.setdefault(section, {})
    if not isinstance(table, dict):
        raise SceneError(f"--set {override}: {section} is not a section of the scene.")
    for pair in ALTERNATIVES.get(section, []):
        if name in pair:
            for other in pair:
                table.pop(other, None)
    if not text.strip():
        table.pop(name, None)
        return key
    value = _value(text.strip())
    if key == "pin.rigid" and value is True:
        table.clear()
    table[name] = value
    return key


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        pass
    try:
        return float(text)
    except ValueError:
        return text


def _meant(errors: list[Any], data: dict[str, Any]) -> list[Any]:
    """The errors, less those of the kind that was not given where a key may be one number or a list."""
    out: dict[tuple, Any] = {}
    for error in errors:
        section, key, *rest = [*error["loc"], None, None][: max(2, len(error["loc"]))]
        if not rest:
            out[error["loc"]] = error
            continue
        listed = isinstance(data[section][key], list)
        if str(rest[0]).startswith("list") == listed:
            error = {**error, "loc": (section, key), "entry": rest[1] if len(rest) > 1 else None}
            if error["type"] in ("float_type", "int_type") and not listed:
                error["type"] = f"{error['type']}_or_list"
            out.setdefault((section, key), error)
    return list(out.values())


def _sentence(error: Any, data: dict[str, Any], source: str, origin: dict[str, str]) -> str:
    """One sentence for one fault that pydantic found."""
    location, kind, context = [str(part) for part in error["loc"]], error["type"], error.get("ctx", {})
    said = None
    if kind == "value_error":
        name, said = str(context["error"]).split("|", 1)
        location += name.split(".")
    key = ".".join(location)
    given: Any = data
    for part in location:
        given = given.get(part) if isinstance(given, dict) else None
    where = next((said_in for name, said_in in origin.items() if name == key or name.startswith(f"{key}.")), source)
    shown = "" if given is None or isinstance(given, dict) or where != source else f" = {toml_value(given)}"
    if error.get("entry") is not None:
        shown += f": entry {error['entry'] + 1}"
    rules = {
        "float_type_or_list": "must be a number or a list of numbers",
        "int_type_or_list": "must be a whole number or a list of them",
        "too_short": "must not be empty",
        "too_long": "must not have more than {max_length} entries",
        "literal_error": "must be {expected}",
        "float_type": "must be a number",
        "int_type": "must be a whole number",
        "bool_type": "must be true or false",
        "string_type": "must be text",
        "string_too_short": "must not be empty",
        "string_pattern_mismatch": "must be one line of text",
        "finite_number": "must be a finite number",
        "missing": "is missing",
        "model_type": "must be a section, [{name}]",
    }
    if said is None and kind == "extra_forbidden":
        allowed = key_names(location[:-1])
        near = difflib.get_close_matches(location[-1], allowed, 1)
        hint = f"did you mean {near[0]}? " if near else ""
        said = f"is not a known key; {hint}{'Sections' if len(location) == 1 else 'Keys'} are {', '.join(allowed)}"
    elif said is None and kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        said = f"must be {limits_in_words(*location)}"
    elif said is None:
        said = rules.get(kind, error["msg"]).format(**{**context, "name": key})
    return f"{where}: {key}{shown} {said}."


def resolved(scene: Scene) -> str:
    """The scene as TOML, with every default filled in; it loads as the same scene."""
    import tomli_w

    data = scene.model_dump(exclude_none=True)
    joint = data["joint"]
    joint["block_size"] = scene.joint.W
    if "element_size" not in joint:
        joint.setdefault("relative_element_size", 0.04)
    if scene.pin.rigid:
        data["pin"] = {"rigid": True}
    return tomli_w.dumps(data)

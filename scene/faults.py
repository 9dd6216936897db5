"""One sentence for every fault that pydantic finds in a scene: file, key, value, and what is allowed."""

from __future__ import annotations

import difflib
import json
import re
from typing import Any, get_args

from archord.scene.keys import SEPARATOR, Section, toml_value

_MOST_SENTENCES = 20
_KINDS = ("number", "list", "law", "float", "int", "constrained-int", "lug", "bushing")  # of values that a key may have
_PHRASES = {
    "missing": "is missing",
    "extra_forbidden": "is not a known key; {hint}{kind} are {known}",
    "model_type": "must be a section, [{name}]",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "string_too_short": "must not be empty",
    "string_pattern_mismatch": "must be one line of text",
    "finite_number": "must be a finite number",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "literal_error": "must be {expected}",
    "list_type": "must be a list",
    "union_tag_invalid": "must have a kind among {expected_tags}",
    "union_tag_not_found": "must have a kind",
    "too_short": "must have {min_length} or more entries",
    "too_long": "must have at most {max_length} entries",
}


def in_sentences(
    errors: list[Any], data: dict[str, Any], model: type[Section], source: str, origin: dict[str, str]
) -> str:
    """The first ``errors`` of checking ``data`` against ``model``, a line each; ``origin`` says which keys are not from
    ``source``, and where they are from."""
    meant = [error for error in errors if _of_given_kind(error["loc"], data)]
    return "\n".join(_sentence(error, data, model, source, origin) for error in meant[:_MOST_SENTENCES])


def shortened(text: str, length: int = 80) -> str:
    """``text`` with its middle left out if it is long."""
    return text if len(text) <= length else f"{text[: length - 20]} ... {text[-15:]}"


def _of_given_kind(location: tuple, data: dict[str, Any]) -> bool:
    """Whether a fault in a key that may be one value or a list of them is of the kind that was given."""
    if len(location) < 3 or isinstance(location[2], int):
        return True
    section, key, kind = location[:3]
    return str(kind).startswith("list") == isinstance(data[section][key], list)


def _in_table(location: tuple, data: dict[str, Any]) -> tuple[tuple, dict[str, Any]]:
    """A ``location`` in ``data`` whose section is a list of tables as one whose section is that table."""
    if len(location) < 2 or not isinstance(location[1], int):
        return location, data
    table = data[location[0]][location[1]]
    named = table.get("name") if isinstance(table, dict) else None
    label = f"{location[0]} {json.dumps(named or location[1] + 1, default=str)}"
    return (label, *location[2:]), {label: table}


def _sentence(error: Any, data: dict[str, Any], model: type[Section], source: str, origin: dict[str, str]) -> str:
    location, context = error["loc"], dict(error.get("ctx", {}))
    if error["type"] == "value_error":
        name, said = str(context["error"]).split("|", 1)
        parts = name.split(SEPARATOR)
        if len(parts) > 1:  # of a table, by its name
            location = parts[0], [table["name"] for table in data[parts[0]]].index(parts[1]), *parts[2:]
        else:
            location = *location, *filter(None, name.split("."))
    location, data = _in_table(location, data)
    place, inner = list(location[:2]), location[2:]  # section and key, and where in its value
    place += [part for part in inner if isinstance(part, str) and part not in _KINDS and "[" not in part]
    if error["type"] != "value_error":
        if error["type"] == "extra_forbidden":
            context |= _known_keys(model, [part for part in error["loc"] if isinstance(part, str)])
        empty = context.get("min_length") == 1
        phrase = _PHRASES.get("string_too_short" if empty else error["type"])
        said = error["msg"] if phrase is None else phrase.format(**context, name=place[-1])
    value: Any = data
    for part in place:
        value = value.get(part) if isinstance(value, dict) else None
    key = ".".join(map(_key_shown, place[1:] if " " in place[0] else place))
    key = f"{place[0]}{'.' if key else ''}{key}" if " " in place[0] else key
    where = next((by for name, by in origin.items() if f"{name}.".startswith(f"{key}.")), source)
    shown = "" if value is None or isinstance(value, dict) or where != source else f" = {shortened(toml_value(value))}"
    entry = f": entry {inner[-1] + 1}" if inner and isinstance(inner[-1], int) else ""
    return f"{where}: {key}{shown}{entry} {said}."


def _known_keys(model: Any, place: list[str]) -> dict[str, str]:
    """What may stand in the ``place`` of an unknown key or section, and which of it may be meant."""
    of_kind: dict[str, Any] = {}
    for part in place[:-1]:
        if part in model.model_fields:
            of_kind = _sections(model.model_fields[part].annotation)
            model = next(iter(of_kind.values()), model)
        model = of_kind.get(part, model)
    known = list(model.model_fields)
    near = difflib.get_close_matches(place[-1], known, 1)
    hint = f"did you mean {near[0]}? " if near else ""
    return {"known": ", ".join(known), "kind": "Sections" if len(place) == 1 else "Keys", "hint": hint}


def _sections(kind: Any) -> dict[str, Any]:
    """The sections among the kinds of values that a key may have, by their own ``kind``."""
    if isinstance(kind, type):
        name = getattr(kind, "model_fields", {}).get("kind")
        return {str(name and name.default): kind} if issubclass(kind, Section) else {}
    return {name: found for part in get_args(kind) for name, found in _sections(part).items()}


def _key_shown(part: str) -> str:
    """One part of a key as TOML writes it, without what would break a line."""
    plain = re.fullmatch(r"[\w-]+", part) and len(part) <= 80
    return part if plain else shortened(json.dumps(part, ensure_ascii=True))

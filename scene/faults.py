"""One sentence for every fault that pydantic finds in a scene: file, key, value, and what is allowed."""

from __future__ import annotations

import difflib
import json
import re
from typing import Any

from archord.scene.keys import Section, limits, toml_value

_MOST_SENTENCES = 20
_SIGNS = {">": "greater than", "≥": "at least", "<": "less than", "≤": "at most"}
_RULES = {
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


def in_sentences(
    errors: list[Any], data: dict[str, Any], model: type[Section], source: str, origin: dict[str, str]
) -> str:
    """The ``errors`` of checking ``data`` against ``model``, a line each; ``origin`` says which keys are not from
    ``source``, and where they are from."""
    errors = _meant(errors, data)
    sentences = [_sentence(error, data, model, source, origin) for error in errors[:_MOST_SENTENCES]]
    if len(errors) > _MOST_SENTENCES:
        sentences.append(f"{source}: has {len(errors) - _MOST_SENTENCES} more faults like these.")
    return "\n".join(sentences)


def shortened(text: str, length: int = 80) -> str:
    """``text`` with its middle left out if it is long."""
    return text if len(text) <= length else f"{text[: length - 20]} ... {text[-15:]}"


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


def _sentence(error: Any, data: dict[str, Any], model: type[Section], source: str, origin: dict[str, str]) -> str:
    location, kind, context = [str(part) for part in error["loc"]], error["type"], error.get("ctx", {})
    said = None
    if kind == "value_error":
        name, said = str(context["error"]).split("|", 1)
        location += name.split(".")
    key = ".".join(map(_key_shown, location))
    value: Any = data
    for part in location:
        value = value.get(part) if isinstance(value, dict) else None
    where = next((said_in for name, said_in in origin.items() if name == key or name.startswith(f"{key}.")), source)
    shown = "" if value is None or isinstance(value, dict) or where != source else f" = {shortened(toml_value(value))}"
    if error.get("entry") is not None:
        shown += f": entry {error['entry'] + 1}"
    if said is None and kind == "extra_forbidden":
        allowed = list(_section(model, location).model_fields)
        near = difflib.get_close_matches(location[-1], allowed, 1)
        hint = f"did you mean {near[0]}? " if near else ""
        said = f"is not a known key; {hint}{'Sections' if len(location) == 1 else 'Keys'} are {', '.join(allowed)}"
    elif said is None and kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        schema = _section(model, location).model_json_schema()["properties"][location[-1]]
        said = f"must be {' and '.join(f'{_SIGNS[sign]} {value:g}' for sign, value in limits(schema))}"
    elif said is None:
        said = _RULES.get(kind, error["msg"]).format(**{**context, "name": key})
    return f"{where}: {key}{shown} {said}."


def _section(model: Any, location: list[str]) -> Any:
    """The class of the section that holds the key at ``location``."""
    for part in location[:-1]:
        model = model.model_fields[part].annotation
    return model


def _key_shown(part: str) -> str:
    """One part of a key as TOML writes it, without what would break a line."""
    plain = re.fullmatch(r"[\w-]+", part) and len(part) <= 80
    return part if plain else shortened(json.dumps(part, ensure_ascii=True))

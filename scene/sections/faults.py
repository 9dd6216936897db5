"""One sentence for every fault that pydantic finds in a scene: file, key, value, and what is
allowed."""

from __future__ import annotations

import difflib
import json
import re
from types import SimpleNamespace
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from archord.report.by_name import ByName, Words
from archord.scene.sections.errors import Fault, toml_value

_MOST_SENTENCES = 20
_LONGEST = 80  # characters of a value as it is shown
_ELSEWHERE = {
    "lug.pin": "pin.whole",
    "bushing.pin": "pin.whole",
    "bushing.rings": "[[sleeve]] and [housing]",
}
_ELSEWHERE |= {"load.steps": "path.steps", "path": "load.steps"}
# kinds of values, in pydantic's places; no key is called so
_TAGS = {"number", "list", "a law"}
PHRASES = {
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
    "list_of_tables": "must be a list of tables, [[{name}]]",
    "union_tag_invalid": "must have a kind among {expected_tags}",
    "union_tag_not_found": "must have a kind",
    "too_short": "must have {min_length} or more entries",
    "too_long": "must have at most {max_length} entries",
}


def in_sentences(
    errors: list[Any],
    data: ByName,
    model: type[BaseModel],
    source: str,
    origin: Words,
) -> str:
    """The first ``errors`` of checking ``data`` against ``model``, a line each; ``origin`` says
    which keys are not from ``source``, and where they are from. Of a misspelled key it is not said
    that it is missing, too."""
    unknown = [error["loc"] for error in errors if error["type"] == "extra_forbidden"]
    meant = {(*place[:-1], _known_keys(model, place)["near"]) for place in unknown}
    errors = [error for error in errors if error["type"] != "missing" or error["loc"] not in meant]
    return "\n".join(
        _sentence(error, data, model, source, origin) for error in errors[:_MOST_SENTENCES]
    )


def keys_of(models: list[Any], section: str) -> list[str]:
    """The keys that a ``section`` may have in scenes of any of the ``models``."""
    fields = [model.model_fields[section] for model in models if section in model.model_fields]
    kinds = [kind for field in fields for kind in _sections(field.annotation).values()]
    return sorted({key for kind in kinds for key in kind.model_fields})


def of_section(errors: list[Any], data: ByName, section: type[BaseModel]) -> str:
    """`in_sentences` of a ``section`` that was made alone, from ``data``."""
    name = section.__name__.lower()
    place: tuple[str | int, ...] = (name, 0) if "name" in data else (name,)
    shown = [data] if "name" in data else data
    whole: Any = SimpleNamespace(model_fields={name: FieldInfo(annotation=section)})
    placed = [{**error, "loc": (*place, *error["loc"])} for error in errors]
    return in_sentences(placed, {name: shown}, whole, f"archord.{section.__name__}", {})


def shortened(text: str) -> str:
    """``text`` with its middle left out if it is long."""
    if len(text) <= _LONGEST:
        return text
    return f"{text[: _LONGEST - 20]} ... {text[-15:]}"


def _sentence(error: Any, data: ByName, model: type[BaseModel], source: str, origin: Words) -> str:
    place = error["loc"]
    context = dict(error.get("ctx", {}))
    fault = context.get("error")
    if isinstance(fault, Fault):
        place += fault.place
    value = data.get(place[0])
    label = _key_shown(place[0])
    if len(place) > 1 and isinstance(value, list):  # of tables, which are known by name or number
        at = (
            place[1]
            if isinstance(place[1], int)
            else [table["name"] for table in value].index(place[1])
        )
        value = value[at]
        place = place[1:]
        named = value.get("name") if isinstance(value, dict) else None
        label += f" {json.dumps(named or at + 1, default=str)}"
    keys = list[str]()
    for part in place[1:]:
        if keys and (isinstance(part, int) or part in _TAGS or part == _kind_of(value)):
            continue
        keys.append(part)
        value = value.get(part) if isinstance(value, dict) else None
    key = ".".join((label, *map(_key_shown, keys)))
    if isinstance(fault, Fault):
        said = str(fault)
    else:
        context |= _known_keys(model, error["loc"])
        kind = "string_too_short" if context.get("min_length") == 1 else error["type"]
        if kind == "list_type" and len(place) == 1:
            kind = "list_of_tables"
        said = PHRASES.get(kind, "{msg}").format(**context, msg=error["msg"], name=key)
        said = said.replace("must be False", "must be false")
    given_by = (by for name, by in origin.items() if f"{name}.".startswith(f"{key}."))
    where = next(given_by, source)
    shown = ""
    if value is not None and not isinstance(value, dict) and where == source:
        shown = f" = {shortened(toml_value(value))}"
    entry = ""
    if len(place) > 2 and isinstance(place[-1], int):
        entry = f": entry {place[-1] + 1}"
    return f"{where}: {key}{shown}{entry} {said}."


def _kind_of(value: Any) -> Any:
    """The ``kind`` that a table tells of itself, as shapes of meshes do."""
    return value.get("kind") if isinstance(value, dict) else None


def _known_keys(model: Any, loc: tuple[str | int, ...]) -> Words:
    """What may stand in the place ``loc`` of an unknown key or section, and which of it may be
    meant."""
    of_kind = {}
    place = [part for part in loc if isinstance(part, str)]
    for part in place[:-1]:
        if part in model.model_fields:
            of_kind = _sections(model.model_fields[part].annotation)
        model = of_kind.get(part, next(iter(of_kind.values()), model))
    known = list(model.model_fields)
    near = _ELSEWHERE.get(".".join(place)) or "".join(
        difflib.get_close_matches(place[-1], known, 1)
    )
    hint = f"did you mean {near}? " if near else ""
    kind = "sections" if len(place) == 1 else "keys"
    return {
        "known": ", ".join(known),
        "kind": kind.capitalize() if near else kind,
        "hint": hint,
        "near": near,
    }


def _sections(kind: Any) -> ByName:
    """The sections among the kinds of values that a key may have, by their own ``kind``."""
    if isinstance(kind, type):
        name = getattr(kind, "model_fields", {}).get("kind")
        return {str(name and name.default): kind} if issubclass(kind, BaseModel) else {}
    return {name: found for part in get_args(kind) for name, found in _sections(part).items()}


def _key_shown(part: str) -> str:
    """One part of a key as TOML writes it, without what would break a line."""
    plain = re.fullmatch(r"[\w-]+", part) and len(part) <= 80
    return part if plain else shortened(json.dumps(part, ensure_ascii=True))

"""Sweep files: a base scene and what is varied, checked, with one sentence for every fault."""

from __future__ import annotations

import difflib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PrivateAttr, ValidationError, model_validator

from archord.scene.errors import InputError
from archord.scene.file import override_key, read_toml
from archord.scene.keys import toml_value

Overrides = dict[str, Any]  # values by dotted key, "joint.clearance"


def flattened(table: Any, prefix: str = "") -> Any:
    """``table`` by dotted keys: ``{"joint": {"radius": 1}}`` and ``{"joint.radius": 1}`` mean the same."""
    if not isinstance(table, dict):
        return table
    out: Overrides = {}
    for name, value in table.items():
        key = f"{prefix}{name}"
        if isinstance(value, dict) and not {"from", "to"} & value.keys():
            out |= flattened(value, f"{key}.")
        else:
            out[key] = value
    return out


def _pair(value: Any) -> Any:
    """A range given in the short form ``[low, high]``."""
    if isinstance(value, list) and len(value) == 2:
        return {"from": value[0], "to": value[1]}
    return value


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True, populate_by_name=True)


class Range(_Section):
    """Where the values of a key are sampled: evenly between two numbers, or between their logarithms."""

    low: float = Field(alias="from")
    high: float = Field(alias="to")
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _ordered(self) -> Range:
        if not self.low < self.high:
            raise ValueError("must have a from that is less than its to")
        if self.scale == "log" and self.low <= 0:
            raise ValueError('must have a positive from where scale = "log"')
        return self


class LatinHypercube(_Section):
    """``number`` samples of several keys at once, each key stratified (McKay, Beckman, Conover 1979)."""

    number: int = Field(ge=1, le=100_000)
    seed: int = Field(default=0, ge=0)
    ranges: Annotated[
        dict[str, Annotated[Range, BeforeValidator(_pair)]], BeforeValidator(flattened), Field(min_length=1)
    ]


_Lists = Annotated[
    dict[str, Annotated[list[Any], Field(min_length=1)]], BeforeValidator(flattened), Field(min_length=1)
]


class SweepFile(_Section):
    """A sweep: the scenes are ``base`` with the overrides of ``list``, ``zip``, ``grid`` and ``latin_hypercube``, in
    all combinations."""

    base: dict[str, Any]
    list_: list[Annotated[Overrides, BeforeValidator(flattened)]] = Field(default=[], alias="list", min_length=1)
    zip: _Lists = {}
    grid: _Lists = {}
    latin_hypercube: LatinHypercube | None = None
    _base_file: Path | None = PrivateAttr(default=None)

    @property
    def base_file(self) -> Path | None:
        """The file that ``base`` was read from; None if it is a table of the sweep file."""
        return self._base_file

    @model_validator(mode="after")
    def _equal_lengths(self) -> SweepFile:
        lengths = {key: len(values) for key, values in self.zip.items()}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{key} has {n}" for key, n in lengths.items())
            raise ValueError(f"zip|must hold lists of one length, but {told}")
        return self


def load_sweep(path: str | Path, overrides: Sequence[str] = ()) -> SweepFile:
    """Read and check the sweep file ``path``; ``base`` then is the base scene's table, its paths absolute, with
    ``overrides`` like ``"joint.radius=2"`` on top.

    The scene itself is not checked, as it may be whole only with the overrides. Raises `InputError` with one sentence
    per fault: file, key, value, and what is allowed.
    """
    path = Path(path)
    data = read_toml(path)
    if "base" not in data and "joint" in data:
        raise InputError(f"{path}: is a scene, not a sweep; solve it by archord solve, or name it as a base.")
    base, folder, base_file = data.get("base"), path.parent, None
    if isinstance(base, str):
        base_file = Path(os.path.normpath(path.parent / base))
        data["base"] = _read_base(path, base, base_file)
        folder = base_file.parent
    try:
        sweep = SweepFile.model_validate(data)
    except ValidationError as error:
        raise InputError("\n".join(dict.fromkeys(_sentence(e, data, path) for e in error.errors()))) from None
    sweep._base_file = base_file
    _anchor(sweep.base.get("load"), folder)
    for override in overrides:
        override_key(sweep.base, override)
    for entry in sweep.list_:
        _anchor(entry, path.parent, "load.path")
    for lists in (sweep.zip, sweep.grid):
        if "load.path" in lists:
            lists["load.path"][:] = [_absolute(value, path.parent) for value in lists["load.path"]]
    return sweep


def _read_base(path: Path, base: str, file: Path) -> dict[str, Any]:
    """The table of the base scene ``file``, which the sweep file ``path`` calls ``base``. Raises `InputError`."""
    fault = f"{path}: base = {toml_value(base)} must be a scene file, beside the sweep file; {file}"
    if not file.is_file():
        raise InputError(f"{fault} {'is not one' if file.exists() else 'does not exist'}.")
    data = read_toml(file)
    if "base" in data:
        raise InputError(f"{fault} is a sweep.")
    return data


def _anchor(table: Any, folder: Path, key: str = "path") -> None:
    if isinstance(table, dict) and key in table:
        table[key] = _absolute(table[key], folder)


def _absolute(value: Any, folder: Path) -> Any:
    """A path of a CSV file, which counts from ``folder``; the word for no path stays."""
    return str((folder / value).resolve()) if isinstance(value, str) and value != "none" else value


def _sentence(error: Any, data: dict[str, Any], path: Path) -> str:
    """One sentence for one fault that pydantic found."""
    where = [part for part in error["loc"] if part not in ("list_", "low", "high")]
    kind, context, said = error["type"], error.get("ctx", {}), None
    if kind == "value_error":
        name, bar, said = str(context["error"]).rpartition("|")
        where += [name] if bar else []
    given: Any = data
    key = ""
    for part in where:
        if part in ("from", "to") and isinstance(given, list):
            said = "must be two finite numbers, [low, high]"
            break
        if isinstance(given, dict):
            given = given.get(part, flattened(given).get(part))
        else:
            given = given[part] if isinstance(given, list) else None
        key += f": entry {part + 1}" if isinstance(part, int) else f".{part}" if key else str(part)
    shown = "" if given is None or isinstance(given, dict) or where[-1:] == ["base"] else f" = {toml_value(given)}"
    if kind == "extra_forbidden":
        known = [*(LatinHypercube if len(where) == 2 else SweepFile).model_fields]
        known = ["list" if name == "list_" else name for name in known]
        if len(where) > 2:
            known = ["from", "to", "scale"]
        near = difflib.get_close_matches(str(where[-1]), known, 1)
        said = f"is not a known key; {f'did you mean {near[0]}? ' if near else ''}Keys are {', '.join(known)}"
    rules = {
        "missing": 'is missing; give base = "scene.toml" or a [base] table' if key == "base" else "is missing",
        "too_short": "must not be empty",
        "list_type": "must be a list of values" + ("; write [[list]]" if key == "list" else ""),
        "dict_type": 'must be a scene file, base = "scene.toml", or a table' if key == "base" else "must be a table",
        "model_type": "must be [low, high] or {{ from = low, to = high }}" if len(where) > 2 else "must be a table",
        "float_type": "must be a number",
        "int_type": "must be a whole number",
        "finite_number": "must be a finite number",
        "literal_error": "must be {expected}",
        "greater_than_equal": "must be at least {ge}",
        "less_than_equal": "must be at most {le}",
    }
    said = said or rules.get(kind, error["msg"]).format(**context)
    return f"{path}: {key}{shown} {said}."

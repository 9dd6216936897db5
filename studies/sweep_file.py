"""Sweep files: a base scene and what is varied, checked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, ValidationError, field_validator, model_validator

from archord.scene.errors import InputError
from archord.scene.faults import shortened
from archord.scene.file import override_key, read_targets, read_toml
from archord.scene.keys import Section, toml_value

ABSENT = "none"  # the value that drops a key, so that its default holds
Overrides = dict[str, Any]  # values by dotted key, "joint.clearance"


def flattened(table: Any, prefix: str = "") -> Any:
    """``table`` by dotted keys: ``{"joint": {"radius": 1}}`` and ``{"joint.radius": 1}`` mean the same."""
    if not isinstance(table, dict):
        return table
    out: Overrides = {}
    for name, value in table.items():
        if isinstance(value, dict) and not {"from", "to"} & value.keys():
            out |= flattened(value, f"{prefix}{name}.")
        else:
            out[f"{prefix}{name}"] = value
    return out


class Range(Section):
    """Where the values of a key are sampled: evenly between two numbers, or between their logarithms."""

    model_config = ConfigDict(populate_by_name=True)
    low: float = Field(alias="from")
    high: float = Field(alias="to")
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="before")
    @classmethod
    def _pair(cls, value: Any) -> Any:
        """The short form is ``[low, high]``."""
        return dict(zip(("from", "to"), value, strict=True)) if isinstance(value, list) and len(value) == 2 else value

    @model_validator(mode="after")
    def _ordered(self) -> Range:
        if not self.low < self.high:
            raise ValueError("must have a from that is less than its to")
        if self.scale == "log" and self.low <= 0:
            raise ValueError('must have a positive from where scale = "log"')
        return self


class LatinHypercube(Section):
    """``number`` samples of several keys at once, each key stratified (McKay, Beckman, Conover 1979)."""

    number: int = Field(ge=1, le=100_000)
    seed: int = Field(default=0, ge=0)
    ranges: Annotated[dict[str, Range], BeforeValidator(flattened), Field(min_length=1)]


_Lists = Annotated[
    dict[str, Annotated[list[Any], Field(min_length=1)]], BeforeValidator(flattened), Field(min_length=1)
]


class SweepFile(Section):
    """A sweep: the scenes are ``base`` with the overrides of ``list``, ``zip``, ``grid`` and ``latin_hypercube``, in
    all combinations."""

    model_config = ConfigDict(populate_by_name=True)
    base: dict[str, Any]
    list_: list[Annotated[Overrides, BeforeValidator(flattened)]] = Field(default=[], alias="list", min_length=1)
    zip: _Lists = Field(default={})
    grid: _Lists = Field(default={})
    latin_hypercube: LatinHypercube | None = None

    @field_validator("zip")
    @classmethod
    def _equal_lengths(cls, lists: dict[str, list[Any]]) -> dict[str, list[Any]]:
        if len({len(values) for values in lists.values()}) > 1:
            told = ", ".join(f"{key} has {len(values)}" for key, values in lists.items())
            raise ValueError(f"must hold lists of one length, but {told}")
        return lists

    def resolved(self) -> str:
        """The sweep as TOML with its base scene in it; it gives the same cases."""
        import tomli_w

        return tomli_w.dumps(self.model_dump(by_alias=True, exclude_none=True, exclude_defaults=True))


def load_sweep(path: Path, overrides: Sequence[str] = ()) -> SweepFile:
    """Read and check the sweep file ``path``; ``base`` then is the base scene's table, with ``overrides`` like
    ``"joint.radius=2"`` on top and the targets of its load.path, and other paths are absolute.

    The scene itself is not checked, as it may be whole only with what is varied. Raises `InputError` with one sentence
    per fault: file, key, value, and what is allowed.
    """
    data = read_toml(path)
    if "base" not in data and "joint" in data:
        raise InputError(f"{path}: is a scene, not a sweep; solve it by archord solve, or name it as a base.")
    source = path
    if isinstance(data.get("base"), str):
        source = path.parent / data["base"]
        data["base"] = read_toml(source)
    try:
        sweep = SweepFile.model_validate(data)
    except ValidationError as error:
        raise InputError("\n".join(_sentence(fault, path) for fault in error.errors())) from None
    for override in overrides:
        override_key(sweep.base, override)
    read_targets(sweep.base, source)
    for table in (*sweep.list_, sweep.zip, sweep.grid):
        if "load.path" in table:
            table["load.path"] = _absolute(table["load.path"], path.parent)
    return sweep


def _absolute(value: Any, folder: Path) -> Any:
    """The path of a CSV file, or a list of them, which count from ``folder``; the word for no path stays."""
    if isinstance(value, list):
        return [_absolute(entry, folder) for entry in value]
    return str((folder / value).resolve()) if isinstance(value, str) and value != ABSENT else value


def _sentence(error: Any, path: Path) -> str:
    """One sentence for one fault that pydantic found."""
    key = ".".join(f"entry {part + 1}" if isinstance(part, int) else part for part in error["loc"])
    own = {"missing": "is missing", "extra_forbidden": "is not a known key"}.get(error["type"])
    said = own or str(error.get("ctx", {}).get("error", error["msg"]))
    given = "" if isinstance(error["input"], dict) else f" = {shortened(toml_value(error['input']))}"
    return f"{path}: {key}{given}: {said[0].lower()}{said[1:]}."

"""Sweep files, a base scene and what is varied, checked; and their cases: overrides, multiplied,
and for each a checked scene with a name made from its content."""

from __future__ import annotations

import copy
import hashlib
import itertools
import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from archord.report.by_name import ByName
from archord.report.errors import InputError
from archord.report.table import in_digits
from archord.scene.file import (
    ABSENT,
    ALTERNATIVES,
    PRESETS,
    AnyScene,
    find_mesh,
    in_order,
    override_key,
    parse_any,
    put,
    read_targets,
    read_toml,
    require_key,
    resolved,
)
from archord.scene.sections.errors import toml_value
from archord.scene.sections.faults import PHRASES, shortened
from archord.scene.sections.keys import Section, after

Overrides = dict[str, Any]  # values by dotted key, "joint.clearance"
MOST_CASES = 100_000
# what the base scene of a sweep holds where it says nothing: P differs by 1e-7 at most
DEFAULTS = {
    "analysis.tolerance": 1e-6,
    "output.fields": False,
    "output.contact": False,
    "output.checkpoint": False,
}
_MOST_SENTENCES = 20
_SAID = {
    "extra_forbidden": "is not a known key",
    "dict_type": "must be a table",
    "model_type": "must be a table",
}  # of faults of the sweep file, where a scene's are told otherwise
_TABLES = ("hardening", "parameters", "core")  # keys whose values are tables
_DIGITS = 9  # of samples: short numbers that do not depend on the last bit of a machine's logarithm
_SOLVED_ALIKE_SINCE = (
    "0.1.0"  # the version from which on scenes have the same solution, and sweeps go on
)
Factor = tuple[
    str, list[Overrides]
]  # of the product: its source in the sweep file, and its choices


def flattened(table: Any, prefix: str = "") -> Any:
    """``table`` by dotted keys: ``{"joint": {"radius": 1}}`` and ``{"joint.radius": 1}`` mean the
    same. A table that is the value of a key stays whole."""
    if not isinstance(table, dict):
        return table
    out: Overrides = {}
    for name, value in table.items():
        is_value = name.rpartition(".")[2] in _TABLES
        if isinstance(value, dict) and not is_value and not {"from", "to"} & value.keys():
            out |= flattened(value, f"{prefix}{name}.")
        else:
            out[f"{prefix}{name}"] = value
    return out


class Range(Section):
    """Where the values of a key are sampled: evenly between two numbers, or between their
    logarithms."""

    model_config = ConfigDict(populate_by_name=True)
    low: float = Field(alias="from")
    high: float = Field(alias="to")
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="before")
    @classmethod
    def _pair(cls, value: Any) -> Any:
        """The short form is ``[low, high]``."""
        return (
            dict(zip(("from", "to"), value, strict=True))
            if isinstance(value, list) and len(value) == 2
            else value
        )

    @after
    def _ordered(self) -> Range:
        if not self.low < self.high:
            raise ValueError("must have a from that is less than its to")
        if self.scale == "log" and self.low <= 0:
            raise ValueError('must have a positive from where scale = "log"')
        return self


class LatinHypercube(Section):
    """``number`` samples of several keys at once, each key stratified (McKay, Beckman, Conover
    1979)."""

    number: int = Field(ge=1, le=100_000)
    seed: int = Field(default=0, ge=0)
    ranges: Annotated[dict[str, Range], BeforeValidator(flattened), Field(min_length=1)]


_Lists = Annotated[
    dict[str, Annotated[list[Any], Field(min_length=1)]],
    BeforeValidator(flattened),
    Field(min_length=1),
]


class SweepFile(Section):
    """A sweep: the scenes are ``base`` with the overrides of ``list``, ``zip``, ``grid`` and
    ``latin_hypercube``, in all combinations."""

    model_config = ConfigDict(populate_by_name=True)
    base: ByName
    list_: list[Annotated[Overrides, BeforeValidator(flattened)]] = Field(
        default=[], alias="list", min_length=1
    )
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
        return tomli_w.dumps(
            self.model_dump(by_alias=True, exclude_none=True, exclude_defaults=True)
        )


def load_sweep(path: Path, overrides: Sequence[str] = ()) -> SweepFile:
    """Read and check the sweep file ``path``; ``base`` then is the base scene's table, with
    `DEFAULTS`, with ``overrides`` like ``"joint.radius=2"`` on top and the targets of its
    load.path, and other paths are absolute. It is not checked, as it may be whole only with what is
    varied. Raises `InputError` with one sentence per fault."""
    data = read_toml(path)
    if "base" not in data and not {"joint", "mesh", *PRESETS}.isdisjoint(data):
        raise InputError(
            path, "is a scene, not a sweep; solve it by archord solve, or name a scene as a base."
        )
    source = path
    if isinstance(data.get("base"), str):
        source = path.parent / data["base"]
        data["base"] = read_toml(source)
    try:
        sweep = SweepFile.model_validate(data)
    except ValidationError as error:
        raise InputError("\n".join(_sentence(fault, path) for fault in error.errors())) from None
    if not _was_solved(path):
        _add_defaults(sweep.base)
    for override in in_order(overrides, "--set "):
        override_key(sweep.base, override)
    read_targets(sweep.base, source)
    find_mesh(sweep.base.get("mesh"), source.parent)
    for table in (*sweep.list_, sweep.zip, sweep.grid):
        if "load.path" in table:
            table["load.path"] = _absolute(table["load.path"], path.parent)
    return sweep


def _was_solved(path: Path) -> bool:
    """Whether ``path`` is the file of a sweep's folder: its cases may be of a version without
    `DEFAULTS`."""
    return path.name == "sweep.toml" and (path.parent / "cases").is_dir()


def _add_defaults(base: ByName) -> None:
    """Put `DEFAULTS` into the table ``base`` of a scene, where it says nothing."""
    for key, value in DEFAULTS.items():
        section, _, name = key.partition(".")
        table = base.setdefault(section, {})
        if isinstance(table, dict):  # anything else is a fault of every case
            table.setdefault(name, value)


def _absolute(value: Any, folder: Path) -> Any:
    """The path of a CSV file, or a list of them, which count from ``folder``; the word for no path
    stays."""
    if isinstance(value, list):
        return [_absolute(entry, folder) for entry in value]
    return str((folder / value).resolve()) if isinstance(value, str) and value != ABSENT else value


def _sentence(error: Any, path: Path) -> str:
    """One sentence for one fault that pydantic found."""
    key = ".".join(f"entry {part + 1}" if isinstance(part, int) else part for part in error["loc"])
    kind = error["type"]
    context = error.get("ctx", {})
    said = str(context.get("error", "")) or _SAID.get(kind)
    if kind == "model_type" and "ranges" in error["loc"]:
        said = "must be [low, high], or a table with from and to"
    elif kind == "extra_forbidden" and len(error["loc"]) == 1:
        said = f"{said}; keys are base, list, zip, grid, latin_hypercube"
    elif said is None:
        said = PHRASES.get(kind, "{msg}").format(**context, msg=error["msg"])
    given = (
        "" if isinstance(error["input"], dict) else f" = {shortened(toml_value(error['input']))}"
    )
    return f"{path}: {key}{given}: {said[0].lower()}{said[1:]}."


@dataclass(frozen=True)
class Case:
    """Case ``number`` (from 1) of a sweep; ``run`` is the name of its run folder, the same for
    identical scenes."""

    number: int
    overrides: Overrides
    scene: AnyScene
    run: str

    def value(self, key: str) -> Any:
        """What the case's scene says for the dotted ``key``; None if nothing."""
        given = self.overrides.get(key)
        found = self.scene.value(key, None if given == ABSENT else given)
        return found.model_dump(exclude_none=True) if isinstance(found, BaseModel) else found

    def values(self, keys: Sequence[str]) -> Overrides:
        """The values of the dotted ``keys`` by their headings in this case's units."""
        return {self.scene.heading(key): self.value(key) for key in keys}


@dataclass(frozen=True)
class Sweep:
    """All cases of the sweep ``file``, read from ``path``, and the dotted keys that they vary."""

    path: Path
    file: SweepFile
    keys: list[str]
    cases: list[Case]

    @property
    def headings(self) -> list[str]:
        """What heads the columns of the keys: a force that is of a thickness in some cases and per
        unit thickness in others has two."""
        found = (case.scene.heading(key) for key in self.keys for case in self.cases)
        return list(dict.fromkeys(found))

    @property
    def distinct(self) -> list[Case]:
        """The first case of every run."""
        return list({case.run: case for case in reversed(self.cases)}.values())[::-1]


def read_sweep(path: str | Path, overrides: Sequence[str] = ()) -> Sweep:
    """Read the sweep file ``path``, with ``overrides`` of its base, and check the scene of every
    case. Raises `InputError` with one sentence per fault."""
    path = Path(path)
    file = load_sweep(path, overrides)
    varied = factors(file)
    given = {override.partition("=")[0].strip(): None for override in overrides}
    try:
        keys = _checked_keys([*varied, ("--set", [given])], "joint" in file.base)
        rows = combinations(varied)
    except InputError as error:
        raise InputError(path, error) from None
    cases = []
    faults: dict[str, list[int]] = {}
    for number, row in enumerate(rows, 1):
        try:
            scene = _scene(file.base, row, path)
        except InputError as error:
            for sentence in str(error).splitlines():
                faults.setdefault(sentence.removeprefix(f"{path}: "), []).append(number)
        else:
            cases.append(Case(number, row, scene, run_name(scene)))
    if faults:
        told = []
        for sentence, numbers in faults.items():
            more = f" and {len(numbers) - 1} more" if len(numbers) > 1 else ""
            which = "every case" if len(numbers) == len(rows) else f"case {numbers[0]}{more}"
            told.append(f"{path}: {which}: {sentence}")
        if len(told) > _MOST_SENTENCES:
            told[_MOST_SENTENCES:] = [f"{path}: has {len(told) - _MOST_SENTENCES} more faults."]
        raise InputError("\n".join(told))
    return Sweep(path, file, [key for key in keys if key not in given], cases)


def factors(sweep: SweepFile) -> list[Factor]:
    """What is multiplied, the slowest first: list, zip, each key of the grid, Latin hypercube."""
    found = [("[[list]]", sweep.list_)] if sweep.list_ else []
    if sweep.zip:
        rows = zip(*sweep.zip.values(), strict=True)
        found.append(("[zip]", [flattened(dict(zip(sweep.zip, row, strict=True))) for row in rows]))
    found += [
        ("[grid]", [flattened({key: value}) for value in values])
        for key, values in sweep.grid.items()
    ]
    if sweep.latin_hypercube is not None:
        found.append(("[latin_hypercube]", samples(sweep.latin_hypercube)))
    return found


def samples(hypercube: LatinHypercube) -> list[Overrides]:
    """The samples of a Latin hypercube, by its seed: each of the ``number`` equal parts of a range
    holds one."""
    from scipy.stats import qmc

    ranges = hypercube.ranges
    generator = np.random.default_rng(hypercube.seed)
    columns = qmc.LatinHypercube(d=len(ranges), seed=generator).random(hypercube.number).T
    for k, r in enumerate(ranges.values()):
        low, high = np.log([r.low, r.high]) if r.scale == "log" else (r.low, r.high)
        values = low + columns[k] * (high - low)
        columns[k] = np.exp(values) if r.scale == "log" else values
    return [
        {key: in_digits(v, _DIGITS) for key, v in zip(ranges, row, strict=True)}
        for row in columns.T
    ]


def combinations(found: list[Factor]) -> list[Overrides]:
    """The overrides of every case, the last factor varying fastest. Raises `InputError` if there
    are too many."""
    number = math.prod(len(choices) for _, choices in found)
    if number > MOST_CASES:
        raise InputError(f"has {number} cases; {MOST_CASES} are allowed.")
    rows = itertools.product(*(choices for _, choices in found))
    return [dict(itertools.chain.from_iterable(choice.items() for choice in row)) for row in rows]


def _checked_keys(found: list[Factor], joint: bool) -> list[str]:
    """All dotted keys that vary. Raises `InputError` for one that no scene has or that cannot vary,
    and for a quantity that two factors give. Keys of a ``joint`` have two parts; the keys of other
    scenes may name a part between."""
    keys = []
    given: dict[tuple[str, str], str] = {}
    for source, choices in found:
        own = {}
        for key in dict.fromkeys(key for choice in choices for key in choice):
            section, _, name = key.partition(".")
            if not name or ("." in name and joint):
                raise InputError(f"{source} {key}: must read section.key, like joint.clearance.")
            if section == "units" and source != "--set":
                raise InputError(
                    f"{source} {key}: cannot vary; all cases of a table have the same units."
                )
            if "." not in name:
                require_key(section, name, f"{source} {key}")
            # of alternative keys a scene holds one
            first = next(
                (names[0] for names in ALTERNATIVES.get(section, []) if name in names), name
            )
            if (section, first) in given:
                raise InputError(f"{source} {key}: is varied by {given[section, first]} already.")
            own[section, first] = f"{source} {key}"
            keys.append(key)
        given |= own
    return keys


_LATER = {
    "friction": 0.0,
    "strain": "small",
}  # keys of analysis that the first version did not have, and what it did


def run_name(scene: AnyScene) -> str:
    """Twelve hexadecimal digits that stand for the resolved scene, its output in the words of the
    first version that solved it so, and how archord solves it."""
    data = tomllib.loads(resolved(scene))
    fields = scene.output.fields
    data["output"] = {
        "fields": bool(fields),
        "stress": fields in ("nodes", "points"),
        "points": fields == "points",
    }
    later = {"contact": scene.output.contact, "checkpoint": scene.output.checkpoint}
    data["output"] |= {name: written for name, written in later.items() if not written}
    for name in [name for name, default in _LATER.items() if data["analysis"].get(name) == default]:
        del data["analysis"][name]
    return hashlib.sha256(
        f"archord {_SOLVED_ALIKE_SINCE}\n{tomli_w.dumps(data)}".encode()
    ).hexdigest()[:12]


def _scene(base: ByName, overrides: Overrides, path: Path) -> AnyScene:
    """The base with ``overrides``, checked. Raises `InputError`."""
    data = copy.deepcopy(base)
    ordered = in_order(f"{key}={toml_value(value)}" for key, value in overrides.items())
    if "joint" not in data and any(name in data for name in ("mesh", *PRESETS)):
        for override in ordered:
            override_key(data, override)
        return parse_any(data, str(path))
    for override in ordered:
        key = override.partition("=")[0]
        section, _, name = key.partition(".")
        put(data, section, name, overrides[key], key)
    read_targets(data, path)
    return parse_any(data, str(path))

"""What the sections of a scene are made of: documented keys with a unit, a default, limits and an
example."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic._internal._model_construction import ModelMetaclass

from archord.report.by_name import Names
from archord.report.errors import InputError
from archord.scene.sections.errors import Fault
from archord.scene.sections.faults import of_section

Name = Annotated[str, Field(min_length=1, pattern=r"^[^\x00-\x1f]*$")]  # text on one line
Positive = Annotated[float, Field(gt=0)]
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Axis = Annotated[list[float], Field(min_length=3, max_length=3)]
Place = Annotated[list[float], Field(min_length=2, max_length=3)]  # in a plane or in space

after = model_validator(mode="after")  # a check of a whole section


def key(
    description: str,
    unit: str = "",
    *,
    default: Any = ...,
    example: Any = None,
    other: Any = None,
    **limits: Any,
) -> Any:
    """A documented key; its ``unit`` is the scene's unit of that kind. ``--example`` shows
    ``example``, by default the ``default``, or commented out what ``other`` scenes may say of a key
    that is absent (None) by default."""
    shown = example if other is None else other
    default = None if default is ... and other is not None else default
    extra = {
        "unit": unit,
        "shown": default if shown is None else shown,
        "hidden": other is not None,
    }
    return Field(default, description=description, json_schema_extra=extra, **limits)


def require(holds: bool, place: str | Names, said: str) -> None:
    """Raise `Fault` unless it ``holds`` what is ``said`` of the key at ``place``, a tuple or
    "section.key"."""
    if not holds:
        raise Fault(tuple(place.split(".")) if isinstance(place, str) else place, said)


def given(section: BaseModel, names: Names) -> str:
    """The one key among ``names`` that ``section`` has. Raises `Fault` unless it has exactly
    one."""
    found = [name for name in names if getattr(section, name) is not None]
    require(len(found) > 0, names[0], f"is missing (or {', '.join(names[1:])})")
    require(len(found) == 1, found[0], f"must not be given together with {' and '.join(found[1:])}")
    return found[0]


def _part_name(name: str) -> str:
    require(name.isprintable(), (), "must be text on one line")
    require(name == name.strip(), (), "must not begin or end with a space")
    require(
        " [" not in name, (), 'must not hold " [", which begins the unit in the headings of tables'
    )
    return name


PartName = Annotated[
    Name, AfterValidator(_part_name)
]  # of a part of a scene, which heads columns of tables


def plain(value: Any) -> Any:
    """``value`` as a TOML file would give it: tables, lists and numbers of Python."""
    if isinstance(value, BaseModel):
        value = value.model_dump(exclude_unset=True)
    if isinstance(value, Mapping):
        return {str(name): plain(part) for name, part in value.items() if part is not None}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return value.tolist() if hasattr(value, "tolist") else value


class _InSentences(ModelMetaclass):
    """Makes a section that Python code asks for as a scene makes it: numbers and lists may be
    numpy's, None means absent, and bad values raise `InputError`, a sentence for each fault. Scenes
    check their sections without it."""

    def __call__(cls, *values: Any, **keys: Any) -> Any:
        made: Any = cls
        if made.__init__ is not BaseModel.__init__:  # a whole scene, which says more
            return super().__call__(*values, **keys)
        if values:
            known = ", ".join(cls.model_fields)
            raise InputError(
                f"archord.{cls.__name__}: takes its keys by name, as name=value; they are {known}."
            )
        given = plain(keys)
        try:
            return super().__call__(**given)
        except ValidationError as error:
            raise InputError(of_section(error.errors(), given, made)) from None


class Section(BaseModel, metaclass=_InSentences):
    """A section of a scene: no unknown keys, no conversions, no numbers that are not finite, not to
    be changed."""

    # a section that no scene uses is not built: to build all takes as long as the rest of a start
    model_config = ConfigDict(
        extra="forbid", strict=True, allow_inf_nan=False, frozen=True, defer_build=True
    )


def unused(section: BaseModel, name: str, key: str, needed: str) -> list[str]:
    """A warning of the ``key`` of a ``section`` of this ``name`` that is not its default, as it
    goes with what is ``needed`` alone."""
    value = getattr(section, key)
    if value == type(section).model_fields[key].default:
        return []
    return [f"{name}.{key} = {value:g} has no effect: it goes with {needed}"]

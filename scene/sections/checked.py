"""What every kind of scene shares: it is checked, with a sentence for every fault."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from archord.report.errors import InputError
from archord.scene.sections.faults import in_sentences
from archord.scene.sections.keys import Section, plain, require


class Checked(Section):
    """A scene, checked: sections given as tables or as their classes; the default ``format`` is the
    newest."""

    def __init__(
        self, source: str = "scene", origin: Mapping[str, str] | None = None, /, **sections: Any
    ) -> None:
        """Check ``sections`` as read from ``source``; ``origin`` names another source of some
        keys."""
        try:
            data = plain(sections)
        except RecursionError:
            raise InputError(
                f"{source}: is not a scene: its tables are nested too deeply."
            ) from None
        version = data.get("format")
        newest = type(self).model_fields["format"].default
        if (
            isinstance(version, int) and version > newest
        ):  # it may hold anything else that is unknown here
            said = f"is for a newer archord; this one reads format {newest}"
            raise InputError(f"{source}: format = {version} {said}.")
        try:
            units = data.get("units")
            context = {"stress": str(units.get("stress", "MPa"))} if isinstance(units, dict) else {}
            self.__pydantic_validator__.validate_python(data, self_instance=self, context=context)
        except ValidationError as error:
            raise InputError(
                in_sentences(error.errors(), data, type(self), source, dict(origin or {}))
            ) from None

    def require_open(self: Any, chosen: tuple[str, ...]) -> None:
        """Raise `Fault` if the scene gives a key of those that its accuracy chooses."""
        for name in chosen if self.analysis.accuracy is not None else ():
            section, key = name.split(".")
            table = getattr(self, section)
            free = key not in table.model_fields_set or getattr(table, key) is None
            require(
                free, name, "must not be given together with analysis.accuracy, which chooses it"
            )

    @property
    def thickness(self: Any) -> float:
        """Thickness, 1 if forces are per unit thickness."""
        return self.analysis.thickness or 1.0

    @property
    def doubts(self: Any) -> list[str]:
        """What to warn of before anything is solved."""
        return [*self.units.doubts, *self.analysis.doubts]

    @property
    def materials(self: Any) -> dict[str, dict[str, Any]]:
        """The numbers that each body is solved with, by its name: E, nu, the yield stress, and in
        words how it hardens."""
        unit = self.units.stress
        solids = self.solids.items()
        return {
            name: solid.model_dump(include={"E", "nu", "yield_stress"})
            | {"strength": solid.strength(unit)}
            for name, solid in solids
        }

    @property
    def plastic(self: Any) -> bool:
        """Whether any body can yield."""
        return any(solid.plastic for solid in self.solids.values())

"""What every kind of scene shares: it is checked, with a sentence for every fault."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import ValidationError

from archord.report.by_name import ByName, Names
from archord.report.errors import InputError
from archord.scene.sections.bodies import strength_doubts
from archord.scene.sections.faults import in_sentences
from archord.scene.sections.keys import Section, plain, require


class Checked(Section):
    """A scene, checked: sections given as tables or as their classes; the default ``format`` is the
    newest.

    What the commands ask of any scene stands here as a general scene answers it.
    """

    # keys that an accuracy chooses
    chosen: ClassVar[Names] = ()
    # whether the closed-form laws of P(delta) are for scenes of this kind
    has_laws: ClassVar[bool] = False

    def __init__(
        self, source: str = "scene", origin: Mapping[str, str] | None = None, /, **sections: Any
    ) -> None:
        """Check ``sections`` as read from ``source``; ``origin`` names another source of some
        keys."""
        try:
            data = plain(sections)
        except RecursionError:
            raise InputError(source, "is not a scene: its tables are nested too deeply.") from None
        version = data.get("format")
        newest = type(self).model_fields["format"].default
        if (
            isinstance(version, int) and version > newest
        ):  # it may hold anything else that is unknown here
            said = f"is for a newer archord; this one reads format {newest}"
            raise InputError(source, f"format = {version} {said}.")
        try:
            units = data.get("units")
            context = {"stress": str(units.get("stress", "MPa"))} if isinstance(units, dict) else {}
            self.__pydantic_validator__.validate_python(data, self_instance=self, context=context)
        except ValidationError as error:
            raise InputError(
                in_sentences(error.errors(), data, type(self), source, dict(origin or {}))
            ) from None
        # no field: scenes of different files are equal
        self.__dict__["_places"] = {"": source} | dict(origin or {})

    def where(self, key: str) -> str:
        """What messages call the place of the dotted ``key``: the scene's file, or the option that
        gave the key."""
        places = self.__dict__["_places"]
        return places.get(key, places[""])

    def require_open(self: Any) -> None:
        """Raise `Fault` if the scene gives a key that its accuracy chooses."""
        for section, key in self._left_open:
            table = getattr(self, section)
            free = key not in table.model_fields_set or getattr(table, key) is None
            said = "must not be given together with analysis.accuracy, which chooses it"
            require(free, f"{section}.{key}", said)

    @property
    def _left_open(self: Any) -> list[list[str]]:
        """Sections and keys that the scene leaves to its accuracy; none if it asks for none."""
        if self.analysis.accuracy is None:
            return []
        return [name.split(".") for name in self.chosen]

    def require_mesh(self) -> None:
        """Raise `InputError` if the scene leaves open which mesh is meant."""

    def general(self) -> ByName:
        """The table of the general scene that this one stands for: its own, if it is one."""
        return self.resolved_data()

    def resolved_data(self) -> ByName:
        """The table of the scene, with every default filled in but for what an accuracy chooses."""
        data = self.model_dump(exclude_none=True)
        for section, key in self._left_open:
            data[section].pop(key, None)
        return data

    @property
    def expected_cells(self) -> float:
        """About how many cells the mesh will have; 0 where nobody knows before it is made."""
        return 0.0

    def heading(self, key: str) -> str:
        """What heads a column of the dotted ``key``."""
        return key

    def value(self, key: str, given: Any = None) -> Any:
        """What a table shows for the dotted ``key`` that was ``given``: a preset's scene holds none
        of the preset's keys."""
        return given

    @property
    def thickness(self: Any) -> float:
        """Thickness, 1 if forces are per unit thickness."""
        return self.analysis.thickness or 1.0

    @property
    def doubts(self: Any) -> list[str]:
        """What to warn of before anything is solved."""
        return [*self.units.doubts, *self.analysis.doubts, *strength_doubts(self.solids)]

    @property
    def materials(self: Any) -> dict[str, ByName]:
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

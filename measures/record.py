"""The record of a step: what was measured, and what the step cost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from archord.report.by_name import Amounts, ByName

# A joint's values, which files of runs hold side by side with the rest of its records (format 1)
_OF_JOINT = ("delta", "P", "p0", "eps", "peeq_max", "peeq_integral")
WORST = ("peeq_max", "at x", "at y")  # of a body: the largest PEEQ, and its place


@dataclass(frozen=True)
class Record:
    """One accepted output step of the whole problem, in its units.

    ``at`` is the load that the files of fields and contact name. ``values`` are the numbers of
    its measures by their names, the names of columns of history.csv. ``contact_area`` is the
    length of the surfaces in contact, the mean of both sides of each interaction.
    """

    step: int
    at: float
    values: Amounts
    contact_area: float
    elastic_energy: float
    plastic_dissipation: float
    work: float
    force_balance: float
    iterations: int
    cutbacks: int
    seconds: float
    friction_dissipation: float = 0.0

    def __getitem__(self, name: str) -> Any:
        """The value of a measure, or what every record has, by its name."""
        return self.values[name] if name in self.values else getattr(self, name)

    @property
    def dissipated(self) -> float:
        """Energy dissipated by yielding and by friction."""
        return self.plastic_dissipation + self.friction_dissipation

    @property
    def missing(self) -> float:
        """Work of the loads that is neither stored nor dissipated."""
        return self.work - self.elastic_energy - self.dissipated

    def plain(self) -> ByName:
        """The record as run.json and checkpoints hold it."""
        told = asdict(self)
        if not self.values.keys() >= {*_OF_JOINT}:
            return told
        del told["at"]
        values = told.pop("values")
        places = [name.removesuffix(" peeq_max") for name in values if name.endswith(" peeq_max")]
        peeq = {place: [values[f"{place} {what}"] for what in WORST] for place in places}
        return told | {name: values[name] for name in _OF_JOINT} | {"peeq": peeq}

    @classmethod
    def read(cls, told: Mapping[str, Any]) -> Record:
        """The record that is ``told`` so, among other things. Raises KeyError and TypeError for
        what is none."""
        told = dict(told)
        if "values" not in told:
            values = {name: told[name] for name in _OF_JOINT}
            for place, worst in told.get("peeq", {}).items():  # runs of version 0.1 lack it
                values |= {f"{place} {what}": v for what, v in zip(WORST, worst, strict=True)}
            told |= {"values": values, "at": values["delta"]}
        return cls(**{field.name: told[field.name] for field in fields(cls) if field.name in told})

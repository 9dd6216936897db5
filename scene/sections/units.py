"""The section ``units``: names of the units, and the units of forces and energies."""

from __future__ import annotations

from archord.scene.sections.keys import Name, Section, key

_FORCES = {  # units of stress and length, and of the force that is stress times length squared
    ("MPa", "mm"): "N",
    ("N/mm2", "mm"): "N",
    ("Pa", "m"): "N",
    ("GPa", "mm"): "kN",
    ("kPa", "m"): "kN",
    ("MPa", "m"): "MN",
    ("psi", "in"): "lbf",
    ("ksi", "in"): "kip",
}
_INCHES = {"in": "in", "inch": "in"}
_LENGTHS = ("mm", "cm", "m", "um", *_INCHES, "ft")


class Units(Section):
    """Names of the scene's units, for headings; they must be consistent (force = stress times
    length squared)."""

    length: Name = key("unit of length", default="mm")
    stress: Name = key("unit of stress and of Young's modulus", default="MPa")

    def force_of(self, thickness: float | None) -> str:
        """Unit of force of a joint of this thickness, per unit thickness without."""
        known = _FORCES.get((self.stress, _INCHES.get(self.length, self.length)))
        if thickness is None:
            return f"{known}/{self.length}" if known else f"{self.stress} {self.length}"
        return known or f"{self.stress} {self.length}2"

    @property
    def doubts(self) -> list[str]:
        """What to warn of: inches beside metric stresses or the other way round, as a default may
        do it."""
        imperial = self.stress in ("psi", "ksi"), self.length in (*_INCHES, "ft")
        if imperial[0] == imperial[1] or self.length not in _LENGTHS:
            return []
        cure = 'units.length = "in"' if imperial[0] else 'units.stress = "psi" or "ksi"'
        force = self.force_of(1.0)
        given = f"units.stress = {self.stress!r} with units.length = {self.length!r}"
        return [f"{given} makes {force} the unit of force; {cure} would make it lbf or kip"]

    def energy_of(self, thickness: float | None) -> str:
        """Unit of energy of a joint of this thickness, per unit thickness without."""
        return self.force_of(1.0) + ("" if thickness is None else f" {self.length}")

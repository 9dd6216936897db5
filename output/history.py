"""history.csv: one row per accepted output step, in the scene's units with the dimensionless forms beside them."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from archord.output.disk import replace_file
from archord.scene.scene import Scene

if TYPE_CHECKING:
    from archord.presets.measures import Measures


def _columns(scene: Scene) -> list[tuple[str, str, float]]:
    """Heading, attribute of `Measures` and divisor of every column."""
    units, R, dR, E = scene.units, scene.joint.radius, scene.joint.dR, scene.E_star
    energy = "(E* R2)", E * R * R
    table: list[tuple[str, str, str, float]] = [
        # attribute, unit, what makes it dimensionless, its value
        ("step", "", "", 1.0),
        ("delta", units.length, "dR", dR),
        ("P", units.force, "(E* R)", E * R),
        ("p0", units.stress, "E*", E),
        ("eps", "rad", "", 1.0),
        ("contact_area", units.length, "R", R),
        ("peeq_max", "", "", 1.0),
        ("peeq_integral", f"{units.length}2", "R2", R * R),
        ("elastic_energy", units.energy, *energy),
        ("plastic_dissipation", units.energy, *energy),
        ("work", units.energy, *energy),
        ("force_balance", "", "", 1.0),
        ("iterations", "", "", 1.0),
        ("cutbacks", "", "", 1.0),
        ("seconds", "s", "", 1.0),
    ]
    columns = []
    for name, unit, scale, divisor in table:
        columns.append((f"{name} [{unit}]" if unit else name, name, 1.0))
        if scale:
            columns.append((f"{name}/{scale}", name, divisor))
    return columns


def write_history(path: Path, scene: Scene, steps: Sequence[Measures]) -> None:
    """Replace ``path`` by the table of ``steps`` in one move; whole numbers stay whole. Raises `OSError`."""
    columns, text = _columns(scene), io.StringIO(newline="")
    table = csv.writer(text)
    table.writerow([heading for heading, _, _ in columns])
    for m in steps:
        values = ((getattr(m, name), divisor) for _, name, divisor in columns)
        table.writerow([str(v) if isinstance(v, int) else f"{v / divisor:.12g}" for v, divisor in values])
    replace_file(path, text.getvalue())


def read_history(path: str | Path) -> dict[str, list[float]]:
    """The columns of a history.csv by name without unit: ``read_history(p)["P"]``, ``["P/(E* R)"]``, ...

    A last row that does not end in a line break (a copy cut short) is ignored.
    """
    text = Path(path).read_bytes().decode()
    heading, *rows = csv.reader(io.StringIO(text[: text.rfind("\n") + 1], newline=""))
    names = [h.split(" [")[0] for h in heading]
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(names)}

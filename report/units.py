"""Units of length by their names, and what STEP files need of them: they are read in mm, whatever
their own unit."""

from __future__ import annotations

METRES = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "inch": 0.0254, "ft": 0.3048}
_DEFAULT = "mm"  # also of scenes that do not say their units
_FAR = 10.0  # factor between a scale and the right one that no shape is drawn larger or smaller by


def scale_lacks(file: str, scale: float, length: str) -> str:
    """What is said of the ``scale`` of a STEP ``file`` where the unit of ``length`` needs another
    one by far; nothing where it may be right."""
    is_step = file.lower().endswith((".step", ".stp"))
    if not is_step or length == _DEFAULT or length not in METRES:
        return ""
    wanted = METRES["mm"] / METRES[length]
    if wanted / _FAR < scale < wanted * _FAR:
        return ""
    return (
        f"is far from {wanted:.10g}, which takes mm to the unit of length "
        f'"{length}": STEP files are read in mm, whatever their unit'
    )

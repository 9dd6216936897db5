"""Units of length of files: STEP files are read in mm, whatever their own unit."""

from __future__ import annotations

_MILLIMETRES = {"um": 1e-3, "cm": 10.0, "m": 1e3, "in": 25.4, "inch": 25.4, "ft": 304.8}


def scale_lacks(file: str, scale: float, length: str) -> str:
    """What is said of the ``scale`` of a STEP ``file`` where the unit of ``length`` needs another
    one; nothing where it may be right."""
    is_step = file.lower().endswith((".step", ".stp"))
    if not is_step or scale != 1 or length not in _MILLIMETRES:
        return ""
    wanted = 1 / _MILLIMETRES[length]
    return (
        "must not be 1, as STEP files are read in mm, whatever their unit, and the unit of length "
        f'is "{length}"; give {wanted:.10g}'
    )

"""A sweep's folder as an object: its cases, their histories in one table, and their runs. It reads, and never solves."""

from pathlib import Path


def is_sweep(folder: str | Path) -> bool:
    """Whether ``folder`` is that of a sweep."""
    return (Path(folder) / "sweep.toml").is_file()


class Sweep:
    """x"""

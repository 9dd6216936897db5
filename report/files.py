"""Files that a user names, written beside the old ones; and what a benchmark leaves: rows as CSV,
tables, a picture."""

from __future__ import annotations

import csv
import json
import os
import shutil
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

Row = Mapping[str, object]
_DEVICES = (Path("/dev/stdout"), Path("/dev/stderr"), Path("/dev/fd"), Path("/proc"))
_MOST_LINKS = 40  # one after the other, as Linux has it


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path of the same name to write to, which takes the place of ``path`` when all has gone
    well; else ``path`` is what it was. A link stays and its file is replaced, with its permissions;
    what no file can replace, as a device, a pipe, or a file in a folder that cannot be written,
    gets the content at the end. Raises `OSError`; a ValueError about the new path names
    ``path``."""
    real = path.resolve()
    moves = not is_device(path) and os.access(real.parent, os.W_OK)
    with TemporaryDirectory(prefix=".archord-", dir=real.parent if moves else None) as folder:
        new = Path(folder) / path.name
        try:
            yield new
        except ValueError as error:
            raise ValueError(str(error).replace(str(new), str(path))) from error
        if not moves:
            with new.open("rb") as source, path.open("wb") as target:
                shutil.copyfileobj(source, target)
            return
        if real.exists():
            shutil.copymode(real, new)
        new.replace(real)


def toml_beside(module: str, name: str) -> Any:
    """The tables of the file of this ``name`` beside a ``module``, its ``__file__``."""
    return tomllib.loads(Path(module).with_name(name).read_text(encoding="utf-8"))


def read_json(path: Path) -> Any:
    """What a file of JSON holds."""
    return json.loads(path.read_bytes())


def write_text(text: str, path: Path) -> None:
    """Write ``text`` as a file."""
    with replacing(path) as new:
        new.write_text(text, encoding="utf-8")


def is_device(path: Path) -> bool:
    """Whether ``path`` is something else than a file, or a link to what the system keeps, as
    /dev/stdout is."""
    if path.exists() and not path.is_file():
        return True
    place = path.absolute()
    for _ in range(_MOST_LINKS):
        if any(place.is_relative_to(devices) for devices in _DEVICES):
            return True
        if not place.is_symlink():
            break
        place = place.parent / place.readlink()
    return False


def write_rows(rows: Sequence[Row], path: Path) -> None:
    """Write ``rows``, at least one, which all have the headings of the first, as CSV."""
    with replacing(path) as new, new.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def write_report(
    folder: Path,
    name: str,
    rows: Sequence[Row],
    markdown: str,
    draw: Callable[[Path], object] | None = None,
) -> list[Path]:
    """Write ``name``.csv (the rows), ``name``.md and, if there is ``draw`` for it, ``name``.png
    into ``folder``, which is made if it is not there; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{name}.csv", folder / f"{name}.md"]
    write_rows(rows, files[0])
    write_text(markdown, files[1])
    if draw is not None:
        files.append(folder / f"{name}.png")
        draw(files[-1])
    return files

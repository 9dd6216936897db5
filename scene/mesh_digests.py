"""Checksums of a mesh file and of the files that it names, by which a later change is known."""

from __future__ import annotations

import hashlib
import re
from functools import lru_cache
from pathlib import Path

from archord.report.by_name import Words

_NAMED = {
    ".inp": re.compile(rb"^\s*\*.*INPUT\s*=\s*([^,\r\n]+)", re.IGNORECASE | re.MULTILINE),
    ".xdmf": re.compile(rb">\s*([^<>:]+):/"),  # of data items
}


def digests(mesh: Path) -> Words:
    """SHA-256 of the file ``mesh``, by the name "", and of the files in its folder that it names,
    by their names. Raises OSError for a ``mesh`` that cannot be read."""
    found = {}
    left = [("", mesh)]
    while left:
        name, file = left.pop()
        known = file.stat()
        key = file, known.st_mtime_ns, known.st_size, known.st_ino
        found[name], named = _digest_and_names(*key)
        others = {other: mesh.parent / other for other in named if other not in found}
        left += [(other, path) for other, path in others.items() if path.is_file()]
    return found


@lru_cache(maxsize=64)
def _digest_and_names(file: Path, changed: int, size: int, inode: int) -> tuple[str, list[str]]:
    content = file.read_bytes()
    naming = _NAMED.get(file.suffix.lower())
    names = naming.findall(content) if naming else []
    digest = hashlib.sha256(content).hexdigest()
    return digest, [name.decode(errors="replace").strip(' "') for name in names]

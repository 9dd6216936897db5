"""The attributes of objects in words that are the same in every process: they tell whether an
object of a user's class was changed."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np

_ADDRESS = re.compile(r" at 0x[0-9a-f]+")
_LONGEST = 200  # characters of an attribute; of more the beginning and a checksum
_SHOWN = 60


def described(value: Any) -> str:
    """What Python prints of ``value``, on one line and without addresses, which differ in every
    process."""
    return " ".join(_ADDRESS.sub("", repr(value)).split())


def attributes_of(value: Any) -> dict[str, str]:
    """The attributes of an object in words, by their names; of arrays and long words a SHA-256."""
    return {name: _short(words) for name, words in _own_words(value, ()).items()}


def _own_words(value: Any, within: tuple[int, ...]) -> dict[str, str]:
    """The words of all attributes that are no cached properties; ``within`` has the ids of the
    objects that ``value`` is an attribute of."""
    kinds = type(value).__mro__
    slots = [name for kind in kinds for name in np.atleast_1d(vars(kind).get("__slots__", ()))]
    names = [str(name) for name in slots if hasattr(value, str(name))]
    names += getattr(value, "__dict__", {})
    inner = (*within, id(value))
    return {
        name: _in_words(getattr(value, name), inner)
        for name in names
        if not isinstance(getattr(type(value), name, None), cached_property)
    }


def _in_words(value: Any, within: tuple[int, ...]) -> str:
    if id(value) in within:
        return "itself"
    inner = (*within, id(value))
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        return f"array {value.dtype} {value.shape} {_digest(value.tobytes())}"
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        pairs = [f"{_in_words(k, inner)}: {_in_words(v, inner)}" for k, v in value.items()]
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_in_words(entry, inner) for entry in value)}]"
    if isinstance(value, (set, frozenset)):
        return f"{{{', '.join(sorted(_in_words(entry, inner) for entry in value))}}}"
    if isinstance(value, (type, ModuleType)):
        return described(value)
    own = ", ".join(f"{name}={words}" for name, words in _own_words(value, within).items())
    return f"{type(value).__qualname__}({own})" if own else described(value)


def _short(words: str) -> str:
    if len(words) <= _LONGEST:
        return words
    return f"{words[:_SHOWN]}... {_digest(words.encode())}"


def _digest(content: bytes) -> str:
    return f"sha256 {hashlib.sha256(content).hexdigest()}"

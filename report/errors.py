"""What is said of bad input, in sentences."""

from __future__ import annotations

import functools
import inspect
import json
import math
from numbers import Real
from typing import Any

_LONGEST = 40  # characters of a value in a message


class InputError(ValueError):
    """Bad input: the message has one sentence a line.

    Each sentence names the file or the part, the key, its value and what is allowed. The command
    line prints the message and ends with exit code 2.

    Examples
    --------
    >>> import archord
    >>> try:
    ...     archord.Coupling("crank", kind="stiff")
    ... except archord.InputError as error:
    ...     print(error)
    archord.Coupling: coupling "crank".kind = "stiff" must be "rigid" or "distributing".
    """

    def __init__(self, *said: object) -> None:
        """The message is what is ``said``, first of what, with colons between."""
        super().__init__(": ".join(map(str, said)))


def in_sentences(cls: type) -> Any:
    """Let a call of ``cls`` with wrong arguments raise `InputError`, a sentence; and let its
    objects have arguments of their own: arrays, lists and dictionaries may be changed later."""
    build = cls.__init__  # type: ignore[misc]
    signature = inspect.signature(build)
    known = ", ".join([*signature.parameters][1:])

    @functools.wraps(build)
    def checked(self: Any, *values: Any, **keys: Any) -> None:
        try:
            signature.bind(self, *values, **keys)
        except TypeError as error:
            said = f"{error}; its arguments are {known}"
            raise InputError(f"archord.{cls.__name__}: {said}.") from None
        build(self, *_copied(values), **_copied(keys))

    cls.__init__ = checked  # type: ignore[misc]
    return cls


def _copied(value: Any) -> Any:
    """``value`` with copies of the arrays, lists and dictionaries in it, and numpy's scalars as
    Python's."""
    if type(value) in (list, tuple):
        return type(value)(map(_copied, value))
    if type(value) is dict:
        return {key: _copied(of_key) for key, of_key in value.items()}
    is_array = type(value).__module__ == "numpy" and hasattr(value, "shape")
    if is_array and value.shape == ():
        return value.item()
    return value.copy() if is_array else value


def shown(value: Any) -> str:
    """``value`` as a message shows it."""
    text = json.dumps(value, default=repr)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def is_number(value: Any) -> bool:
    """Whether ``value`` is a finite number."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def require_of(part: Any, holds: bool, key: str, said: str) -> None:
    """Raise `InputError` unless it ``holds`` what is ``said`` of the ``key`` of ``part``."""
    if not holds:
        kind = type(part).__name__
        place = f'{kind.lower()} "{part.name}".{key}' if hasattr(part, "name") else key
        value = shown(getattr(part, key))
        raise InputError(f"archord.{kind}: {place} = {value} {said}.")


def require_between(
    part: Any, key: str, low: float, high: float, said: str, *, least: bool = False
) -> None:
    """Raise `InputError`, with what is ``said``, unless the ``key`` of ``part`` is a finite number
    above ``low`` (or ``low`` itself where it is the ``least``) and below ``high``."""
    value = getattr(part, key)
    inside = is_number(value) and (low < value < high or (least and value == low))
    require_of(part, inside, key, said)

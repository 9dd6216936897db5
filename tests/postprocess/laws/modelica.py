"""Functions of a Modelica package as Python's, statement by statement: enough to run what an export
holds."""

from __future__ import annotations

import re
from typing import Any


def functions_of(package: str) -> dict[str, Any]:
    """The package's functions and tables by name; tables count from 1, and asserts are left out."""
    lines = ["from math import atan2, cos, floor as integer, log, sin, sqrt"]
    lines.append("def div(a, b): return a // b")
    for name, value in re.findall(
        r"constant (?:Real|Integer) (\w+)(?:\[\d+\])? = (.*?);", package, re.S
    ):
        lines.append(f"{name} = {value.replace('{', '[None, ').replace('}', ']')}")
    for name, body in re.findall(r'function (\w+) "[^"]*"\n(.*?)  end \1;', package, re.S):
        inputs, outputs = (
            ", ".join(re.findall(rf"{kind} \w+ (\w+)", body)) for kind in ("input", "output")
        )
        lines.append(f"def {name}({inputs}):")
        depth = 1
        for statement in re.findall(r"    (\S.*)\n", body.split("algorithm\n")[1]):
            if statement.startswith("end "):
                depth -= 1
            elif not statement.startswith("assert("):
                lines.append("    " * (depth - (statement == "else")) + _in_python(statement))
                depth += statement.endswith((" then", " loop"))
        lines.append(f"    return {outputs}")
    space: dict[str, Any] = {}
    exec("\n".join(lines), space)
    return space


def _in_python(statement: str) -> str:
    loop = re.sub(r"for k in 1:(\w+) loop", r"for k in range(\1):", statement)
    return re.sub(" (then|loop)$", ":", loop).replace(":=", "=").removesuffix(";") + (
        ":" if statement == "else" else ""
    )

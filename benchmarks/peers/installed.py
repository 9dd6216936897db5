"""The codes beside archord that are here: ``python3 -m archord.benchmarks.peers.installed`` lists them.

A peer is one standalone script of this folder. Those of PyPI (requirements.txt) have a virtual environment of their
own, ``.cache/peers-venv`` in the checkout, so that their numpy and archord's do not meet (docs/peers.md).
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

PLACE = Path(__file__).resolve().parents[2] / ".cache" / "peers-venv" / "bin" / "python"
_PROBE_LIMIT = 120.0  # seconds; the first import from a cold disk is slow


@dataclass(frozen=True)
class Peer:
    """A code beside archord, and the interpreter ``python`` that has it. ``series`` has (element size over R, order)
    from coarse to fine for each case; one run may take ``time_limit`` seconds."""

    label: str
    script: Path
    series: Mapping[str, tuple[tuple[float, int], ...]]
    time_limit: float = 300.0
    python: str = sys.executable
    version: str = ""

    def command(self, case: str, size: float, order: int, steps: int, output: Path) -> list[str]:
        """The command line that solves ``case`` and writes its result, JSON, to ``output``."""
        options = {"--case": case, "--size": size, "--order": order, "--steps": steps, "--output": output}
        return [self.python, str(self.script), *(str(word) for option in options.items() for word in option)]


def _peer(label: str, script: str, **sizes: Mapping[int, Sequence[float]]) -> Peer:
    """The peer ``label`` with its element sizes by order for each case."""
    series = {case: tuple((size, order) for order in known for size in known[order]) for case, known in sizes.items()}
    return Peer(label, Path(__file__).with_name(script), series)


_EACH = (0.16, 0.08, 0.04, 0.02)
PEERS = (
    _peer("scikit-fem", "skfem_joint.py", elastic={2: (*_EACH, 0.01)}, plastic={2: _EACH}),
    _peer("GetFEM", "getfem_joint.py", elastic={2: _EACH}, plastic={2: _EACH}),
    _peer("NGSolve", "ngsolve_joint.py", elastic={2: _EACH[1:], 4: _EACH}, plastic={2: _EACH[1:], 4: _EACH[:3]}),
)


def probe(peer: Peer, python: str) -> str | None:
    """The version of the peer's code that ``python`` has, None if it has none."""
    try:
        command = [python, str(peer.script), "--probe"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=_PROBE_LIMIT)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def installed(pythons: Sequence[str] = (str(PLACE), sys.executable)) -> list[Peer]:
    """The peers that run here, each with its version and the first of the interpreters ``pythons`` that has it: that of
    the environment (scikit-fem, NGSolve), then this one (GetFEM, which the image target ``peers`` has)."""
    found = []
    for peer in PEERS:
        versions = ((python, probe(peer, python)) for python in pythons)
        found += [replace(peer, python=python, version=v) for python, v in versions if v is not None][:1]
    return found


if __name__ == "__main__":
    for here in installed():
        print(f"{here.label} {here.version}: {here.python} {here.script}")

"""The peers of the benchmark "error against run time" that are here: ``python3 -m archord.benchmarks.peers.installed``.

A peer is one standalone script of this folder. Interpreters are tried in turn: that of
`archord.benchmarks.peers.environment` (scikit-fem, NGSolve), then this one (GetFEM, which the image target ``peers``
has).
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from archord.benchmarks.peers.environment import interpreter

CASES = ("elastic", "plastic")
_PROBE_LIMIT = 120.0  # seconds; the first import from a cold disk is slow
_FOLDER = Path(__file__).resolve().parent

Meshes = tuple[tuple[float, int], ...]


@dataclass(frozen=True)
class Peer:
    """A code beside archord: ``series`` has (element size over R, order) from coarse to fine for each case.

    ``time_limit`` is what one run may take, in seconds; ``python`` the interpreter that has the code.
    """

    label: str
    script: Path
    series: Mapping[str, Meshes]
    time_limit: float = 300.0
    python: str = sys.executable
    version: str = ""

    def command(self, case: str, size: float, order: int, steps: int, output: Path) -> list[str]:
        """The command line that solves ``case`` and writes its result, JSON, to ``output``."""
        options = {"--case": case, "--size": size, "--order": order, "--steps": steps, "--output": output}
        return [self.python, str(self.script), *(str(word) for option in options.items() for word in option)]


def _sizes(order: int, *sizes: float) -> Meshes:
    return tuple((size, order) for size in sizes)


PEERS = (
    Peer(
        "scikit-fem",
        _FOLDER / "skfem_joint.py",
        {
            "elastic": _sizes(2, 0.16, 0.08, 0.04, 0.02, 0.01),
            "plastic": _sizes(2, 0.16, 0.08, 0.04, 0.02),
        },
    ),
    Peer(
        "GetFEM",
        _FOLDER / "getfem_joint.py",
        {
            "elastic": _sizes(2, 0.16, 0.08, 0.04, 0.02),
            "plastic": _sizes(2, 0.16, 0.08, 0.04, 0.02),
        },
    ),
    Peer(
        "NGSolve",
        _FOLDER / "ngsolve_joint.py",
        {
            "elastic": _sizes(2, 0.08, 0.04, 0.02) + _sizes(4, 0.16, 0.08, 0.04, 0.02),
            "plastic": _sizes(2, 0.08, 0.04, 0.02) + _sizes(4, 0.16, 0.08, 0.04),
        },
    ),
)


def probe(peer: Peer, python: str) -> str | None:
    """The version of the peer's code that ``python`` has, None if it has none."""
    try:
        command = [python, str(peer.script), "--probe"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=_PROBE_LIMIT)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def installed(pythons: Sequence[str] | None = None) -> list[Peer]:
    """The peers that run here, each with its interpreter and version; ``pythons`` are tried in turn."""
    if pythons is None:
        pythons = [python for python in (str(interpreter()), sys.executable) if Path(python).exists()]
    found = []
    for peer in PEERS:
        for python in pythons:
            version = probe(peer, python)
            if version is not None:
                found.append(Peer(peer.label, peer.script, peer.series, peer.time_limit, python, version))
                break
    return found


def main() -> int:
    """Print what is installed; returns the exit code."""
    for peer in installed():
        print(f"{peer.label} {peer.version}: {peer.python} {peer.script}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

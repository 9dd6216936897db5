"""The codes beside archord that are here: ``python3 -m archord.benchmarks.peers.installed`` lists
them.

A peer is one standalone script of this folder. Those of PyPI (requirements.txt) have a virtual
environment of their own, ``.cache/peers-venv`` in the checkout, so that their numpy and archord's
do not meet (docs/peers.md). The script for asimov-contact finds it in ``.cache/asimov``, where
``asimov_build.sh`` puts it.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

PLACE = Path(__file__).resolve().parents[2] / ".cache" / "peers-venv" / "bin" / "python"
_LIMIT = 120.0  # seconds; the first import from a cold disk is slow


@dataclass(frozen=True)
class Peer:
    """A code beside archord, and the interpreter ``python`` that has it. ``series`` has (element
    size over R, order) from coarse to fine for each case that the code can solve; one run may take
    ``time_limit`` seconds."""

    label: str
    script: str
    series: Mapping[str, tuple[tuple[float, int], ...]]
    python: str = str(PLACE)
    version: str = ""
    time_limit: float = 300.0

    def command(self, case: str, size: float, order: int, steps: int, output: Path) -> list[str]:
        """The command line that solves ``case`` and writes its result, JSON, to ``output``."""
        options = ("--case", case, "--size", size, "--order", order, "--steps", steps)
        return self._started(*map(str, options), "--output", str(output))

    def _started(self, *words: str) -> list[str]:
        return [self.python, str(Path(__file__).with_name(self.script)), *words]

    def probe(self) -> str | None:
        """The version of the code, None if it is not here."""
        command = self._started("--probe")
        try:
            said = subprocess.check_output(
                command, stderr=subprocess.DEVNULL, text=True, timeout=_LIMIT
            )
        except (OSError, subprocess.SubprocessError):
            return None
        # Kratos prints a banner, too
        return next((line for line in said.split("\n") if re.fullmatch(r"[\w.+-]+", line)), None)


_COARSE = ((0.16, 2), (0.08, 2), (0.04, 2), (0.02, 2))
_LINEAR = ((0.04, 1), (0.02, 1), (0.01, 1), (0.005, 1))
_HIGH = ((0.16, 4), (0.08, 4), (0.04, 4), (0.02, 4))
PEERS = (
    Peer("scikit-fem", "skfem_joint.py", {"elastic": (*_COARSE, (0.01, 2)), "plastic": _COARSE}),
    # of the image target peers
    Peer("GetFEM", "getfem_joint.py", {"elastic": _COARSE, "plastic": _COARSE}, sys.executable),
    Peer(
        "NGSolve",
        "ngsolve_joint.py",
        {"elastic": _COARSE[1:] + _HIGH, "plastic": _COARSE[1:] + _HIGH[:3]},
    ),
    # of the image target peers, with what asimov_build.sh makes; it has no plasticity
    Peer("asimov-contact", "asimov_joint.py", {"elastic": (*_COARSE, (0.01, 2))}, sys.executable),
    Peer("Kratos", "kratos_joint.py", {"elastic": _LINEAR, "plastic": _LINEAR[:3]}),
)


def installed() -> list[Peer]:
    """The peers that run here, each with its version."""
    versions = [(peer, peer.probe()) for peer in PEERS]
    return [replace(peer, version=found) for peer, found in versions if found is not None]


if __name__ == "__main__":
    for here in installed():
        print(f"{here.label} {here.version}: {here.python} {here.script}")

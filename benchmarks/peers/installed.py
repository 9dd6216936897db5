"""The codes beside archord that are here: ``python3 -m archord.benchmarks.peers.installed`` lists them.

A peer is one standalone script of this folder. With ``--install`` those that PyPI has get a virtual environment of
their own, ``.cache/peers-venv`` in the checkout, without the system's packages, so that their numpy and archord's do
not meet. About 1.5 GB, most of it MKL (PARDISO, scikit-fem's linear solver). Where a proxy signs with its own
authority: ``docker/run env PIP_CERT=.cache/ca.pem python3 -m archord.benchmarks.peers.installed --install``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import venv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

CASES = ("elastic", "plastic")
PLACE = Path(__file__).resolve().parents[2] / ".cache" / "peers-venv"
PACKAGES = ("scikit-fem==12.0.2", "pypardiso==0.4.7", "gmsh==4.15.2", "ngsolve==6.2.2608")
_PROBE_LIMIT = 120.0  # seconds; the first import from a cold disk is slow

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


def _peer(label: str, elastic: Mapping[int, Sequence[float]], plastic: Mapping[int, Sequence[float]]) -> Peer:
    """The peer ``label`` with its element sizes by order."""
    script = Path(__file__).with_name(f"{label.lower().replace('scikit-', 'sk')}_joint.py")
    series = (tuple((size, order) for order in sizes for size in sizes[order]) for sizes in (elastic, plastic))
    return Peer(label, script, dict(zip(CASES, series, strict=True)))


PEERS = (
    _peer("scikit-fem", {2: (0.16, 0.08, 0.04, 0.02, 0.01)}, {2: (0.16, 0.08, 0.04, 0.02)}),
    _peer("GetFEM", {2: (0.16, 0.08, 0.04, 0.02)}, {2: (0.16, 0.08, 0.04, 0.02)}),
    _peer(
        "NGSolve",
        {2: (0.08, 0.04, 0.02), 4: (0.16, 0.08, 0.04, 0.02)},
        {2: (0.08, 0.04, 0.02), 4: (0.16, 0.08, 0.04)},
    ),
)


def install(place: Path = PLACE) -> None:
    """Make the environment, in place of one that is there. Raises `subprocess.CalledProcessError` if pip fails."""
    venv.create(place, clear=True, with_pip=False)
    pip = [sys.executable, "-m", "pip", "--python", str(place / "bin" / "python"), "install", "--progress-bar", "off"]
    subprocess.run([*pip, *PACKAGES], check=True)


def probe(peer: Peer, python: str) -> str | None:
    """The version of the peer's code that ``python`` has, None if it has none."""
    try:
        command = [python, str(peer.script), "--probe"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=_PROBE_LIMIT)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def installed(pythons: Sequence[str] | None = None) -> list[Peer]:
    """The peers that run here, each with its interpreter and version.

    ``pythons`` are tried in turn: that of the environment (scikit-fem, NGSolve), then this one (GetFEM, which the image
    target ``peers`` has).
    """
    if pythons is None:
        pythons = [python for python in (str(PLACE / "bin" / "python"), sys.executable) if Path(python).exists()]
    found = []
    for peer in PEERS:
        versions = ((python, probe(peer, python)) for python in pythons)
        here = next((replace(peer, python=python, version=v) for python, v in versions if v is not None), None)
        found += [here] if here else []
    return found


def main() -> int:
    """List what is installed; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python3 -m archord.benchmarks.peers.installed", description=main.__doc__)
    parser.add_argument("--install", action="store_true", help="install what PyPI has into .cache/peers-venv before")
    if parser.parse_args().install:
        try:
            install()
        except subprocess.CalledProcessError as error:
            print(f"pip could not install {', '.join(PACKAGES)} (exit code {error.returncode}).", file=sys.stderr)
            return 2
    for peer in installed():
        print(f"{peer.label} {peer.version}: {peer.python} {peer.script}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

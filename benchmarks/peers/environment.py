"""Install the peers that PyPI has: ``docker/run python3 -m archord.benchmarks.peers.environment``.

They get a virtual environment of their own, ``.cache/peers-venv`` in the checkout, without the system's packages, so
that their numpy and archord's do not meet. About 1.5 GB, most of it MKL (PARDISO, scikit-fem's linear solver). Where
a proxy signs with its own authority: ``docker/run env PIP_CERT=.cache/ca.pem python3 -m
archord.benchmarks.peers.environment``.
"""

from __future__ import annotations

import subprocess
import sys
import venv
from pathlib import Path

PLACE = Path(__file__).resolve().parents[2] / ".cache" / "peers-venv"
PACKAGES = ("scikit-fem==12.0.2", "pypardiso==0.4.7", "gmsh==4.15.2", "ngsolve==6.2.2608")


def interpreter(place: Path = PLACE) -> Path:
    """The environment's Python, which need not exist."""
    return place / "bin" / "python"


def install(place: Path = PLACE) -> None:
    """Make the environment anew. Raises `subprocess.CalledProcessError` if pip fails."""
    venv.create(place, clear=True, with_pip=False)
    pip = [sys.executable, "-m", "pip", "--python", str(interpreter(place)), "install", "--progress-bar", "off"]
    subprocess.run([*pip, *PACKAGES], check=True)


def main() -> int:
    """Install; returns the exit code."""
    try:
        install()
    except subprocess.CalledProcessError as error:
        print(f"pip could not install {', '.join(PACKAGES)} (exit code {error.returncode}).", file=sys.stderr)
        return 2
    print(f"{', '.join(PACKAGES)} in {PLACE}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

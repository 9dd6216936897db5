"""``python -m archord``, and the ``archord`` command."""

from __future__ import annotations

import gc
import sys
from io import TextIOWrapper
from time import perf_counter


def main() -> None:
    """Run the command line. Exit codes: 0 done, 2 bad input, 3 a solve that could not go on, 1
    anything else."""
    begun = perf_counter()
    gc.set_threshold(
        200_000, 1, 1
    )  # imports make 100 thousand objects and no garbage: looking for it takes 0.04 s
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # as stderr: of signs a terminal lacks
    from archord.cli import run

    code = run(sys.argv[1:], begun)
    gc.freeze()  # before it ends, Python looks for garbage among all objects: 0.15 s
    sys.exit(code)


if __name__ == "__main__":
    main()

"""Seconds for force and stiffness of an exported law: ``python -m
tests.postprocess.laws.time_exports``."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from time import perf_counter

from tests.postprocess.laws.curves import yielding_curve
from tests.postprocess.laws.test_exports import inputs, load, write

CLIENT = """
#include <stdio.h>
#include <time.h>
#include "law.h"
static double in[20000];
int main(void) {
    double sum = 0.0, slope;
    size_t n = fread(in, sizeof(double), 20000, stdin) / 2;
    clock_t start = clock();
    for (int again = 0; again < 100; again++)
        for (size_t i = 0; i < n; i++) sum += law_force(in[2 * i], in[2 * i + 1], &slope) + slope;
    printf("%g %g", (double)(clock() - start) / CLOCKS_PER_SEC / 100 / n, sum);
}
"""


def main() -> None:
    """Print a line for each branch and language."""
    curve = yielding_curve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        law = load(write(curve, folder / "law.py"))
        write(curve, folder / "law.h")
        (folder / "main.c").write_text(CLIENT)
        subprocess.run(
            ["gcc", "-std=c99", "-O2", "main.c", "-o", "law", "-lm"], cwd=folder, check=True
        )
        pairs = inputs(curve)
        delta, deepest = pairs.T
        pairs = pairs[(delta > 0) & (delta < curve.limit) & (deepest < curve.limit)]
        back = pairs[:, 0] < pairs[:, 1]
        for branch, chosen in (("first loading", pairs[~back]), ("way back", pairs[back])):
            done = subprocess.run(
                [folder / "law"], input=chosen.tobytes(), capture_output=True, check=True
            )
            numbers = chosen.tolist()
            start = perf_counter()
            for x, most in numbers:
                law.force(x, most)
            python = (perf_counter() - start) / len(numbers)
            start = perf_counter()
            curve.at(*chosen.T)
            numpy = (perf_counter() - start) / len(numbers)
            c = float(done.stdout.split()[0])
            print(
                f"{branch}: C {1e6 * c:.2f}, Python {1e6 * python:.1f}, numpy (arrays) "
                f"{1e6 * numpy:.2f} microseconds"
            )


if __name__ == "__main__":
    main()

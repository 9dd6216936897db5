"""Seconds for force and stiffness of an exported law, and for its force element: ``python3 -m
tests.postprocess.laws.time_exports``."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

from tests.postprocess.laws.curves import yielding_curve
from tests.postprocess.laws.test_element import motions, positions, remembers, yielding
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
ELEMENT_CLIENT = """
#include <stdio.h>
#include <time.h>
#include "element.h"
static double in[25000];
int main(void) {
    double sum = 0.0, force[3], jacobian[15];
    element_element_state state;
    if (fread(state.deepest, sizeof(double), element_SECTORS, stdin) != element_SECTORS) return 1;
    size_t n = fread(in, sizeof(double), 25000, stdin) / 5;
    clock_t start = clock();
    for (int again = 0; again < 100; again++)
        for (size_t i = 0; i < n; i++) {
            element_element(&state, &element_CONTACT, in + 5 * i, force, jacobian);
            sum += force[0] + jacobian[7];
        }
    double call = (double)(clock() - start) / CLOCKS_PER_SEC / 100 / n;
    start = clock();
    for (size_t i = 0; i < n; i++) element_advance_element(&state, in[5 * i], in[5 * i + 1]);
    double step = (double)(clock() - start) / CLOCKS_PER_SEC / n;
    printf("%g %g %g", call, step, sum + state.deepest[7]);
}
"""


def main() -> None:
    """Print a line for each branch and language, and for the element's call and advance."""
    time_element()
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


def time_element() -> None:
    """Print what a call of the force element costs, in contact, and an accepted step."""
    curve = yielding()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        law = load(write(curve, folder / "element.py"))
        write(curve, folder / "element.h")
        (folder / "main.c").write_text(ELEMENT_CLIENT)
        subprocess.run(
            ["gcc", "-std=c99", "-O2", "main.c", "-o", "element", "-lm"], cwd=folder, check=True
        )
        memory = remembers(law, positions(curve, 12, 1.5))
        given = motions(curve, 7000, 1.5)
        given = given[np.hypot(given[:, 0], given[:, 1]) > curve.length][:5000]
        data = np.concatenate([memory, given.ravel()])
        done = subprocess.run(
            [folder / "element"], input=data.tobytes(), capture_output=True, check=True
        )
        call, advance, _ = (1e6 * float(word) for word in done.stdout.split())
        numbers = [(m[:2], m[2:4], m[4]) for m in given.tolist()]
        start = perf_counter()
        for motion in numbers:
            law.element(memory, *motion)
        python = 1e6 * (perf_counter() - start) / len(numbers)
    print(
        f"force element with Jacobian: C {call:.2f}, Python {python:.1f} microseconds; an accepted "
        f"step: C {advance:.2f} microseconds"
    )


if __name__ == "__main__":
    main()

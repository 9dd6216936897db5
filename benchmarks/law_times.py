"""How long the law of a joint takes: the first one in a process, and others.

    python3 -m archord.benchmarks.law_times

Times are of the processor, in milliseconds. Processes run in turn. The joints are those that the
representative strain is fitted to (`archord.studies.hardening_design`): as they are, perfectly
plastic, and elastic.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
from collections import defaultdict
from dataclasses import replace
from time import process_time

from archord.postprocess.laws.general.general_law import law_of_joint
from archord.postprocess.laws.general.hardening_model import kind, strains
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.yield_model import elastic_pressure
from archord.report.table import Table
from archord.scene.sections.plasticity import hardening_law
from archord.studies.hardening_design import drawn
from archord.studies.law_design import Drawn

PROCESSES = 15
REPEATS = 5
BODIES = ("elastic", "perfectly plastic", "hardening")
_SHARE = 1 / 3  # of the joints of the fit
_SEED = 3600
# What a process does that asks for one law, and then prints its times.
_FIRST = """
from time import process_time
begun = process_time()
import archord
from archord.materials.hardening import LinearHardening
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
imported = process_time()
general_law(LawJoint(10.0, 0.05, 115e3, plane={plane!r}, nu=0.3{bodies})).at(0.05)
print(imported - begun, process_time() - imported)
"""
_YIELDS = ", pin_yield=355.0, block_yield=300.0"
_CURVES = ", pin_hardening=LinearHardening(355.0, 1e3), block_hardening=LinearHardening(300.0, 1e3)"
_OF_FIRST = dict(zip(BODIES, ("", _YIELDS, _YIELDS + _CURVES), strict=True))


def law_joint(joint: Drawn) -> LawJoint:
    """What the laws know of a ``joint`` that hardens, with R = E* = 1."""
    numbers = joint.numbers
    clearance = numbers.clearance
    pin_nu, nu = numbers.poisson
    given = {"plane": numbers.plane, "pin_share": numbers.p}
    for body, s in numbers.yielding._asdict().items():
        if f"{body}.hardening" in joint.own:
            law = hardening_law(s * clearance, joint.own[f"{body}.hardening"], 1.0)
            given |= {f"{body}_yield": s * clearance, f"{body}_hardening": law}
    return LawJoint(1.0, clearance, 1.0, nu=nu, pin_nu=pin_nu, **given)


def forms(joint: LawJoint) -> list[LawJoint]:
    """A ``joint`` that hardens as each of `BODIES`."""
    perfect = replace(joint, pin_hardening=None, block_hardening=None)
    return [joint.elastic, perfect, joint]


def milliseconds(joint: LawJoint) -> float:
    """The median time of its law."""
    times = []
    for _ in range(REPEATS):
        strains.cache_clear()
        elastic_pressure.cache_clear()
        begun = process_time()
        law_of_joint.__wrapped__(joint)
        times.append(1e3 * (process_time() - begun))
    return statistics.median(times)


def later_laws() -> Table:
    """Times of laws in a process that has computed each of them before, median/largest."""
    by_kind = defaultdict(list)
    for drawing in drawn(_SHARE, _SEED):
        laws = forms(law_joint(drawing))
        try:
            for joint in laws:
                law_of_joint(joint)
        except ValueError:  # hardens more than the law covers
            continue
        by_kind[kind(drawing.numbers)].append([milliseconds(joint) for joint in laws])
    table = Table("ms", "joints", *BODIES, left=1)
    for name, rows in sorted(by_kind.items()):
        columns = zip(*rows, strict=True)
        cells = [f"{statistics.median(own):.1f}/{max(own):.1f}" for own in columns]
        table.add(name, len(rows), *cells)
    return table


def first_laws() -> Table:
    """Times of the first law of a process, and of the imports before it, medians."""
    cases = [(plane, body) for plane in ("strain", "stress") for body in BODIES]
    times = defaultdict(list)
    for _ in range(PROCESSES):
        for plane, body in cases:
            program = _FIRST.format(plane=plane, bodies=_OF_FIRST[body])
            command = [sys.executable, "-c", program]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            times[plane, body].append([1e3 * float(word) for word in done.stdout.split()])
    table = Table("ms", "imports {:.0f}", "first law {:.0f}", left=1)
    for case in cases:
        columns = zip(*times[case], strict=True)
        table.add(" ".join(case), *map(statistics.median, columns))
    return table


def main() -> None:
    """Print both tables."""
    print(first_laws().markdown(), later_laws().markdown(), sep="\n\n")


if __name__ == "__main__":
    main()

"""The points of the work-precision benchmark: archord, CalculiX and peers on series of meshes, as
timed processes.

What is solved is in work_precision.toml, what errors are measured against also in references.json,
which references.py makes. The result of a process is a dict of what the code found
at the last step: "P" (over E* R, of a lug in N/mm), "p0" (over E*), "eps" [rad], "dissipation"
(over E* R^2), "profile" (pressure over E* at `ANGLES`), "dofs", "iterations", "factorisations", and
"kinematics" where the pairs are fixed; without what it does not tell.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from archord.benchmarks.case import matches, paper_joint, slug
from archord.benchmarks.peers import calculix
from archord.benchmarks.peers.installed import Peer, installed
from archord.benchmarks.timing import Failure, Process, solving
from archord.geometry.basis import Array
from archord.postprocess.run import Run
from archord.presets.arc import ArcProfile
from archord.report.by_name import ByName, Words
from archord.report.errors import InputError
from archord.report.files import read_json, toml_beside
from archord.report.version import VERSION
from archord.scene.file import AnyScene, parse_any, resolved
from archord.scene.sections.bodies import Pin

DATA = toml_beside(__file__, "work_precision.toml")
REFERENCES = Path(__file__).with_name("references.json")
_KNOWN: dict[str, ByName] = read_json(REFERENCES)
CASES = {case: given | _KNOWN.get(case, {}) for case, given in DATA["cases"].items()}
OURS = "archord"
CALCULIX = "CalculiX"
ANGLES = np.linspace(0.0, np.pi / 2, 401)  # of pressure profiles, from the contact axis
# of history.csv, of the joint
_COLUMNS = {
    "P": "P/(E* R)",
    "p0": "p0/E*",
    "eps": "eps",
    "dissipation": "plastic_dissipation/(E* R2)",
}


@dataclass(frozen=True)
class Point:
    """``code`` on the mesh of element size ``size`` (over R) of a ``series`` of ``case``, in
    ``steps`` steps; ``prepare`` writes what it needs into a folder, and returns the process that
    solves there."""

    case: str
    code: str
    version: str
    series: str
    size: float
    steps: int
    prepare: Callable[[Path], Process]

    @property
    def name(self) -> str:
        """The case, the code, its series and the mesh."""
        return f"{self.case}: {self.code}, {self.series}, {self.size:g} R"

    def process(self, folder: Path, limit: float) -> Process:
        """The process, for ``limit`` seconds at most, in a folder of its own below ``folder``,
        which is made."""
        place = (folder / slug(self.name)).resolve()
        place.mkdir(parents=True, exist_ok=True)
        process = self.prepare(place)
        kind = (self.case, self.code, self.series)
        return replace(process, name=self.name, limit=min(process.limit, limit), kind=kind)


def points(patterns: Sequence[str] = ()) -> list[Point]:
    """All points, or those whose name fits one of ``patterns``; CalculiX's and peers' where they
    are installed. Raises `InputError` for a pattern that fits none."""
    versions = {OURS: VERSION} | _calculix_version()
    peers = installed()
    found: list[Point] = []
    for case in CASES:
        for series in DATA["series"]:
            if series["code"] in versions and case in series.get("cases", CASES):
                found += _of_series(case, series, versions[series["code"]])
        for peer in peers:
            found += _of_peer(case, peer)
    for pattern in patterns:
        if not any(matches(pattern, point.name) for point in found):
            known = dict.fromkeys(f"{point.case}: {point.code}, {point.series}" for point in found)
            raise InputError(
                f"--only {pattern}: no point has such a name; there are {', '.join(known)}."
            )
    return [
        point
        for point in found
        if not patterns or any(matches(pattern, point.name) for pattern in patterns)
    ]


def _of_series(case: str, series: ByName, version: str) -> Iterator[Point]:
    """The points of a series of archord or CalculiX, from coarse to fine."""
    given = CASES[case]
    code = series["code"]
    steps = series.get("steps", given["steps"])
    prepare = _calculix if code == CALCULIX else _archord
    for size, growth in zip(series["element_size"], series["growth"], strict=True):
        mesh = {"element_size": size, "growth": growth}
        analysis = {"degree": series.get("degree", 2)}
        scene: AnyScene
        if "scene" in given:
            lug = given["scene"]["lug"]
            mesh["element_size"] *= lug["radius"]
            scene = parse_any(given["scene"] | {"lug": lug | mesh, "analysis": analysis})
        else:
            if series.get("edge"):
                mesh["edge_angle"] = given["edge_angle"]
            yields = given.get("yield_stress")
            scene = paper_joint(size, steps, yields, joint=mesh, analysis=analysis)
        start = partial(prepare, scene)
        yield Point(case, code, version, series["name"], size, steps, start)


def _of_peer(case: str, peer: Peer) -> Iterator[Point]:
    """The points of a ``peer``, from coarse to fine."""
    steps = CASES[case]["steps"]
    for size, order in peer.series.get(case, ()):
        start = partial(_peer, peer, case, size, order, steps)
        yield Point(case, peer.label, peer.version, f"order {order}", size, steps, start)


def profile(angle: Array, pressure: Array) -> Array:
    """Pressure ``(401,)`` at `ANGLES` of one known at the angles ``(n,)``: linear, constant beyond
    the ends."""
    order = np.argsort(angle)
    return np.interp(ANGLES, angle[order], pressure[order])


def profile_error(pressure: Array, reference: Array) -> float:
    """Relative L2 difference over the arc, ``sqrt(int (p - p_ref)^2 / int p_ref^2)``; both
    ``(401,)`` at `ANGLES`."""
    difference = np.trapezoid((pressure - reference) ** 2, ANGLES)
    return float(np.sqrt(difference / np.trapezoid(reference**2, ANGLES)))


def quantities_of(run: Run) -> ByName:
    """What a ``run`` of the paper's joint found at its last step."""
    found = {name: run.columns[column][-1] for name, column in _COLUMNS.items()}
    # the unbiased contact integrates one half of the pressure on either side
    sides = [_profile_of(arc, run.scene.plastic) for arc in run.contact().values()]
    return found | {"profile": np.mean(sides, axis=0), "dofs": run.summary["mesh"]["dofs"]}


def _profile_of(arc: ArcProfile, yields: bool) -> Array:
    """The profile of one side. Where it ``yields``, pressures at points scatter near the end of the
    contact, and facet means do not."""
    if yields:
        return profile(*arc.facet_means())
    return profile(arc.angle.ravel(), arc.pressure.ravel())


def _pin_of(scene: AnyScene) -> Pin | None:
    """The pin of the paper's joint, None of a general scene."""
    return getattr(scene, "pin", None)


def _archord(scene: AnyScene, folder: Path) -> Process:
    (folder / "input.toml").write_text(resolved(scene), encoding="utf-8")

    def read() -> ByName:
        run = Run(folder / "run")
        if _pin_of(scene) is None:
            found = {"P": run.columns["pull force"][-1]}
        else:
            found = quantities_of(run)
        return found | {
            "dofs": run.summary["mesh"]["dofs"],
            "iterations": round(sum(run.columns["iterations"])),
            "factorisations": run.summary["totals"]["factorisations"],
        }

    command = solving("input.toml", "run")
    return Process(OURS, command, folder, read)


def _calculix(scene: AnyScene, folder: Path) -> Process:
    process = calculix.process(scene, folder)

    def read() -> ByName:
        opinion = process.read()
        # neither contact angle nor profile: pressures at the nodes near the edge scatter too much
        found = {
            "P": opinion.P,
            "p0": opinion.p0,
            "dofs": 2 * len(opinion.mesh.x),
            "iterations": opinion.iterations,
        }
        pin = _pin_of(scene)
        if pin is not None and pin.yield_stress:
            # perfect plasticity: every point that flows dissipates the yield stress times its PEEQ
            found["dissipation"] = pin.yield_stress * opinion.peeq_integral
        return {
            name: value
            for name, value in found.items()
            if value is not None and math.isfinite(value)
        }

    return replace(process, read=read)


def _calculix_version() -> Words:
    """CalculiX and its version, if it is installed."""
    if shutil.which("ccx") is None:
        return {}
    found = re.search(
        r"Version (\S+)", subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout
    )
    return {CALCULIX: found[1] if found else ""}


def _peer(peer: Peer, case: str, size: float, order: int, steps: int, folder: Path) -> Process:
    output = folder / "result.json"

    def read() -> ByName:
        found = read_json(output)
        if found["failed"]:
            raise Failure(found["failed"])
        return {name: value for name, value in found.items() if value is not None}

    command = tuple(peer.command(case, size, order, steps, output))
    return Process(peer.label, command, folder, read, limit=peer.time_limit, clear=(output.name,))

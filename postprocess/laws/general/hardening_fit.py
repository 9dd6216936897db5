"""The representative strain from solved joints that harden, by least squares of ln P.

    python3 -m archord.studies.hardening_design > hardening.sweep.toml
    mpirun -n 2 archord sweep hardening.sweep.toml
    python3 -m archord.postprocess.laws.general.hardening_fit runs/hardening

Every fifth joint is predicted by the other joints: these errors make the expected error, and are
printed.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archord.materials.material import Array, Arrays
from archord.postprocess.laws.general.elastic_model import elastic_model
from archord.postprocess.laws.general.general_law import elastic_error, joint_numbers
from archord.postprocess.laws.general.hardening_model import (
    BODIES,
    TABLE,
    TERMS,
    At,
    Flow,
    Flows,
    Strains,
    begins_of,
    curve_at,
    felt,
    flows,
    kind,
    mean_flows,
    peak_rise,
    representative,
    rises_of,
    terms,
    unsure,
)
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.law_fit import (
    FITTED,
    JUDGED,
    NodeRun,
    by_joint,
    first_loading,
    rms_largest,
    within,
)
from archord.postprocess.laws.general.yield_model import (
    Loss,
    Numbers,
    first_yield,
    loss,
    mesh_excess,
    sides_of,
)
from archord.report.by_name import Amounts
from archord.report.files import read_json
from archord.report.table import Table, in_digits

Model = Mapping[str, Array]  # the coefficients of `TERMS` by plane and body
_WITHIN = 0.93  # share of errors that expected errors are to contain
_GUESS = np.array([-2.5, 2.0, -1.0, *np.zeros(len(TERMS) - 3)])
# how far from it coefficients are likely
_FREE = np.array([2.0, 1.0, 1.0, *np.full(8, 0.7), *np.ones(len(TERMS) - 11)])
_SCATTER = 0.01  # of ln P of a joint, against which that counts
_PARTS = 5  # of the joints, each of which the other parts predict
_ITERATIONS = 8
_AGAIN = 2  # of a fit that begins with another one
_SMALL = 1e-2  # of a difference quotient
_STEEPEST = 0.7  # slope of ln(eps_rep) by itself through s_eff
_LITTLE = 1e-3  # change of P below which yielding does not matter


@dataclass(frozen=True)
class Hardened:
    """A joint that was solved: its ``numbers``, how its bodies harden, and ``ln(P/P_el)`` and
    ``ln(p0/p0_el)``, each ``(k,)``, at ``x`` ``(k,)``."""

    numbers: Numbers
    given: Flows
    x: Array
    force: Array
    peak: Array

    @classmethod
    def of(cls, joint: LawJoint, runs: list[NodeRun]) -> Hardened:
        """The joint that was solved in ``runs``."""
        numbers = joint_numbers(joint)
        nodes = first_loading(runs)
        x, y, peak, _ = nodes[within(nodes[:, 0], FITTED)].T
        elastic = elastic_model()
        side, *_ = sides_of(numbers)
        yielding = numbers.yielding
        begins = first_yield(elastic, numbers.strain, numbers.elastic, yielding.of(side))
        without = elastic.at(numbers.elastic, x)
        excess = mesh_excess(side, yielding, x / begins)
        force = np.log(y / without.y) - excess
        pressure = np.log(peak / without.peak) - excess
        return cls(numbers, flows(joint), x, force, pressure)

    def state(self, model: Model) -> tuple[Strains, Loss]:
        """What the law says at x."""
        found = representative(model, self.numbers, self.given, self.x)
        return found, self.lost(found.s, rises_of(self.given, found))

    def lost(self, s: Array, rises: Array) -> Loss:
        """What yielding by ``s`` does where the curves have these ``rises``, each ``(2, k)``."""
        return loss(self.numbers, felt(self.numbers, s, rises), self.x)

    def off(self, model: Model) -> Array:
        """The errors of ln P."""
        _, lost = self.state(model)
        return lost.force - self.force

    def derivatives(self, model: Model, found: Strains, lost: Loss) -> Array:
        """d(ln P)/d(coefficients) ``(k, 2 terms)`` of pin and block, as if the s of the other body
        were constant."""
        columns = np.zeros((2, len(TERMS), len(self.x)))
        means = mean_flows(self.given)
        begins = begins_of(self.numbers)
        rises = rises_of(self.given, found)
        for i, mean in means.items():
            if np.isinf(self.numbers.yielding[i]):
                continue
            body = BODIES[i]
            higher = found.s.copy()
            higher[i] *= 1 + _SMALL
            of_higher = self.lost(higher, rises)
            of_s = (of_higher.force - lost.force) / _SMALL
            strain = found.strain[i]
            at = At(self.x, curve_at(mean, strain), found.s[1 - i], begins)
            slope = slope_at(mean, strain, found.s[i])
            back = slope * feedback(model[f"{self.numbers.plane} {body}"], self.numbers, body, at)
            part = of_s * slope / (1 - np.minimum(back, _STEEPEST))
            columns[i] = part * terms(self.numbers, body, at)
        return columns.reshape(-1, len(self.x)).T


def slope_at(mean: Flow, strain: Array, s: Array) -> Array:
    """d(ln s)/d(ln strain) of a `mean_flow`, which is ``s`` at ``strain`` (all ``(k,)``)."""
    higher = mean((1 + _SMALL) * strain)
    return np.log(higher / s) / np.log1p(_SMALL)


def feedback(of: Array, numbers: Numbers, body: str, at: At) -> Array:
    """d(ln eps_rep)/d(ln s) ``(k,)`` with the coefficients ``of`` all `TERMS`; see `terms`."""
    stronger = at.own._replace(s=at.own.s * (1 + _SMALL))
    higher = at._replace(own=stronger)
    change = terms(numbers, body, higher) - terms(numbers, body, at)
    return of @ change / np.log1p(_SMALL)


def fit_strain(joints: list[Hardened], start: Model | None = None) -> Arrays:
    """The coefficients by plane and body, by Gauss and Newton's method, from the ``start`` of a fit
    to nearly the same joints: each joint counts like five points."""
    model = dict(start or {})
    for plane in sorted({joint.numbers.plane for joint in joints}):
        own = [joint for joint in joints if joint.numbers.plane == plane]
        names = [f"{plane} {body}" for body in BODIES]
        values = np.concatenate([model.get(name, _GUESS) for name in names])
        free = np.tile(_FREE, 2)
        guess = np.tile(_GUESS, 2)
        for _ in range(_AGAIN if start else _ITERATIONS):
            model |= dict(zip(names, np.split(values, 2), strict=True))
            rows = [np.diag(1 / free)]
            misses = [(values - guess) / free]
            for joint in own:
                found, lost = joint.state(model)
                weight = 1 / (_SCATTER * np.sqrt(len(joint.x) / 5))
                rows.append(weight * joint.derivatives(model, found, lost))
                misses.append(weight * (lost.force - joint.force))
            step, *_ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(misses))
            values = values - np.clip(step, -1.0, 1.0)
        model |= dict(zip(names, np.split(values, 2), strict=True))
    return model


def fit_peak(joints: list[Hardened], model: Model) -> Amounts:
    """The factor on `peak_rise` by plane, by least squares of ln p0."""
    factors = {}
    for plane in sorted({joint.numbers.plane for joint in joints}):
        rises = []
        misses = []
        for joint in joints:
            if joint.numbers.plane == plane:
                found, lost = joint.state(model)
                rises.append(peak_rise(found, rises_of(joint.given, found), lost))
                misses.append(joint.peak - lost.peak)
        rise = np.concatenate(rises)
        miss = np.concatenate(misses)
        factor = rise @ miss / (rise @ rise)
        factors[plane] = in_digits(factor, 4)
    return factors


def predicted(joints: list[Hardened], model: Model) -> list[Model]:
    """For each joint the coefficients that the other parts of the joints give; ``model`` is of all
    joints."""
    part_of = np.arange(len(joints)) % _PARTS
    parts = []
    for part in range(_PARTS):
        others = [joints[i] for i in np.flatnonzero(part_of != part)]
        parts.append(fit_strain(others, model))
    return [parts[part] for part in part_of]


def errors_of(joints: list[Hardened], models: list[Model]) -> tuple[Amounts, Table]:
    """The factors of the expected error by kind; and rms and largest errors of P from 0.1 to 2 dR,
    in per cent, of joints that the others predict, with the share within the expected error."""
    by_kind: dict[str, list[Array]] = {}
    for joint, model in zip(joints, models, strict=True):
        found, lost = joint.state(model)
        usual = within(joint.x, JUDGED)
        told = [
            lost.force - joint.force,
            np.hypot(lost.deviation, elastic_error(joint.numbers.elastic)),
            unsure(rises_of(joint.given, found), lost),
        ]
        by_kind.setdefault(kind(joint.numbers), []).append(np.array(told)[:, usual])
    factors = {}
    table = Table("yields", "joints", "P 0.1 to 2 dR", "inside", left=1)
    for name, parts in sorted(by_kind.items()):
        off, deviation, rise = np.concatenate(parts, axis=1)
        left = np.sqrt(np.maximum(off**2 - deviation**2, 0.0)) / np.maximum(rise, _LITTLE)
        factor = np.quantile(left, _WITHIN)
        factors[name] = in_digits(factor, 3)
        inside = np.abs(off) <= np.hypot(deviation, factors[name] * rise)
        table.add(name, len(parts), rms_largest(100 * off), f"{inside.mean():.0%}")
    return factors, table


def main(folder: Path) -> None:
    """Fit to the sweep in ``folder``, write the table beside this file, and print how good it is. A
    plane without joints keeps its coefficients."""
    solved = {joint: runs for joint, runs in by_joint(folder).items() if joint.hardens}
    joints = [Hardened.of(joint, runs) for joint, runs in solved.items()]
    model = fit_strain(joints)
    factors, table = errors_of(joints, predicted(joints, model))
    found = {name: [in_digits(value, 5) for value in values] for name, values in model.items()}
    stored = read_json(TABLE)
    new = {
        "strain": stored["strain"] | found,
        "peak": stored["peak"] | fit_peak(joints, model),
        "error": stored["error"] | factors,
    }
    TABLE.write_text(json.dumps(new, indent=1) + "\n", encoding="utf-8")
    print(table.markdown())


if __name__ == "__main__":
    main(Path(sys.argv[1]))

"""A slider-crank with clearance in its small end, in Exudyn: the law of the joint as its contact
force, with impacts.

    pip install exudyn
    python3 examples/slider_crank.py docs/slider_crank.png

A crank of constant speed drives a slider in a plane by a rod. The slider's pin has clearance in the
rod's hole: ``e`` goes from the hole's centre to the pin's, ``delta = |e| - dR``, and the pin is
pressed back along e by ``P(delta, deepest) (1 + c d(delta)/dt)``, the law of the joint and what an
oil film damps (Hunt and Crossley 1975). ``deepest``, the memory of a joint that yields, belongs to
a place, and the contact wanders. Here one number serves for the whole hole, as if it were flattened
all round: no spot yields twice, and the energy lost is a lower bound. (With a number for each
impact every one would meet a fresh hole: an upper bound, in which no joint settles.) It advances
with accepted steps, never within Newton's iterations. Units: mm, N, s, so tonnes and N mm.
"""

import sys
from dataclasses import replace
from math import hypot, pi
from pathlib import Path
from time import perf_counter

import exudyn
import numpy as np
from exudyn import itemInterface as item
from matplotlib.patches import Circle
from scipy.integrate import cumulative_trapezoid

import archord
from archord.postprocess.laws.exports.export import export_law
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.laws import LAWS
from archord.report.figure import new_figure, save
from archord.report.files import replacing
from archord.report.table import Table

FOLDER = Path(__file__).with_suffix("")
JOINT = LawJoint.from_scene(archord.load_scene(FOLDER / "joint.toml"))
DR = JOINT.clearance
WIDTH = JOINT.length
CRANK = 100.0
ROD = 250.0
SPEED = 600 * 2 * pi / 60
TURNS = 2
ROD_MASS = 2e-3
SLIDER_MASS = 15e-3
ROD_INERTIA = ROD_MASS * ROD**2 / 12
FILM = 0.002  # c [s/mm]: what comes at 100 mm/s goes back at 88
STEPS = 40000  # a turn: 2.5 microseconds, 1/200 of an impact
# P in the outer dead centre, where all begins
START = SLIDER_MASS * CRANK * SPEED**2 * (1 + CRANK / ROD) / WIDTH


def mechanism(force, start):
    """The mechanism in its outer dead centre, its pin ``start`` off the hole's centre; its joint
    and its drive."""
    mbs = exudyn.SystemContainer().AddSystem()

    def body(mass, inertia, x, *velocity):
        node = mbs.AddNode(
            item.NodeRigidBody2D(referenceCoordinates=[x, 0, 0], initialVelocities=[0, *velocity])
        )
        return node, mbs.AddObject(
            item.ObjectRigidBody2D(nodeNumber=node, mass=mass, inertia=inertia)
        )

    def at(body, x):
        return mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0]))

    def coordinate(node, i):
        return mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=i))

    def join(kind, *markers, **properties):
        return mbs.AddObject(kind(markerNumbers=list(markers), **properties))

    fixed = coordinate(mbs.AddNode(item.NodePointGround()), 0)
    ground = mbs.AddObject(item.ObjectGround())
    shaft, crank = body(1.0, 1.0, 0, 0, SPEED)
    _, rod = body(ROD_MASS, ROD_INERTIA, CRANK + ROD / 2, CRANK * SPEED / 2, -CRANK * SPEED / ROD)
    guide = mbs.AddNode(
        item.NodePoint2D(referenceCoordinates=[CRANK + ROD, 0], initialCoordinates=[start, 0])
    )
    slider = mbs.AddObject(item.ObjectMassPoint2D(nodeNumber=guide, mass=SLIDER_MASS))
    join(item.ObjectJointRevolute2D, at(ground, 0), at(crank, 0))
    join(item.ObjectJointRevolute2D, at(crank, CRANK), at(rod, -ROD / 2))
    join(item.ObjectConnectorCoordinate, fixed, coordinate(guide, 1))
    drive = join(
        item.ObjectConnectorCoordinate,
        fixed,
        coordinate(shaft, 2),
        velocityLevel=True,
        offset=SPEED,
    )
    spring = item.ObjectConnectorCartesianSpringDamper
    return mbs, join(spring, at(rod, ROD / 2), at(slider, 0), springForceUserFunction=force), drive


def simulate(law, start, steps=STEPS, turns=TURNS):
    """Turn the crank with ``law(delta, deepest)`` [N/mm] in the joint, first at ``start``. Returns
    a column a step (time, e, its rate, deepest, torque, velocities), the seconds it took, those in
    the law, and its calls."""
    deepest = start
    columns = []
    calls = 0
    seconds = 0.0
    kinds = exudyn.OutputVariableType

    def force(mbs, t, number, e, rate, *unused):
        nonlocal calls, seconds
        distance = hypot(e[0], e[1])
        if distance <= DR:
            return [0, 0, 0]
        begin = perf_counter()
        P, _ = law(distance - DR, deepest)
        seconds += perf_counter() - begin
        calls += 1
        opening = (e[0] * rate[0] + e[1] * rate[1]) / distance
        F = P * WIDTH * (1 + FILM * opening) / distance
        return [F * e[0], F * e[1], 0]

    def accept(mbs, t):
        nonlocal deepest
        e = mbs.GetObjectOutput(joint, kinds.Displacement)[:2]
        rate = mbs.GetObjectOutput(joint, kinds.Velocity)[:2]
        torque = -mbs.GetObjectOutput(drive, kinds.Force)
        columns.append((t, *e, *rate, deepest, torque, *mbs.systemData.GetODE2Coordinates_t()))
        deepest = max(deepest, hypot(*e) - DR)
        return True

    mbs, joint, drive = mechanism(force, DR + start)
    mbs.SetPostStepUserFunction(accept)
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime = turns * 2 * pi / SPEED
    settings.timeIntegration.numberOfSteps = turns * steps
    begin = perf_counter()
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.TrapezoidalIndex2)
    return np.array(columns).T, perf_counter() - begin, seconds, calls


def energies(columns, curve):
    """The force P [N] at all steps, and energies [N mm] by name, whose sum stays. What the joint
    has stored is what it gives back until it opens."""
    (t,), e, rate, (deepest,), (torque,), v = np.split(columns, [1, 3, 5, 6, 7])
    distance = np.hypot(*e)
    delta = np.maximum(distance - DR, 0)
    P = curve.at(delta, deepest).load * WIDTH
    most, where = np.unique(np.maximum(deepest, delta), return_inverse=True)
    opens = curve.residual(most)[where]
    half = np.maximum(delta - opens, 0) / 2
    points, weights = np.polynomial.legendre.leggauss(12)
    loads = curve.at(opens + half * (points[:, None] + 1), most[where]).load
    stored = WIDTH * half * (weights @ loads)
    lost = stored[0] - stored + cumulative_trapezoid(P, delta, initial=0)
    film = cumulative_trapezoid(P * FILM * (e * rate).sum(0) / distance, delta, initial=0)
    rod = [ROD_MASS, ROD_MASS, ROD_INERTIA]
    masses = np.array([0, 0, 0, *rod, SLIDER_MASS, SLIDER_MASS])
    return P, {
        "stored": stored,
        "lost, law": lost,
        "lost, film": film,
        "kinetic": masses @ v**2 / 2,
        "drive": -cumulative_trapezoid(torque * SPEED, t, initial=0),
    }


def table(law):
    """A closed-form law as a table up to 2 dR or the end of its formula; it comes back the way it
    went, and knows no other."""
    x = np.concatenate([[0], np.geomspace(1e-3, 2, 80)])
    state = law.at_displacement(JOINT, x * DR, extrapolate=True)
    known = np.isfinite(state.load)
    y = state.load[known] / JOINT.unit
    dy = state.stiffness[known] * DR / JOINT.unit
    none = np.zeros_like(y)
    unknown = np.full_like(y, np.nan)
    return JointCurve(
        x=x[known],
        y=y,
        dy=dy,
        back=y,
        dback=dy,
        ratio=np.ones_like(y),
        dratio=none,
        toe=none,
        touch=np.empty(0),
        peak=unknown,
        dpeak=unknown,
        angle=unknown,
        dangle=unknown,
        error=none,
        back_error=none,
        length=DR,
        force=JOINT.unit,
    )


def study(curve, steps=STEPS, turns=TURNS):
    """The crank turned with a law, exported: columns of `simulate`, force, energies, and numbers by
    name."""
    module = {"__name__": "joint"}
    exec(export_law(curve, Path("joint.py")), module)  # `archord law --export` writes it
    start = float(curve.displacement(START))
    columns, whole, inside, calls = simulate(module["force"], start, steps, turns)
    P, parts = energies(columns, curve)
    angle = columns[0] * SPEED
    return columns, P, parts, {
        "first impacts [kN]": f"{P[(angle > pi / 3) & (angle < pi)].max() / 1e3:.3f}",
        "largest force [kN]": f"{P.max() / 1e3:.3f}",
        "deepest/dR": f"{columns[5, -1] / DR:.3f}",
        "lost by the law [N mm]": f"{parts['lost, law'][-1]:.1f}",
        "in the film [N mm]": f"{parts['lost, film'][-1]:.0f}",
        "balance": f"{np.ptp(sum(parts.values())) / parts['stored'].max():.2%}",
        "a call [us]": f"{1e6 * inside / calls:.1f}",
        "of the time": f"{inside / whole:.0%}",
    }  # fmt: skip


def draw(runs, target):
    """First impacts, the orbit of the pin, and where the energy of the last run is."""
    figure = new_figure(14, 4.5)
    impacts, orbit, energy = figure.subplots(1, 3)
    for name, (columns, P, *_) in runs.items():
        angle = np.degrees(columns[0] * SPEED)
        first = (angle > 70) & (angle < 90)
        second = angle > 360
        impacts.plot(angle[first], P[first] / 1e3, lw=1, label=name)
        if name in ("elastic", "yielding"):
            orbit.plot(*columns[1:3, second] / DR, lw=0.7, label=name)
    parts = runs[name][2]
    total = sum(parts.values())
    for name, values in (
        *list(parts.items())[:3],
        ("balance, times 100", 100 * (total - total[0])),
    ):
        energy.plot(angle, values, lw=0.7, label=name)
    orbit.add_patch(Circle((0, 0), 1, fill=False, ls=":"))
    impacts.set(
        xlabel="crank angle [degrees]", ylabel="force of the joint [kN]", title="first impacts"
    )
    orbit.set(xlabel="$e_x$/dR", ylabel="$e_y$/dR", title="the pin in its hole", aspect="equal")
    energy.set(
        xlabel="crank angle [degrees]", ylabel="N mm", title="energies of the yielding joint"
    )
    for axes, place in ((impacts, "upper left"), (orbit, "center"), (energy, "upper left")):
        axes.legend(fontsize=8, loc=place)
    with replacing(target) as new:
        save(figure, new)


def laws():
    """The laws by name: laws of the literature, and archord's own of the joint without a yield
    stress and with it."""
    curves = {
        name: table(LAWS[name])
        for name in ("paper", "paper-plastic", "lankarani-nikravesh", "johnson")
    }
    return curves | {
        "elastic": general_law(replace(JOINT, block_yield=None)),
        "yielding": general_law(JOINT),
    }


if __name__ == "__main__":
    runs = {name: study(curve) for name, curve in laws().items()}
    fine = {"yielding, twice the step": study(laws()["yielding"], STEPS // 2)}
    print(Table.of([{"law": name, **run[-1]} for name, run in (runs | fine).items()]).markdown())
    draw(runs, Path(sys.argv[1]))

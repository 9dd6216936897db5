"""A slider-crank with clearance in its small end, in Exudyn: an exported law as the force element
of the joint, with impacts, friction and a contact that wanders.

    pip install exudyn
    python3 examples/slider_crank.py docs/slider_crank.png

A crank of constant speed drives a slider in a plane by a rod. The slider's pin has clearance in the
rod's hole. The element takes the eccentricity of the pin in axes of the rod, its rate and the
relative angular velocity, and gives force and torque on the pin. It remembers by direction how deep
the hole has been. This memory advances with accepted steps, never within Newton's iterations. The
damping is an oil film's. Units: mm, N, s, so tonnes and N mm.
"""

import sys
from dataclasses import replace
from math import pi
from pathlib import Path
from types import ModuleType

import exudyn
import numpy as np
from exudyn import itemInterface as item
from matplotlib.patches import Circle
from scipy.integrate import cumulative_trapezoid

import archord
from archord.postprocess.laws.exports.contact import Contact
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
# damping c [s/mm]: what comes at 100 mm/s goes back at 88; friction, rising to 2 mm/s of slip
CONTACT = Contact(damping=0.002, mu_static=0.12, mu_dynamic=0.1, stick_speed=2.0)
STEPS = 40000  # a turn: 2.5 microseconds, 1/200 of an impact
# P in the outer dead centre, where all begins
START = SLIDER_MASS * CRANK * SPEED**2 * (1 + CRANK / ROD) / WIDTH


def mechanism(force, start):
    """The mechanism in its outer dead centre, its pin ``start`` off the hole's centre; its joint
    and its drive."""
    mbs = exudyn.SystemContainer().AddSystem()

    def body(mass, inertia, x, *velocity, moved=0.0):
        node = mbs.AddNode(
            item.NodeRigidBody2D(
                referenceCoordinates=[x, 0, 0],
                initialCoordinates=[moved, 0, 0],
                initialVelocities=[0, *velocity],
            )
        )
        return node, mbs.AddObject(
            item.ObjectRigidBody2D(nodeNumber=node, mass=mass, inertia=inertia)
        )

    def at(body, x):
        return mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localPosition=[x, 0, 0]))

    def coordinate(node, i):
        return mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=i))

    def join(kind, *markers, **properties):
        return mbs.AddObject(kind(markerNumbers=list(markers), **properties))

    fixed = coordinate(mbs.AddNode(item.NodePointGround()), 0)
    ground = mbs.AddObject(item.ObjectGround())
    shaft, crank = body(1.0, 1.0, 0, 0, SPEED)
    _, rod = body(ROD_MASS, ROD_INERTIA, CRANK + ROD / 2, CRANK * SPEED / 2, -CRANK * SPEED / ROD)
    guide, slider = body(SLIDER_MASS, 1.0, CRANK + ROD, 0, 0, moved=start)
    join(item.ObjectJointRevolute2D, at(ground, 0), at(crank, 0))
    join(item.ObjectJointRevolute2D, at(crank, CRANK), at(rod, -ROD / 2))
    join(item.ObjectConnectorCoordinate, fixed, coordinate(guide, 1))
    join(item.ObjectConnectorCoordinate, fixed, coordinate(guide, 2))
    drive = join(
        item.ObjectConnectorCoordinate,
        fixed,
        coordinate(shaft, 2),
        velocityLevel=True,
        offset=SPEED,
    )
    spring = item.ObjectConnectorRigidBodySpringDamper
    ends = at(rod, ROD / 2), at(slider, 0)
    return mbs, join(spring, *ends, springForceTorqueUserFunction=force), drive


def relative(velocity, spin, e):
    """The rate of e in axes of the rod, which turns by -``spin`` under a pin that does not turn,
    from the difference of velocities in these axes."""
    return velocity[0] - spin * e[1], velocity[1] + spin * e[0]


def simulate(law, start, steps=STEPS, turns=TURNS):
    """Turn the crank with the element of ``law``, first at ``start``.

    Returns a column a step (time, e, deepest, stored energy, quasi-static force, size of the force,
    power lost by film and friction, torque of the drive, velocities), and the memory.
    """
    memory = law.advance_element(law.new_element(), DR + start, 0.0)
    columns = []
    kinds = exudyn.OutputVariableType

    def force(mbs, t, number, displacement, rotation, velocity, spin, *unused):
        e = displacement[:2]
        (Fx, Fy, T), _ = law.element(memory, e, relative(velocity, spin[2], e), spin[2])
        moment = T + e[0] * Fy - e[1] * Fx  # on the rod, whose hole's centre is not the pin's
        return [-WIDTH * Fx, -WIDTH * Fy, 0, 0, 0, -WIDTH * moment]

    def accept(mbs, t):
        nonlocal memory
        e = mbs.GetObjectOutput(joint, kinds.DisplacementLocal)[:2]
        spin = mbs.GetObjectOutput(joint, kinds.AngularVelocityLocal)[2]
        v = relative(mbs.GetObjectOutput(joint, kinds.VelocityLocal), spin, e)
        (Fx, Fy, T), _ = law.element(memory, e, v, spin)
        (Qx, Qy, _), _ = law.element(memory, e)
        memory = law.advance_element(memory, *e)
        along_x = (Fx - Qx) * v[0]
        along_y = (Fy - Qy) * v[1]
        lost = -WIDTH * (along_x + along_y + T * spin)
        stored = WIDTH * law.stored_energy(memory, *e)
        torque = -mbs.GetObjectOutput(drive, kinds.Force)
        velocities = mbs.systemData.GetODE2Coordinates_t()
        forces = (WIDTH * Qx, WIDTH * Qy, WIDTH * np.hypot(Fx, Fy))
        columns.append((t, *e, max(memory), stored, *forces, lost, torque, *velocities))
        return True

    mbs, joint, drive = mechanism(force, DR + start)
    mbs.SetPostStepUserFunction(accept)
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime = turns * 2 * pi / SPEED
    settings.timeIntegration.numberOfSteps = turns * steps
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.TrapezoidalIndex2)
    return np.array(columns).T, memory


def energies(columns):
    """Energies [N mm] by name, whose sum stays. What the joint has stored is what it gives back
    until it opens."""
    t, x, y, _, stored, Qx, Qy, _, lost, torque, *v = columns
    work = -cumulative_trapezoid(Qx, x, initial=0) - cumulative_trapezoid(Qy, y, initial=0)
    rod = [ROD_MASS, ROD_MASS, ROD_INERTIA]
    masses = np.array([0, 0, 0, *rod, SLIDER_MASS, SLIDER_MASS, 0])
    return {
        "stored": stored,
        "lost, law": work - stored + stored[0],
        "lost, film and friction": cumulative_trapezoid(lost, t, initial=0),
        "kinetic": masses @ np.square(v) / 2,
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
        radius=JOINT.radius,
    )


def study(curve, steps=STEPS, turns=TURNS):
    """The crank turned with a law, exported: columns of `simulate`, memory, energies, and numbers
    by name."""
    law = ModuleType("joint")
    # `archord law --export` writes it
    exec(export_law(curve, Path("joint.py"), CONTACT), vars(law))
    start = float(curve.displacement(START))
    columns, memory = simulate(law, start, steps, turns)
    parts = energies(columns)
    angle = columns[0] * SPEED
    P = columns[7]
    return columns, memory, parts, {
        "first impacts [kN]": f"{P[(angle > pi / 3) & (angle < pi)].max() / 1e3:.3f}",
        "largest force [kN]": f"{P.max() / 1e3:.3f}",
        "deepest/dR": f"{columns[3, -1] / DR:.3f}",
        "lost by the law [N mm]": f"{parts['lost, law'][-1]:.1f}",
        "film and friction [N mm]": f"{parts['lost, film and friction'][-1]:.0f}",
        "balance": f"{np.ptp(sum(parts.values())) / parts['stored'].max():.2%}",
    }  # fmt: skip


def draw(runs, target):
    """First impacts, the orbit of the pin, and where the energy of the last run is."""
    figure = new_figure(14, 4.5)
    impacts, orbit, energy = figure.subplots(1, 3)
    for name, (columns, *_) in runs.items():
        P = columns[7]
        angle = np.degrees(columns[0] * SPEED)
        first = (angle > 70) & (angle < 90)
        second = angle > 360
        impacts.plot(angle[first], P[first] / 1e3, lw=1, label=name)
        if name in ("elastic", "yielding"):
            orbit.plot(*columns[1:3, second] / DR, lw=0.7, label=name)
    memory = runs[name][1]
    directions = np.linspace(-pi, pi, len(memory) + 1)
    remembered = 1 + np.append(memory, memory[0]) / DR
    outline = remembered * [np.cos(directions), np.sin(directions)]
    orbit.plot(*outline, "k", lw=0.7, label="remembered")
    parts = runs[name][2]
    total = sum(parts.values())
    balance = ("balance, times 100", 100 * (total - total[0]))
    for name, values in (*list(parts.items())[:2], balance):
        energy.plot(angle, values, lw=0.7, label=name)
    orbit.add_patch(Circle((0, 0), 1, fill=False, ls=":"))
    impacts.set(
        xlabel="crank angle [degrees]", ylabel="force of the joint [kN]", title="first impacts"
    )
    orbit.set(xlabel="$e_x$/dR", ylabel="$e_y$/dR", title="the pin in the hole", aspect="equal")
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

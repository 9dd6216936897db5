"""The scenes of the stability benchmark: variations of the paper's joint and of Persson's, and what each must give.

Elements are 10 %R long where the case is not about the mesh. A case names what its numbers must agree with: a closed
form; another case of the same run that gets there another way (other units, other steps, the other control); or the
same joint on a fine mesh, stored in ``stability_fine.json``, which ``python3 -m archord.benchmarks.stability.fine``
writes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from archord.benchmarks.case import E, paper_joint
from archord.benchmarks.verification.persson import persson_joint, theory
from archord.scene.scene import Scene

FINE = "fine"
RIGID = {"rigid": True}
COARSE = 0.1  # element size over R


@dataclass(frozen=True)
class Expected:
    """``quantity`` ("P/(E* R)", "p0/E*", "eps" or "delta/dR", at the last step) must be ``value`` within the relative
    ``tolerance``.

    ``value`` is a number or, times ``factor``, that of another case by name; or that of the same case on a fine mesh.
    """

    quantity: str
    value: float | str
    tolerance: float
    source: str
    factor: float = 1.0


@dataclass(frozen=True)
class Case:
    """One line of the table: a scene and how it must end.

    With ``stops``, a part of the sentence that the run must end with (exit code 3); with ``warns``, a part of one of
    its warnings. At most ``budget`` Newton iterations, failed attempts included, and ``seconds`` of wall time.
    """

    name: str
    group: str
    scene: Scene
    expected: tuple[Expected, ...] = ()
    stops: str = ""
    warns: str = ""
    budget: int = 300
    seconds: float = 90.0


def same_as(case: str, tolerance: float, why: str, factor: float = 1.0, quantity: str = "P/(E* R)") -> Expected:
    """What another case gives, for the reason ``why``."""
    return Expected(quantity, case, tolerance, why, factor)


def fine(tolerance: float = 0.005, quantity: str = "P/(E* R)") -> Expected:
    """What the same joint gives on a fine mesh (see `fine_scene`)."""
    return Expected(quantity, FINE, tolerance, "fine mesh")


def moduli(ratio: float, nu: float = 0.3) -> dict[str, Any]:
    """Pin and block with E_pin/E_block = ``ratio`` and E* = 1 in plane strain."""
    block = (1 - nu**2) * (1 + 1 / ratio)
    return {"pin": {"E": ratio * block, "nu": nu}, "block": {"E": block, "nu": nu}}


def both(**keys: Any) -> dict[str, Any]:
    """The same ``keys`` for pin and block."""
    return {"pin": keys, "block": keys}


def poisson(nu: float, **keys: Any) -> dict[str, Any]:
    """Like bodies with E* = 1 in plane strain."""
    return both(E=2 * (1 - nu**2), nu=nu, **keys)


def _short(number: float) -> str:
    mantissa, exponent = f"{number:.0e}".split("e")
    return mantissa if int(exponent) == 0 else f"{mantissa}e{int(exponent)}"


def _case(
    name: str,
    group: str,
    *expected: Expected,
    stops: str = "",
    warns: str = "",
    budget: int = 300,
    element_size: float = COARSE,
    steps: int = 4,
    yield_stress: float | None = None,
    **sections: Any,
) -> Case:
    scene = paper_joint(element_size, steps, yield_stress, **sections)
    expected = expected or (() if stops else (fine(),))
    return Case(name, group, scene, expected, stops, warns, budget)


def _by_force(force: float | list[float], steps: int = 4) -> dict:
    return {"displacement": None, "relative_force": force, "steps": steps}


def _bodies() -> Iterable[Case]:
    group = "modulus ratio"
    yield _case(
        "E_pin/E_block = 1e-6", group, same_as("E_pin/E_block = 1e-4", 1e-3, "both bodies' limit"), **moduli(1e-6)
    )
    for ratio in (1e-4, 1e-2, 1.0, 1e2, 1e4):
        yield _case(f"E_pin/E_block = {_short(ratio)}", group, **moduli(ratio))
    yield _case("E_pin/E_block = 1e6", group, same_as("rigid pin", 1e-5, "a rigid pin"), element_size=0.03,
                **moduli(1e6))  # fmt: skip
    yield _case("rigid pin", group, element_size=0.03, pin=RIGID, block={"E": E / 2, "nu": 0.3})
    group = "Poisson's ratio"
    for nu in (-0.9, 0.0, 0.45, 0.499, 0.4999):
        yield _case(f"nu = {nu:g}", group, **poisson(nu))
    yield _case("nu = 0.4999, plane stress", group, **both(E=2.0, nu=0.4999), analysis={"plane": "stress"})
    yield _case("nu = 0.499, plastic", group, fine(0.01), **poisson(0.499, yield_stress=0.002), steps=10, budget=1000)
    yield _case("nu = 0.4999, plastic", group, same_as("nu = 0.499, plastic", 0.01, "nu = 0.499"),
                **poisson(0.4999, yield_stress=0.002), steps=10, budget=1000)  # fmt: skip
    yield _case("nu = 0.4999, rigid pin", group, pin=RIGID, block={"E": 1.0, "nu": 0.4999})


def _geometry() -> Iterable[Case]:
    group = "clearance"
    small = same_as("dR/R = 1e-4", 1e-3, "P/dR of concentric circles", 0.01)
    yield _case("dR/R = 1e-6", group, small, joint={"clearance": 1e-6})
    yield _case("dR/R = 1e-4", group, joint={"clearance": 1e-4})
    yield _case("dR/R = 0.01", group, joint={"clearance": 0.01})
    yield _case("dR/R = 0.1", group, joint={"clearance": 0.1})
    yield _case("dR/R = 0.5", group, joint={"clearance": 0.5}, load={"displacement": 0.2})
    yield _case("dR/R = 0.5, delta/dR = 0.5", group, fine(0.01), joint={"clearance": 0.5}, load={"displacement": 0.5})
    group = "ring"
    for load, size, steps in ((10.0, 0.04, 1), (0.1, COARSE, 1), (-0.05, COARSE, 4), (-0.2, COARSE, 4)):
        eps, peak = theory(load)
        kind = "clearance" if load > 0 else "interference"
        expected = (
            Expected("p0/P", peak, 0.01, "Persson 1964"),
            Expected("eps", eps, 0.02, "Ciavarella and Decuzzi 2001"),
        )
        yield Case(f"{kind}, E* dR/P = {load:g}", group, persson_joint(load, size, steps), expected)

    stiff = [persson_joint(-0.1, COARSE, 4, **moduli(ratio)) for ratio in (1e2, 1e6)]
    name, why = "interference, E_pin/E_block = 1e2", "a rigid pin, nearly"
    yield Case(name, group, stiff[0], (fine(0.02, "eps"), fine(0.02, "p0/P")))
    like = (same_as(name, 0.03, why, quantity="eps"), same_as(name, 0.03, why, quantity="p0/P"))
    yield Case("interference, E_pin/E_block = 1e6", group, stiff[1], like)


def _loads() -> Iterable[Case]:
    group = "load"
    unseen = "no contact point was ever pressed"
    yield _case("delta/dR = 1e-7, smaller than the mesh can see", group, stops=unseen, load={"displacement": 1e-7})
    yield _case(
        "first touch, delta/dR = 1e-4", group, fine(0.5), load={"displacement": 1e-4, "steps": 1}, warns="facet"
    )
    yield _case("delta/dR = 1e-3", group, fine(0.1), load={"displacement": 1e-3}, warns="facet")
    yield _case("delta/dR = 0.01", group, fine(0.05), load={"displacement": 0.01}, warns="facet")
    yield _case("delta/dR = 0.1", group, fine(0.01), load={"displacement": 0.1})
    yield _case("delta/dR = 10", group, load={"displacement": 10.0})
    end = "contact reaches the end of the modelled quarter arc"
    thin = {"clearance": 0.001}
    yield _case("delta/dR = 100", group, fine(0.01), joint=thin, load={"displacement": 100.0}, warns=end)
    yield _case("delta/dR = 1000", group, fine(0.01), joint={"clearance": 1e-4}, load={"displacement": 1e3}, warns=end)
    yield _case("zero displacement", group, Expected("P/(E* R)", 0.0, 0.0, "no load"), load={"displacement": 0.0})
    yield _case("zero force", group, Expected("delta/dR", 0.0, 0.0, "no load"), load=_by_force(0.0))
    yield _case(
        "lifted, delta/dR = -1", group, Expected("P/(E* R)", 0.0, 1e-12, "no contact"), load={"displacement": -1.0}
    )
    yield _case("pulled, P < 0", group, stops="come free", load=_by_force(-0.001))
    once = same_as("E_pin/E_block = 1", 1e-8, "elastic: any path")
    yield _case("pressed, lifted, pressed", group, once, load={"displacement": [2.0, -1.0, 2.0], "steps": [2, 3, 2]})
    yield _case("pressed, then pulled", group, stops="come free", load=_by_force([0.006, -0.001], 2))
    group = "one step"
    one = {"displacement": 2.0, "steps": 1}
    yield _case("elastic", group, once, load=one)
    yield _case("elastic, reference pairs", group, load=one, analysis={"kinematics": "reference"})
    yield _case("elastic, 2 %R", group, fine(0.001), load=one, element_size=0.02)
    yield _case("elastic, by force", group, fine(0.005, "delta/dR"),
                load=_by_force(0.0128, 1))  # fmt: skip
    yield _case("elastic, delta/dR = 100", group, same_as("delta/dR = 100", 1e-7, "elastic: any path"), joint=thin,
                load={"displacement": 100.0, "steps": 1}, warns=end)  # fmt: skip
    yield _case("plastic, sigY/E* = 0.002", group, fine(0.02), load=one, yield_stress=0.002)
    yield _case("plastic, sigY/E* = 0.0005", group, fine(0.05), load=one, yield_stress=0.0005)
    yield _case("plastic, rigid pin", group, fine(0.02), load=one, pin=RIGID,
                block={"E": E / 2, "nu": 0.3, "yield_stress": 0.002})  # fmt: skip
    yield _case("plastic, by force", group, fine(0.05, "delta/dR"), load=_by_force(0.006, 1), yield_stress=0.002)


def _strength() -> Iterable[Case]:
    group = "yield stress"
    for strength in (1e-5, 1e-4, 1e-3, 1e-2):
        for hardening, name in ((0.0, ""), (1e-4 * E, ", H = 1e-4 E"), (E, ", H = E")):
            title = f"sigY/E* = {_short(strength)}"
            expected = fine(0.01)
            if hardening < E and (strength < 1e-4 or (hardening and strength < 1e-3)):
                # the fine mesh takes long here; what such hardening adds is small beside sigY
                expected = same_as(title + ("" if hardening else ", H = 1e-4 E"), 0.03, "little hardening or none")
            if (strength, hardening) == (1e-2, 1e-4 * E):
                continue
            bodies = both(E=E, nu=0.3, yield_stress=strength, hardening=hardening)
            yield _case(title + name, group, expected, steps=8, budget=2000 if strength < 1e-4 else 600, **bodies)
    elastic = same_as("E_pin/E_block = 1", 1e-9, "never yields")
    yield _case("sigY/E* = 0.1", group, elastic, yield_stress=0.1)
    plane: dict[str, Any] = {"analysis": {"plane": "stress"}}
    for strength, expected, size in (
        (2e-3, fine(0.01), COARSE),
        (1e-4, same_as("sigY/E* = 1e-4, plane stress, elements of 20 %R", 0.03, "another mesh"), COARSE),
        (1e-4, same_as("sigY/E* = 1e-4, plane stress", 0.03, "another mesh"), 0.2),
        (1e-5, same_as("sigY/E* = 1e-4, plane stress", 0.1, "fully plastic: P goes with sigY", 0.1), COARSE),
    ):
        bodies = both(E=2.0, nu=0.3, yield_stress=strength)
        title = f"sigY/E* = {_short(strength)}, plane stress" + (", elements of 20 %R" if size > COARSE else "")
        yield _case(title, group, expected, steps=8, budget=2000, element_size=size, **plane, **bodies)
    group = "limit load"
    soft = {"E": E, "nu": 0.3, "yield_stress": 0.001}
    push = {"displacement": 6.0, "steps": 12}
    yield _case("fully plastic pin", group, fine(0.02), pin=soft, load=push, budget=1000)
    yield _case("fully plastic pin, plane stress", group, fine(0.02), pin=soft, load=push, budget=1000, **plane)
    for size, name, other in ((COARSE, "", ", elements of 20 %R"), (0.2, ", elements of 20 %R", "")):
        like = same_as(f"fully plastic pin, far{other}", 0.02, "another mesh")
        yield _case(f"fully plastic pin, far{name}", group, like, pin=soft, load={"displacement": 20.0, "steps": 20},
                    budget=1500, element_size=size)  # fmt: skip
    held = same_as("fully plastic pin, plane stress", 0.1, "plateau at 6 dR, which goes on rising")
    yield _case("force beyond the pin's limit load", group, held, stops="last load that held", pin=soft,
                load=_by_force(0.004, 8), stepping={"minimum": 0.02}, budget=1500, **plane)  # fmt: skip
    yield _case("force beyond the joint's limit load", group, stops="last load that held", yield_stress=0.002,
                load=_by_force(0.04, 4), stepping={"minimum": 0.01}, budget=1500, element_size=0.2)  # fmt: skip


def _mesh() -> Iterable[Case]:
    group = "mesh"
    whole = "E_pin/E_block = 1"
    yield _case("elements of 10 %R in one step", group, same_as("elements of 0.2 %R", 0.002, "fine mesh"),
                load={"displacement": 2.0, "steps": 1})  # fmt: skip
    yield _case("elements of 0.2 %R", group, same_as(whole, 0.002, "coarse mesh"), element_size=0.002,
                joint={"growth": 0.5}, load={"displacement": 2.0, "steps": 1})  # fmt: skip
    yield _case("elements of 40 %R", group, fine(0.02), element_size=0.4)
    yield _case("pin:block = 1:20", group, fine(), element_size=0.2, joint={"size_ratio": 0.05})
    yield _case("pin:block = 20:1", group, fine(), element_size=0.01, joint={"size_ratio": 20.0})
    yield _case("pin:block = 1:20, plastic", group, fine(0.01), element_size=0.2, joint={"size_ratio": 0.05},
                yield_stress=0.002, steps=10)  # fmt: skip
    yield _case("pin:block = 20:1, plastic", group, fine(0.01), element_size=0.01, joint={"size_ratio": 20.0},
                yield_stress=0.002, steps=10)  # fmt: skip
    group = "gamma factor"
    for factor in (1e-2, 0.1, 10.0, 1e2, 1e4):
        like = same_as(whole, 0.005, "gamma factor 0.5")  # below 0.25 the form need not be coercive
        yield _case(f"gamma factor {factor:g}", group, like, analysis={"gamma_factor": factor})
    for factor in (0.1, 1e2, 1e4):
        yield _case(f"gamma factor {factor:g}, plastic", group, fine(0.01), analysis={"gamma_factor": factor}, steps=8,
                    yield_stress=0.002)  # fmt: skip
    group = "units"
    like = same_as(whole, 1e-8, "other units")
    for power in (-9, 9):
        length, stress = 10.0**power, E * 10.0**power
        yield _case(f"lengths times 1e{power}", group, like, joint={"radius": length, "clearance": 0.005 * length},
                    element_size=COARSE * length)  # fmt: skip
        yield _case(f"moduli times 1e{power}", group, like, **both(E=stress, nu=0.3))
        yield _case(f"both times 1e{power}, plastic", group, same_as("plastic, E* = R = 1", 1e-8, "other units"),
                    joint={"radius": length, "clearance": 0.005 * length}, element_size=COARSE * length,
                    **both(E=stress, nu=0.3, yield_stress=0.002 * 10.0**power))  # fmt: skip
    yield _case("plastic, E* = R = 1", group, fine(0.01), yield_stress=0.002)


def _pairs() -> Iterable[Case]:
    group = "pairs"
    thin, one = {"clearance": 1e-6}, {"displacement": 2.0, "steps": 1}
    scaled = 1e-6 / 0.005  # P goes with dR
    yield _case(
        "dR/R = 1e-6, rigid pin", group, element_size=0.04, pin=RIGID, block={"E": E / 2, "nu": 0.3}, joint=thin
    )
    yield _case("dR/R = 1e-6, E_pin/E_block = 1e6", group, same_as("dR/R = 1e-6, rigid pin", 0.01, "a rigid pin"),
                element_size=0.04, joint=thin, **moduli(1e6))  # fmt: skip
    yield _case("dR/R = 1e-6, E_pin/E_block = 1e-6", group,
                same_as("E_pin/E_block = 1e-6", 0.02, "P/dR of concentric circles", scaled), joint=thin,
                **moduli(1e-6))  # fmt: skip
    yield _case("dR/R = 1e-6, one step", group, same_as("dR/R = 1e-6", 1e-6, "elastic: any path"), joint=thin, load=one)
    yield _case("dR/R = 1e-6, nu = 0.4999", group, same_as("nu = 0.4999", 0.02, "P goes with dR", scaled),
                joint=thin, **poisson(0.4999))  # fmt: skip
    yield _case("dR/R = 1e-6, gamma factor 1e4", group, same_as("dR/R = 1e-6", 0.002, "gamma factor 0.5"), joint=thin,
                analysis={"gamma_factor": 1e4})  # fmt: skip
    yield _case("dR/R = 1e-6, sigY/E* = 4e-7", group, same_as("plastic, E* = R = 1", 0.01, "P/dR, sigY/dR", scaled),
                joint=thin, yield_stress=4e-7)  # fmt: skip
    yield _case("dR/R = 1e-6, by force", group, fine(0.005, "delta/dR"), joint=thin,
                load=_by_force(2.5650e-6, 1))  # fmt: skip
    yield _case("dR/R = 1e-4, pin:block = 20:1", group, fine(0.02), joint={"clearance": 1e-4, "size_ratio": 20.0},
                element_size=0.005)  # fmt: skip
    yield _case("dR/R = 1e-6, lengths times 1e-9", group, same_as("dR/R = 1e-6", 1e-6, "other units"),
                joint={"radius": 1e-9, "clearance": 1e-15}, element_size=1e-10)  # fmt: skip
    yield _case("dR/R = 0.5, rigid pin", group, joint={"clearance": 0.5}, pin=RIGID, block={"E": E / 2, "nu": 0.3},
                load={"displacement": 0.2})  # fmt: skip
    yield _case("nu = 0.4999, gamma factor 1e4", group, same_as("nu = 0.4999", 0.002, "gamma factor 0.5"),
                analysis={"gamma_factor": 1e4}, **poisson(0.4999))  # fmt: skip
    yield _case("nu = 0.4999, E_pin/E_block = 1e6", group, same_as("nu = 0.4999, rigid pin", 0.005, "a rigid pin"),
                **moduli(1e6, 0.4999))  # fmt: skip
    yield _case("nu = 0.4999, plastic, one step", group, same_as("nu = 0.499, plastic", 0.02, "nu = 0.499"),
                load=one, budget=1000, **poisson(0.4999, yield_stress=0.002))  # fmt: skip
    yield _case("nu = 0.499, E_pin/E_block = 1e-6, one step", group, load=one, **moduli(1e-6, 0.499))
    yield _case("gamma factor 1e4, plastic, one step", group, fine(0.02), load=one, analysis={"gamma_factor": 1e4},
                yield_stress=0.002)  # fmt: skip
    yield _case("gamma factor 1e4, rigid pin", group, same_as("rigid pin", 0.002, "gamma factor 0.5"), pin=RIGID,
                element_size=0.03, analysis={"gamma_factor": 1e4}, block={"E": E / 2, "nu": 0.3})  # fmt: skip
    yield _case("pin:block = 20:1, E_pin/E_block = 1e-6", group, joint={"size_ratio": 20.0}, element_size=0.01,
                **moduli(1e-6))  # fmt: skip
    yield _case("pin:block = 1:20, E_pin/E_block = 1e6", group, joint={"size_ratio": 0.05}, element_size=0.2,
                **moduli(1e6))  # fmt: skip
    weak = moduli(1e4)
    weak["block"] |= {"yield_stress": 1e-3}
    yield _case("E_pin/E_block = 1e4, plastic block", group, fine(0.01), steps=8, budget=600, **weak)
    yield _case("delta/dR = 20, sigY/E* = 0.01", group, fine(0.02), joint={"clearance": 0.001}, yield_stress=0.01,
                load={"displacement": 20.0, "steps": 10}, budget=1000)  # fmt: skip


def cases() -> dict[str, Case]:
    """All cases by name, in the order of the table."""
    found = [c for part in (_bodies, _geometry, _loads, _strength, _mesh, _pairs) for c in part()]
    table = {c.name: c for c in found}
    if len(table) < len(found):
        raise ValueError("two cases of the stability benchmark have the same name")
    return table

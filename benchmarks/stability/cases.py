"""The scenes of the stability benchmark: variations of the paper's joint and of Persson's, and what each must give.

Elements are 10 %R long where the case is not about the mesh. A case names what its numbers must agree with: a closed
form; another case of the same run that gets there another way (other units, other steps, the other control); or the
same joint on a fine mesh, stored in ``fine.json``, which ``python3 -m archord.benchmarks.stability.fine`` writes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from archord.benchmarks.case import Case, E, Expected, paper_joint
from archord.benchmarks.persson import persson_joint, theory

FINE = "fine"  # an expected value that is the same case's on a fine mesh (see `fine_scene`)
COARSE = 0.1  # element size over R
RIGID: dict[str, Any] = {"pin": {"rigid": True}, "block": {"E": E / 2, "nu": 0.3}}
STRESS = {"analysis": {"plane": "stress"}}
ONE_STEP = {"displacement": 2.0, "steps": 1}
THIN = {"clearance": 1e-6}
SCALED = 1e-6 / 0.005  # P of a thin joint over that of the paper's: it goes with dR
LIKE = "E_pin/E_block = 1"  # the paper's joint as it is


def same_as(case: str, tolerance: float, why: str, factor: float = 1.0, quantity: str = "P/(E* R)") -> Expected:
    """What another case gives, for the reason ``why``."""
    return Expected(quantity, case, tolerance, why, factor)


def fine(tolerance: float = 0.005, quantity: str = "P/(E* R)") -> Expected:
    """What the same joint gives on a fine mesh."""
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


def gamma(factor: float) -> dict[str, Any]:
    """The section analysis with this gamma factor."""
    return {"analysis": {"gamma_factor": factor}}


def by_force(force: float | list[float], steps: int = 4) -> dict[str, Any]:
    """The section load with a force over E* R."""
    return {"displacement": None, "relative_force": force, "steps": steps}


def _short(number: float) -> str:
    mantissa, exponent = f"{number:.0e}".split("e")
    return mantissa if int(exponent) == 0 else f"{mantissa}e{int(exponent)}"


def _case(
    name: str,
    *expected: Expected,
    stops: str = "",
    warns: str = "",
    budget: int = 300,
    size: float = COARSE,
    steps: int = 4,
    yield_stress: float | None = None,
    **sections: Any,
) -> Case:
    scene = paper_joint(size, steps, yield_stress, **sections)
    expected = expected or (() if stops else (fine(),))
    return Case(name, scene, expected=expected, stops=stops, warns=warns, budget=budget)


def _modulus_ratio() -> Iterable[Case]:
    yield _case("E_pin/E_block = 1e-6", same_as("E_pin/E_block = 1e-4", 1e-3, "both bodies' limit"), **moduli(1e-6))
    for ratio in (1e-4, 1e-2, 1.0, 1e2, 1e4):
        yield _case(f"E_pin/E_block = {_short(ratio)}", **moduli(ratio))
    yield _case("E_pin/E_block = 1e6", same_as("rigid pin", 1e-5, "a rigid pin"), size=0.03, **moduli(1e6))
    yield _case("rigid pin", size=0.03, **RIGID)


def _poisson() -> Iterable[Case]:
    for nu in (-0.9, 0.0, 0.45, 0.499, 0.4999):
        yield _case(f"nu = {nu:g}", **poisson(nu))
    yield _case("nu = 0.4999, plane stress", **both(E=2.0, nu=0.4999), **STRESS)
    like = same_as("nu = 0.499, plastic", 0.01, "nu = 0.499")
    yield _case("nu = 0.499, plastic", fine(0.01), steps=10, budget=1000, **poisson(0.499, yield_stress=0.002))
    yield _case("nu = 0.4999, plastic", like, steps=10, budget=1000, **poisson(0.4999, yield_stress=0.002))
    yield _case("nu = 0.4999, rigid pin", pin=RIGID["pin"], block={"E": 1.0, "nu": 0.4999})


def _clearance() -> Iterable[Case]:
    yield _case("dR/R = 1e-6", same_as("dR/R = 1e-4", 1e-3, "P/dR of concentric circles", 0.01), joint=THIN)
    for ratio, name in ((1e-4, "1e-4"), (0.01, "0.01"), (0.1, "0.1")):
        yield _case(f"dR/R = {name}", joint={"clearance": ratio})
    yield _case("dR/R = 0.5", joint={"clearance": 0.5}, load={"displacement": 0.2})
    yield _case("dR/R = 0.5, delta/dR = 0.5", fine(0.01), joint={"clearance": 0.5}, load={"displacement": 0.5})


def _ring() -> Iterable[Case]:
    for load, size, steps in ((10.0, 0.04, 1), (0.1, COARSE, 1), (-0.05, COARSE, 4), (-0.2, COARSE, 4)):
        eps, peak = theory(load)
        kind = "clearance" if load > 0 else "interference"
        known = (
            Expected("p0/P", peak, 0.01, "Persson 1964"),
            Expected("eps", eps, 0.02, "Ciavarella and Decuzzi 2001"),
        )
        yield Case(f"{kind}, E* dR/P = {load:g}", persson_joint(load, size, steps), expected=known)
    stiff = "interference, E_pin/E_block = 1e2"
    expected = {
        stiff: (fine(0.02, "eps"), fine(0.02, "p0/P")),
        "interference, E_pin/E_block = 1e6": tuple(
            same_as(stiff, 0.03, "a rigid pin, nearly", quantity=quantity) for quantity in ("eps", "p0/P")
        ),
    }
    for (name, like), ratio in zip(expected.items(), (1e2, 1e6), strict=True):
        yield Case(name, persson_joint(-0.1, COARSE, 4, **moduli(ratio)), expected=like)


_ONCE = same_as(LIKE, 1e-8, "elastic: any path")
_END = "contact reaches the end of the modelled quarter arc"


def _load() -> Iterable[Case]:
    unseen = "no contact point was ever pressed"
    yield _case("delta/dR = 1e-7, smaller than the mesh can see", stops=unseen, load={"displacement": 1e-7})
    touch = {"displacement": 1e-4, "steps": 1}
    yield _case("first touch, delta/dR = 1e-4", fine(0.5), warns="facet", load=touch)
    yield _case("delta/dR = 1e-3", fine(0.1), warns="facet", load={"displacement": 1e-3})
    yield _case("delta/dR = 0.01", fine(0.05), warns="facet", load={"displacement": 0.01})
    yield _case("delta/dR = 0.1", fine(0.01), load={"displacement": 0.1})
    yield _case("delta/dR = 10", load={"displacement": 10.0})
    yield _case("delta/dR = 100", fine(0.01), warns=_END, joint={"clearance": 0.001}, load={"displacement": 100.0})
    yield _case("delta/dR = 1000", fine(0.01), warns=_END, joint={"clearance": 1e-4}, load={"displacement": 1e3})
    nothing = Expected("P/(E* R)", 0.0, 0.0, "no load")
    yield _case("zero displacement", nothing, load={"displacement": 0.0})
    yield _case("zero force", replace(nothing, quantity="delta/dR"), load=by_force(0.0))
    apart = Expected("P/(E* R)", 0.0, 1e-12, "no contact")
    yield _case("lifted, delta/dR = -1", apart, load={"displacement": -1.0})
    yield _case("pulled, P < 0", stops="singular mode", load=by_force(-0.001))
    yield _case("pressed, lifted, pressed", _ONCE, load={"displacement": [2.0, -1.0, 2.0], "steps": [2, 3, 2]})
    yield _case("pressed, then pulled", stops="singular mode", load=by_force([0.006, -0.001], 2))


def _one_step() -> Iterable[Case]:
    yield _case("elastic", _ONCE, load=ONE_STEP)
    yield _case("elastic, reference pairs", load=ONE_STEP, analysis={"kinematics": "reference"})
    yield _case("elastic, 2 %R", fine(0.001), size=0.02, load=ONE_STEP)
    yield _case("elastic, by force", fine(0.005, "delta/dR"), load=by_force(0.0128, 1))
    far = same_as("delta/dR = 100", 1e-7, "elastic: any path")
    yield _case("elastic, delta/dR = 100", far, warns=_END, joint={"clearance": 0.001},
                load={"displacement": 100.0, "steps": 1})  # fmt: skip
    yield _case("plastic, sigY/E* = 0.002", fine(0.02), yield_stress=0.002, load=ONE_STEP)
    yield _case("plastic, sigY/E* = 0.0005", fine(0.05), yield_stress=0.0005, load=ONE_STEP)
    block = RIGID["block"] | {"yield_stress": 0.002}
    yield _case("plastic, rigid pin", fine(0.02), load=ONE_STEP, pin=RIGID["pin"], block=block)
    yield _case("plastic, by force", fine(0.05, "delta/dR"), yield_stress=0.002, load=by_force(0.006, 1))


def _yield_stress() -> Iterable[Case]:
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
            yield _case(title + name, expected, steps=8, budget=2000 if strength < 1e-4 else 600, **bodies)
    yield _case("sigY/E* = 0.1", same_as(LIKE, 1e-9, "never yields"), yield_stress=0.1)
    weak, coarse = "sigY/E* = 1e-4, plane stress", "sigY/E* = 1e-4, plane stress, elements of 20 %R"
    for name, strength, expected, size in (
        ("sigY/E* = 2e-3, plane stress", 2e-3, fine(0.01), COARSE),
        (weak, 1e-4, same_as(coarse, 0.03, "another mesh"), COARSE),
        (coarse, 1e-4, same_as(weak, 0.03, "another mesh"), 0.2),
        ("sigY/E* = 1e-5, plane stress", 1e-5, same_as(weak, 0.1, "fully plastic: P goes with sigY", 0.1), COARSE),
    ):
        bodies = both(E=2.0, nu=0.3, yield_stress=strength)
        yield _case(name, expected, steps=8, budget=2000, size=size, **STRESS, **bodies)


def _limit_load() -> Iterable[Case]:
    soft: dict[str, Any] = {"pin": {"E": E, "nu": 0.3, "yield_stress": 0.001}}
    push, far = {"displacement": 6.0, "steps": 12}, {"displacement": 20.0, "steps": 20}
    yield _case("fully plastic pin", fine(0.02), budget=1000, load=push, **soft)
    yield _case("fully plastic pin, plane stress", fine(0.02), budget=1000, load=push, **soft, **STRESS)
    for size, name, other in ((COARSE, "", ", elements of 20 %R"), (0.2, ", elements of 20 %R", "")):
        like = same_as(f"fully plastic pin, far{other}", 0.02, "another mesh")
        yield _case(f"fully plastic pin, far{name}", like, budget=1500, size=size, load=far, **soft)
    held, stops = "fully plastic pin, plane stress", "last load that held"
    yield _case("force beyond the pin's limit load", same_as(held, 0.1, "plateau at 6 dR, which goes on rising"),
                stops=stops, budget=1500, load=by_force(0.004, 8), stepping={"minimum": 0.02}, **soft,
                **STRESS)  # fmt: skip
    yield _case("force beyond the joint's limit load", stops=stops, budget=1500, size=0.2, yield_stress=0.002,
                load=by_force(0.04, 4), stepping={"minimum": 0.01})  # fmt: skip


def _mesh() -> Iterable[Case]:
    yield _case("elements of 10 %R in one step", same_as("elements of 0.2 %R", 0.002, "fine mesh"), load=ONE_STEP)
    yield _case("elements of 0.2 %R", same_as(LIKE, 0.002, "coarse mesh"), size=0.002, joint={"growth": 0.5},
                load=ONE_STEP)  # fmt: skip
    yield _case("elements of 40 %R", fine(0.02), size=0.4)
    for expected, plastic, more in ((fine(), "", {}), (fine(0.01), ", plastic", {"yield_stress": 0.002, "steps": 10})):
        yield _case(f"pin:block = 1:20{plastic}", expected, size=0.2, joint={"size_ratio": 0.05}, **more)
        yield _case(f"pin:block = 20:1{plastic}", expected, size=0.01, joint={"size_ratio": 20.0}, **more)


def _gamma_factor() -> Iterable[Case]:
    for factor in (1e-2, 0.1, 10.0, 1e2, 1e4):  # below 0.25 the form need not be coercive
        yield _case(f"gamma factor {factor:g}", same_as(LIKE, 0.005, "gamma factor 0.5"), **gamma(factor))
    for factor in (0.1, 1e2, 1e4):
        yield _case(f"gamma factor {factor:g}, plastic", fine(0.01), steps=8, yield_stress=0.002, **gamma(factor))


def _units() -> Iterable[Case]:
    elastic, plastic = (same_as(name, 1e-8, "other units") for name in (LIKE, "plastic, E* = R = 1"))
    for power in (-9, 9):
        scale = 10.0**power
        longer = {"size": COARSE * scale, "joint": {"radius": scale, "clearance": 0.005 * scale}}
        yield _case(f"lengths times 1e{power}", elastic, **longer)
        yield _case(f"moduli times 1e{power}", elastic, **both(E=E * scale, nu=0.3))
        bodies = both(E=E * scale, nu=0.3, yield_stress=0.002 * scale)
        yield _case(f"both times 1e{power}, plastic", plastic, **longer, **bodies)
    yield _case("plastic, E* = R = 1", fine(0.01), yield_stress=0.002)


def _pairs() -> Iterable[Case]:
    circles, thin = "P/dR of concentric circles", "dR/R = 1e-6"
    yield _case(f"{thin}, rigid pin", size=0.04, joint=THIN, **RIGID)
    yield _case(f"{thin}, E_pin/E_block = 1e6", same_as(f"{thin}, rigid pin", 0.01, "a rigid pin"), size=0.04,
                joint=THIN, **moduli(1e6))  # fmt: skip
    yield _case(f"{thin}, E_pin/E_block = 1e-6", same_as("E_pin/E_block = 1e-6", 0.02, circles, SCALED), joint=THIN,
                **moduli(1e-6))  # fmt: skip
    yield _case(f"{thin}, one step", same_as(thin, 1e-6, "elastic: any path"), joint=THIN, load=ONE_STEP)
    yield _case(f"{thin}, nu = 0.4999", same_as("nu = 0.4999", 0.02, "P goes with dR", SCALED), joint=THIN,
                **poisson(0.4999))  # fmt: skip
    yield _case(f"{thin}, gamma factor 1e4", same_as(thin, 0.002, "gamma factor 0.5"), joint=THIN, **gamma(1e4))
    yield _case(f"{thin}, sigY/E* = 4e-7", same_as("plastic, E* = R = 1", 0.01, "P/dR, sigY/dR", SCALED),
                yield_stress=4e-7, joint=THIN)  # fmt: skip
    yield _case(f"{thin}, by force", fine(0.005, "delta/dR"), joint=THIN, load=by_force(2.5650e-6, 1))
    yield _case("dR/R = 1e-4, pin:block = 20:1", fine(0.02), size=0.005, joint={"clearance": 1e-4, "size_ratio": 20.0})
    yield _case(f"{thin}, lengths times 1e-9", same_as(thin, 1e-6, "other units"), size=1e-10,
                joint={"radius": 1e-9, "clearance": 1e-15})  # fmt: skip
    yield _case("dR/R = 0.5, rigid pin", joint={"clearance": 0.5}, load={"displacement": 0.2}, **RIGID)
    yield _case("nu = 0.4999, gamma factor 1e4", same_as("nu = 0.4999", 0.002, "gamma factor 0.5"), **gamma(1e4),
                **poisson(0.4999))  # fmt: skip
    yield _case("nu = 0.4999, E_pin/E_block = 1e6", same_as("nu = 0.4999, rigid pin", 0.005, "a rigid pin"),
                **moduli(1e6, 0.4999))  # fmt: skip
    yield _case("nu = 0.4999, plastic, one step", same_as("nu = 0.499, plastic", 0.02, "nu = 0.499"), budget=1000,
                load=ONE_STEP, **poisson(0.4999, yield_stress=0.002))  # fmt: skip
    yield _case("nu = 0.499, E_pin/E_block = 1e-6, one step", load=ONE_STEP, **moduli(1e-6, 0.499))
    yield _case("gamma factor 1e4, plastic, one step", fine(0.02), yield_stress=0.002, load=ONE_STEP, **gamma(1e4))
    yield _case("gamma factor 1e4, rigid pin", same_as("rigid pin", 0.002, "gamma factor 0.5"), size=0.03,
                **gamma(1e4), **RIGID)  # fmt: skip
    yield _case("pin:block = 20:1, E_pin/E_block = 1e-6", size=0.01, joint={"size_ratio": 20.0}, **moduli(1e-6))
    yield _case("pin:block = 1:20, E_pin/E_block = 1e6", size=0.2, joint={"size_ratio": 0.05}, **moduli(1e6))
    weak = moduli(1e4)
    weak["block"] |= {"yield_stress": 1e-3}
    yield _case("E_pin/E_block = 1e4, plastic block", fine(0.01), steps=8, budget=600, **weak)
    yield _case("delta/dR = 20, sigY/E* = 0.01", fine(0.02), budget=1000, yield_stress=0.01,
                joint={"clearance": 0.001}, load={"displacement": 20.0, "steps": 10})  # fmt: skip


_GROUPS = {
    "modulus ratio": _modulus_ratio,
    "Poisson's ratio": _poisson,
    "clearance": _clearance,
    "ring": _ring,
    "load": _load,
    "one step": _one_step,
    "yield stress": _yield_stress,
    "limit load": _limit_load,
    "mesh": _mesh,
    "gamma factor": _gamma_factor,
    "units": _units,
    "pairs": _pairs,
}


def cases() -> dict[str, Case]:
    """All cases by name, in the order of the table. Raises ValueError if two have the same name."""
    found = [replace(case, group=group) for group, part in _GROUPS.items() for case in part()]
    table = {case.name: case for case in found}
    if len(table) < len(found):
        raise ValueError("two cases of the stability benchmark have the same name")
    return table

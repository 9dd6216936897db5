"""``archord margin``: margins of safety of a lug, of the parts of a clevis or of any body."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from archord.commands.options import argument


@click.command()
@argument("folder", "RUN", "folder of a run of a [lug], a [clevis] or any bodies")
@click.option(
    "--load", type=float, required=True, metavar="P", help="force on the whole, as in history.csv"
)
@click.option(
    "--part", "--plate", metavar="NAME", help="inner, outer or pin of a clevis, or a body [all]"
)
@click.option(
    "--factor", type=float, default=1.0, help="ultimate load over P: 1.5 if P is a limit load"
)
@click.option(
    "--proof", type=float, metavar="STRESS", help="0.2 % proof strength [of the run's curve]"
)
@click.option(
    "--tensile", type=float, metavar="STRESS", help="tensile strength [of the run's curve]"
)
@click.option(
    "--yield-peeq", type=float, default=0.01, help="largest PEEQ of the lug at its yield load"
)
@click.option(
    "--ultimate-peeq", type=float, help="at its ultimate load [end of the hardening table]"
)
def margin(folder: Path, load: float, part: str | None, **asked: Any) -> int:
    """Print the margins of safety of a lug, of the parts of a clevis or of bodies that yield, under
    a force: yield and ultimate, by hand formulas (net section, bearing, shear-out; a pin's shear
    and bending) and by finite elements. A body of your own mesh has no hand formulas.
    """
    from archord.postprocess.judgement.margin import margin_text, margins
    from archord.postprocess.judgement.parts import parts_of
    from archord.postprocess.run import Run
    from archord.report.errors import InputError

    run = Run(folder)
    parts = parts_of(run)
    # An elastic pin has no strength of its own, and is judged if it is asked for.
    known = [name for name in parts if name != "pin" or parts[name].body.yield_stress is not None]
    names = [part] if part else known
    strengths = [f"--{name}" for name in ("proof", "tensile") if asked[name] is not None]
    if len(names) > 1 and strengths:
        raise InputError(strengths[0], f"is the strength of one part; say --part {names[0]}.")
    found = [margins(run, load, part=name, **asked) for name in names]
    print("\n\n".join(margin_text(one) for one in found))
    return 0

"""``archord margin``: margins of safety of a lug or of the plates of a clevis."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from archord.commands.options import argument


@click.command()
@argument("folder", "RUN", "folder of a run of a [lug] or a [clevis]")
@click.option(
    "--load", type=float, required=True, metavar="P", help="force on the whole, as in history.csv"
)
@click.option("--plate", type=click.Choice(["inner", "outer"]), help="of a clevis [both plates]")
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
def margin(folder: Path, load: float, plate: str | None, **asked: Any) -> int:
    """Print the margins of safety of a lug, or of the plates of a clevis, under a force: yield and
    ultimate, by hand formulas (net section, bearing, shear-out) and by finite elements.
    """
    from archord.postprocess.judgement.margin import margin_text, margins, plates_of
    from archord.postprocess.run import Run
    from archord.report.errors import InputError

    run = Run(folder)
    plates = [plate] if plate else plates_of(run)
    strengths = [f"--{name}" for name in ("proof", "tensile") if asked[name] is not None]
    if len(plates) > 1 and strengths:
        raise InputError(
            f"{strengths[0]}: is the strength of one plate; say --plate inner or --plate outer."
        )
    found = [margins(run, load, plate=name, **asked) for name in plates]
    print("\n\n".join(margin_text(one) for one in found))
    return 0

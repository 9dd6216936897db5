"""``archord margin``: margins of safety of a lug."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from archord.options import argument


@click.command()
@argument("folder", "RUN", "folder of a run of a [lug]")
@click.option("--load", type=float, required=True, metavar="P", help="force on the lug, in the unit of history.csv")
@click.option("--factor", type=float, default=1.0, help="ultimate load over P: 1.5 if P is a limit load")
@click.option("--proof", type=float, metavar="STRESS", help="0.2 % proof strength [of the run's curve]")
@click.option("--tensile", type=float, metavar="STRESS", help="tensile strength [of the run's curve]")
@click.option("--yield-peeq", type=float, default=0.01, help="largest PEEQ of the lug at its yield load")
@click.option("--ultimate-peeq", type=float, help="at its ultimate load [end of the hardening table]")
def margin(folder: Path, load: float, **asked: Any) -> int:
    """Print the margins of safety of a lug under a force: yield and ultimate, by hand formulas (net section, bearing,
    shear-out) and by finite elements.
    """
    from archord.postprocess.margin import margin_text, margins
    from archord.postprocess.run import Run

    print(margin_text(margins(Run(folder), load, **asked)))
    return 0

"""Contact laws in the words of a scene: their names, and the parameters of each."""

from __future__ import annotations

from archord.report.by_name import ByName
from archord.scene.sections.keys import require

# The parameters of each law, with their meaning. They are positive numbers, by the names of the
# class's own, which is in solver/contact/laws/named.py.
CONTACT_LAWS = {
    "frictionless": {},
    "coulomb": {},
    "tied": {},
    "exponential": {
        "pressure": "pressure at gap 0",
        "clearance": "gap at which the pressure begins",
    },
}
PARAMETERS_IN_WORDS = "; ".join(
    f"{name}: " + ", ".join(f"{key} ({said})" for key, said in parameters.items())
    for name, parameters in CONTACT_LAWS.items()
    if parameters
)


def require_parameters(law: str, given: ByName) -> None:
    """Raise `Fault` unless the parameters ``given`` are just the ones of the ``law``."""
    wanted = CONTACT_LAWS[law]
    said = f"must be {{{', '.join(wanted)}}}" if wanted else "are not"
    require(given.keys() == wanted.keys(), "parameters", f'{said} for law = "{law}"')

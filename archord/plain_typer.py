"""typer without rich, which it loads wherever it is installed: 0.1 s of every run for colours in help pages, which are
plain here."""

import sys

_blocked = "rich" not in sys.modules
if _blocked:
    sys.modules["rich"] = None  # type: ignore[assignment]  # what Python itself puts where an import must fail
import typer  # noqa: E402

if _blocked:
    del sys.modules["rich"]

__all__ = ["typer"]

"""The pages as a site: ``python3 -m sphinx -W docs runs/site``, with Sphinx, MyST and Furo (`pip
install .[docs]`)."""

from __future__ import annotations

import importlib.util
import re
import shutil
from pathlib import Path

import archord

project, author, version = "archord", "the authors of archord", archord.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["cluster", "figures"]
html_theme, html_title, html_show_copyright = "furo", f"archord {version}", False
html_static_path, html_css_files = ["_static"], ["code.css"]
html_theme_options = {
    "light_css_variables": {"code-font-size": "0.7rem"}
}  # 100 characters in a column
myst_heading_anchors = 4  # as on GitHub
default_role = "code"
autodoc_default_options = {
    "members": True,
    "member-order": "bysource",
    "exclude-members": "model_config",
}
autodoc_typehints = "none"  # docstrings tell shapes and units; types are in the source
maximum_signature_line_length, smartquotes = 100, False
# What solves is documented without being installed, too.
autodoc_mock_imports = [
    name
    for name in ("dolfinx", "petsc4py", "mpi4py", "gmsh", "basix", "ufl")
    if importlib.util.find_spec(name) is None
]


def pages_above(app: object, name: str, source: list[str]) -> None:
    """Put a page of the folder above, with links from here, in front of the one that stands for
    it."""
    if above := {"index": "README.md", "contributing": "CONTRIBUTING.md"}.get(name):
        text = Path(__file__).parents[1].joinpath(above).read_text(encoding="utf-8")
        text = re.sub(r"\]\((?!https?:|#)", "](../", text).replace("](../docs/", "](")
        source[0] = (
            text.replace("](../CONTRIBUTING.md", "](contributing.md")
            + source[0].partition("---\n")[2]
        )


def link_law(app: object, name: str, source: list[str]) -> None:
    """Lead links to law.html, whose name a page has, to its copy."""
    copy = r'<a href="law_page.html">\1</a>'
    source[0] = re.sub(r"\[([^\]]*)\]\(law\.html\)", copy, source[0])


def copy_law(app: object, error: Exception | None) -> None:
    """Add the page that computes the law to the site."""
    if error is None and app.builder.format == "html":
        shutil.copy(Path(__file__).with_name("law.html"), Path(app.outdir) / "law_page.html")


def setup(app: object) -> None:
    """Sphinx calls this."""
    app.connect("source-read", pages_above)
    app.connect("source-read", link_law)
    app.connect("build-finished", copy_law)

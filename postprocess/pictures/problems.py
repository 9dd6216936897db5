"""What a run of any problem looks like, a panel each: field on the bodies, pressure on surfaces,
force of the loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from archord.materials.kinematics import Bools
from archord.materials.material import Array
from archord.output.cell_fields import row_of
from archord.postprocess.arrays.fields import Fields
from archord.postprocess.pictures.abscissa import abscissa
from archord.postprocess.probes.probe import Probe
from archord.postprocess.run import Run
from archord.report.by_name import ByName
from archord.report.errors import InputError

# largest displacement over the size of the bodies, as drawn, where nothing touches
_MAGNIFIED = 0.05
_STYLES = ("-", "--", ":", "-.")  # of surfaces
_ELASTIC = "0.93"  # grey of what has no plastic strain
_UNLOADED = 1e-3  # of the largest force of a run: what is left after unloading
OF_PEEQ = "inferno_r"  # its map of colours
HARDLY = 0.01  # of the largest PEEQ: what has not yielded, or hardly
_CONSTANT = 1e-9  # relative range of a field without a scale of colours
# fields of edges alone
OF_EDGES = ("hoop", "normal", "shear", "facet_pressure", "gap", "contact_shear")
_FIELDS = {"stress": "von_mises", "pressure": "contact_pressure"}  # short names
_ALONG = {  # short names along edges
    "stress": "von_mises",
    "pressure": "facet_pressure",
    "contact_pressure": "facet_pressure",
}
_NAMED = {  # what fields are called that are no rows of `CELL_FIELDS`, and their units
    "displacement": ("displacement", "{length}"),
    "ux": ("displacement in {0}", "{length}"),
    "uy": ("displacement in {1}", "{length}"),
    "uz": ("displacement in {2}", "{length}"),
    "principal_angle": ("angle of the first principal stress", "rad"),
    "p1": ("p1", "{stress}"),
    "p2": ("p2", "{stress}"),
    "p3": ("p3", "{stress}"),
}
# points of a parabola from the nodes of an edge
_EDGE = np.array(
    [
        [1.0, 0.0, 0.0],
        [0.375, 0.75, -0.125],
        [0.0, 1.0, 0.0],
        [-0.125, 0.75, 0.375],
        [0.0, 0.0, 1.0],
    ]
)


def field_panel(axes: Any, run: Run, step: int | None = None, field: str = "") -> None:
    """`draw_field` at ``step`` (see `shown_step`) on the deformed bodies, with their outlines;
    displacements are magnified by the factor in the title, and not where bodies may touch, as they
    would then overlap."""
    fields = run.fields(step or shown_step(run))
    size = np.ptp(fields.coordinates, axis=0).max()
    farthest = np.abs(fields.displacement).max()
    factor = 1.0
    if farthest > 0 and not run.has_contact:
        wanted = _MAGNIFIED * size / farthest
        factor = max(float(f"{wanted:.0e}"), 1.0)
    x = fields.coordinates + factor * fields.displacement
    everywhere = np.ones(len(fields.cells), dtype=bool)
    draw_field(axes, run, fields, x, everywhere, everywhere, field)
    draw_outline(axes, fields, x, color="black", lw=0.8)
    frame(axes, run)
    what = "not magnified" if factor == 1 else f"displacement × {factor:g}"
    axes.set_title(f"{step_words(run, fields.step)}\n{what}", fontsize="medium")


def frame(axes: Any, run: Run) -> None:
    """Name the coordinates of a panel that shows the bodies."""
    across, up = run.kinematics.axes
    length = run.scene.units.length
    axes.set(aspect="equal", xlabel=f"{across} [{length}]", ylabel=f"{up} [{length}]")


def shown_step(run: Run) -> int:
    """The step that a picture shows if none is asked for: the last one, but of a run that was
    unloaded by then the one with the largest load."""
    last = run.number(None)
    sizes = np.zeros(last)
    for column in run.view.forces.values():
        force = np.abs(np.nan_to_num(run.columns[column]))
        if force.any():
            sizes = np.maximum(sizes, force / force.max())
    return last if sizes[-1] > _UNLOADED else int(sizes.argmax()) + 1


def shown_steps(run: Run) -> list[int]:
    """Up to four steps for curves, evenly spaced, with the last one and `shown_step`."""
    last = run.number(None)
    steps = {max(1, round(last * share)) for share in (0.25, 0.5, 0.75, 1.0)}
    return sorted(steps | {shown_step(run)})


def step_words(run: Run, step: int) -> str:
    """A step and its load, for titles and legends."""
    return f"step {step} of {run.steps}, load factor {run.path[step - 1]:.4g}"


def draw_field(
    axes: Any,
    run: Run,
    fields: Fields,
    x: Array,
    shown: Bools,
    ranged: Bools,
    field: str = "",
) -> None:
    """A ``field`` in the ``shown`` cells ``(m,)`` with the nodes at ``x``: by default PEEQ, grey
    where there is none, or von Mises stress where nothing has yielded; the colours end at the
    largest of the ``ranged`` cells.

    Means of cells are drawn cell by cell, values of nodes smoothly. Where all values are the same
    there is no scale of colours, but a sentence. Raises `InputError` for a field that the run does
    not have.
    """
    values, label, usual = field_values(run, fields, field)
    of_cells = len(values) == len(fields.cells)
    in_cells = values if of_cells else values[fields.cells]
    triangles = fields.triangles[shown]
    flat = triangles.reshape(-1, 3)
    known = in_cells[ranged]
    known = known[np.isfinite(known)]
    said = _without_colours(known)
    if said:
        axes.tripcolor(*x.T, flat, facecolors=np.zeros(len(flat)), cmap=_plain())
        place = {"transform": axes.transAxes, "ha": "center", "fontsize": "small"}
        axes.text(0.5, 0.02, f"{label}: {said}", **place)
        return
    colours = colours_for(known, usual)
    style = {"cmap": colours.map, "vmin": colours.low, "vmax": colours.high}
    if of_cells:
        grey = np.isnan(in_cells) | (in_cells == 0)
        coloured = np.where(grey, np.nan, in_cells)
        of_triangles = np.repeat(coloured[shown], triangles.shape[1])
        drawn = axes.tripcolor(*x.T, flat, facecolors=of_triangles, **style)
    else:
        drawn = axes.tripcolor(*x.T, flat, values, shading="gouraud", **style)
        if usual == OF_PEEQ:  # whose mask tripcolor does not take
            drawn.set_array(np.ma.masked_less_equal(values, HARDLY * known.max()))
    extend = colours.cut(in_cells[shown])
    axes.figure.colorbar(drawn, ax=axes, label=label, shrink=0.85, extend=extend)


def field_values(run: Run, fields: Fields, field: str) -> tuple[Array, str, str]:
    """A ``field`` of the nodes ``(n,)``, or of the cells ``(m,)`` if nodes have none, in the unit
    of its label, the label, and the usual map of its colours: by default PEEQ, or von Mises stress
    where nothing has yielded. Raises `InputError` for a field that the run does not have."""
    yielded = fields.peeq is not None and fields.peeq.any()
    name = _FIELDS.get(field, field) or ("peeq" if yielded else "von_mises")
    label, scale = field_words(run, name)
    values = scale * _values(run, fields, name)
    return values, label, OF_PEEQ if name == "peeq" else "viridis"


def _without_colours(known: Array) -> str:
    """What is said in place of a scale of colours; nothing where the ``known`` values differ."""
    if not len(known):
        return "no finite number"
    largest = np.abs(known).max()
    if np.ptp(known) <= _CONSTANT * largest:
        return f"{known[0]:.4g} everywhere"
    return ""


class Colours(NamedTuple):
    """A scale of colours ``map`` from ``low`` to ``high``."""

    map: Any
    low: float
    high: float

    def cut(self, values: Array) -> str:
        """At which ends the ``values`` go beyond the scale, as matplotlib says it."""
        above = bool(np.nanmax(values, initial=self.low) > self.high)
        below = bool(np.nanmin(values, initial=self.high) < self.low)
        if above and below:
            return "both"
        if above:
            return "max"
        return "min" if below else "neither"


def colours_for(known: Array, usual: str) -> Colours:
    """The colours of the ``known`` values: the ``usual`` map, or one with 0 in its middle where
    values have both signs."""
    low = float(known.min(initial=0.0))
    high = float(known.max(initial=0.0))
    if high > 0 and low < -_CONSTANT * high:
        largest = max(-low, high)
        return Colours(_with_grey("RdBu_r"), -largest, largest)
    return Colours(_with_grey(usual), low, high)


def _with_grey(name: str) -> Any:
    from matplotlib import colormaps

    return colormaps[name].with_extremes(bad=_ELASTIC)


def _plain() -> Any:
    from matplotlib.colors import ListedColormap

    return ListedColormap([_ELASTIC])


def _values(run: Run, fields: Fields, name: str) -> Array:
    """A field of the nodes ``(n,)`` or else of the cells ``(m,)``. Raises `InputError`."""
    moved = {"displacement": np.linalg.norm(fields.displacement, axis=1)}
    for axis, along in zip("xyz", fields.displacement.T, strict=False):
        moved[f"u{axis}"] = along
    means = {name: values for name, values in fields.cell.items() if values.ndim == 1}
    known = means | fields.nodal_fields() | moved
    if name not in known:
        names = ", ".join(dict.fromkeys([*_FIELDS, *known]))
        raise InputError(run.folder, f"has no field {name!r}; its fields are {names}.")
    return known[name]


def field_words(run: Run, name: str) -> tuple[str, float]:
    """What a field is called on an axis, with its unit, and the factor to that unit."""
    said, unit = _NAMED.get(name, (name.replace("_", " "), ""))
    row = row_of(name)
    if row:
        unit = row.unit
        if name == row.name:
            said = row.label
    said = said.format(*run.kinematics.axes)
    if not unit:
        return said, 1.0
    unit_name = unit.format(**run.scene.units.model_dump())
    return f"{said} [{unit_name}]", 100.0 if unit == "%" else 1.0


def draw_outline(axes: Any, fields: Fields, x: Array, **style: Any) -> None:
    """The boundary of the bodies with the nodes at ``x``, every edge a parabola; it leaves the
    limits as they are."""
    from matplotlib.collections import LineCollection

    parabolas = _EDGE @ x[fields.outline()]
    axes.add_collection(LineCollection(list(parabolas), **style), autolim=False)


def contact_panel(axes: Any, run: Run, steps: Sequence[int] = ()) -> None:
    """Mean contact pressure of each facet at ``steps`` (up to four), over the angle where all
    surfaces are arcs: the colour tells the step, the style the surface. Ties can be in tension."""
    edge_panel(axes, run, list(run.contact()), "facet_pressure", steps)
    unit = run.scene.units.stress
    axes.set(title="contact pressure", ylabel=f"pressure [{unit}]")
    if all(part.law != "tied" for part in run.scene.interaction):
        axes.set(ylim=(0, None))


def edge_panel(
    axes: Any, run: Run, edges: Sequence[str], quantity: str, steps: Sequence[int]
) -> None:
    """A ``quantity`` of `Run.probe` (the hoop stress) along ``edges`` at ``steps`` (up to four).
    Raises `InputError`."""
    name = _ALONG.get(quantity, quantity)
    probes = []
    styles = []
    for k, step in enumerate(steps or shown_steps(run)):
        for j, edge in enumerate(edges):
            probes.append(run.probe(edge, name, step))
            style = {"color": f"C{k}", "ls": _STYLES[j % len(_STYLES)]}
            if j == 0:  # a colour has its step in the legend, a style its edge
                style["label"] = f"step {step}"
            styles.append(style)
    if len(edges) > 1:
        for edge, style in zip(edges, styles, strict=False):
            axes.plot([], [], color="black", ls=style["ls"], lw=1.3, label=edge)
    draw_probes(axes, probes, styles)
    shown = probes[0].quantity.replace("_", " ")
    axes.set_title(f"{shown} along {', '.join(edges)}", fontsize="medium")


def draw_probes(axes: Any, probes: Sequence[Probe], styles: Sequence[ByName]) -> None:
    """Quantities over their `abscissa`, each in its style."""
    places, label = abscissa(probes)
    for probe, along, style in zip(probes, places, styles, strict=True):
        order = np.argsort(along, kind="stable")
        axes.plot(along[order], probe.values[order], lw=1.3, **style)
    first = probes[0]
    axes.set(xlabel=label, ylabel=f"{first.quantity.replace('_', ' ')} [{first.unit or '-'}]")
    axes.legend(frameon=False, fontsize="small")
    axes.grid(alpha=0.3)


def load_panel(axes: Any, run: Run) -> None:
    """Force over displacement of every load; with units on the axes where all loads have the
    same."""
    units = {}
    for name, column in run.view.forces.items():
        units[name] = (run.units.get(f"{name} displacement", "-"), run.units.get(column, "-"))
    one = len(set(units.values())) == 1
    for name, column in run.view.forces.items():
        of_displacement, of_force = units[name]
        own = "" if one else f" [{of_force} over {of_displacement}]"
        displacement = [0, *run.columns[f"{name} displacement"]]
        force = [0, *run.columns[column]]
        axes.plot(displacement, force, ".-", ms=5, label=f"{name}{own}")
    along, up = next(iter(units.values())) if one else ("", "")
    axes.set(
        xlabel=f"displacement [{along}]" if one else "displacement",
        ylabel=f"force [{up}]" if one else "force",
        title="loads",
    )
    axes.legend(frameon=False)
    axes.locator_params("x", nbins=6)
    axes.grid(alpha=0.3)

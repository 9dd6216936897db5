"""What a run of any problem looks like, a panel each: field on the bodies, pressure on surfaces,
force of the loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from archord.materials.material import Array
from archord.postprocess.fields import Fields
from archord.postprocess.probe import Probe
from archord.postprocess.run import Run
from archord.scene.errors import InputError

_MAGNIFIED = (
    0.05  # largest displacement over the size of the bodies, as drawn, where nothing touches
)
_STYLES = ("-", "--", ":", "-.")  # of surfaces
_ELASTIC = "0.93"  # grey of what has no plastic strain
_UNLOADED = 1e-3  # of the largest force of a run: what is left after unloading
_CONSTANT = 1e-9  # relative range of a field without a scale of colours
OF_EDGES = (
    "hoop",
    "normal",
    "shear",
    "facet_pressure",
    "gap",
    "contact_shear",
)  # fields of edges alone
_ALONG = {
    "stress": "von_mises",
    "pressure": "facet_pressure",
    "contact_pressure": "facet_pressure",
}  # along edges
_FIELDS = {"stress": "von_mises", "pressure": "contact_pressure"}  # short names
_NAMED = {  # what fields are called, and their units
    "von_mises": ("von Mises stress", "{stress}"),
    "mean_stress": ("mean stress", "{stress}"),
    "peeq": ("equivalent plastic strain", "%"),
    "contact_state": ("share of the edge in contact", "-"),
    "contact_pressure": ("contact pressure", "{stress}"),
    "displacement": ("displacement", "{length}"),
    "ux": ("displacement in x", "{length}"),
    "uy": ("displacement in y", "{length}"),
    "principal_angle": ("angle of the first principal stress", "rad"),
}
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
    """`draw_field` at ``step`` (that of `shown_step`) on the deformed bodies, with their outlines;
    displacements are magnified by the factor in the title, and not where bodies may touch, as they
    would then overlap."""
    fields, length = run.fields(step or shown_step(run)), run.scene.units.length
    size, farthest = np.ptp(fields.coordinates, axis=0).max(), np.abs(fields.displacement).max()
    free = not run.has_contact and farthest > 0
    factor = max(float(f"{_MAGNIFIED * size / farthest:.0e}"), 1.0) if free else 1.0
    x, everywhere = (
        fields.coordinates + factor * fields.displacement,
        np.ones(len(fields.cells), dtype=bool),
    )
    draw_field(axes, run, fields, x, everywhere, everywhere, field)
    draw_outline(axes, fields, x, color="black", lw=0.8)
    axes.set(aspect="equal", xlabel=f"x [{length}]", ylabel=f"y [{length}]")
    what = "not magnified" if factor == 1 else f"displacement × {factor:g}"
    axes.set_title(f"{step_words(run, fields.step)}\n{what}", fontsize="medium")


def shown_step(run: Run) -> int:
    """The step that a picture shows if none is asked for: the last one, but of a run that was
    unloaded by then the one with the largest load."""
    loads = ["P"] if run.is_joint else [f"{load.name} force" for load in run.scene.load]
    last = run.number(None)
    sizes: Array = np.zeros(last)
    for name in loads:
        force = np.abs(np.nan_to_num(run.columns[name]))
        largest = force.max()
        if largest > 0:
            sizes = np.maximum(sizes, force / largest)
    return last if sizes[-1] > _UNLOADED else int(sizes.argmax()) + 1


def shown_steps(run: Run, number: int = 4) -> list[int]:
    """Up to ``number`` steps for curves, evenly spaced, with the last one and `shown_step`."""
    last = run.number(None)
    steps = {max(1, round(last * k / number)) for k in range(1, number + 1)}
    return sorted(steps | {shown_step(run)})


def step_words(run: Run, step: int) -> str:
    """A step and its load, for titles and legends."""
    return f"step {step} of {run.steps}, load factor {run.path[step - 1]:.4g}"


def draw_field(
    axes: Any,
    run: Run,
    fields: Fields,
    x: Array,
    shown: np.ndarray,
    ranged: np.ndarray,
    field: str = "",
) -> None:
    """A ``field`` in the ``shown`` cells ``(m,)`` with the nodes at ``x``: by default PEEQ, grey
    where there is none, or von Mises stress where nothing has yielded; the colours end at the
    largest of the ``ranged`` cells.

    Means of cells are drawn cell by cell, values of nodes smoothly. Where all values are the same
    there is no scale of colours, but a sentence. Raises `InputError` for a field that the run does
    not have.
    """
    yielded = fields.peeq is not None and fields.peeq.any()
    name = _FIELDS.get(field, field) or ("peeq" if yielded else "von_mises")
    values = _values(run, fields, name)
    label, scale = field_words(run, name)
    values = scale * values
    of_cells = len(values) == len(fields.cells) and name in fields.cell_fields()
    cell_values = values if of_cells else values[fields.cells].mean(axis=1)
    finite = np.isfinite(cell_values)
    triangles = fields.triangles[shown]
    known = cell_values[ranged & finite]
    low = float(known.min(initial=0.0))
    high = float(known.max(initial=0.0))
    constant = bool(len(known)) and np.ptp(known) <= _CONSTANT * max(abs(low), abs(high))
    if constant or not len(known):
        axes.tripcolor(
            *x.T,
            triangles.reshape(-1, 3),
            facecolors=np.zeros(triangles[..., 0].size),
            cmap=_plain(),
        )
        said = f"{label}: {known[0]:.4g} everywhere" if constant else f"{label}: no finite number"
        axes.text(0.5, 0.02, said, transform=axes.transAxes, ha="center", fontsize="small")
        return
    signed = low < -_CONSTANT * high
    if signed:
        low, high = (-max(-low, high), max(-low, high)) if high > 0 else (low, high)
    cmap = _colours(
        "RdBu_r" if signed and high > 0 else "viridis" if name != "peeq" else "inferno_r"
    )
    style = {"cmap": cmap, "vmin": low, "vmax": high}
    if of_cells:
        grey = np.isnan(cell_values) | (cell_values == 0)
        coloured = np.repeat(np.where(grey, np.nan, cell_values)[shown], triangles.shape[1])
        drawn = axes.tripcolor(*x.T, triangles.reshape(-1, 3), facecolors=coloured, **style)
    else:
        drawn = axes.tripcolor(*x.T, triangles.reshape(-1, 3), values, shading="gouraud", **style)
    above = np.nanmax(cell_values[shown], initial=low) > high
    below = np.nanmin(cell_values[shown], initial=high) < low
    cut = {(True, True): "both", (True, False): "max", (False, True): "min"}.get(
        (bool(above), bool(below)), "neither"
    )
    axes.figure.colorbar(drawn, ax=axes, label=label, shrink=0.85, extend=cut)


def _colours(name: str) -> Any:
    from matplotlib import colormaps

    return colormaps[name].with_extremes(bad=_ELASTIC)


def _plain() -> Any:
    from matplotlib.colors import ListedColormap

    return ListedColormap([_ELASTIC])


def _values(run: Run, fields: Fields, name: str) -> Array:
    """A field of the cells ``(m,)`` or else of the nodes ``(n,)``. Raises `InputError`."""
    u = fields.displacement
    moved = {"displacement": np.hypot(*u.T), "ux": u[:, 0], "uy": u[:, 1]}
    known = fields.nodal_fields() | moved | fields.cell_fields()
    if name not in known:
        names = ", ".join(dict.fromkeys([*_FIELDS, *known]))
        raise InputError(f"{run.folder}: has no field {name!r}; its fields are {names}.")
    return known[name]


def field_words(run: Run, name: str) -> tuple[str, float]:
    """What a field is called on an axis, with its unit, and the factor to that unit."""
    units = run.scene.units
    if name in _NAMED:
        said, unit = _NAMED[name]
        return f"{said} [{unit.format(**units.model_dump())}]", 100.0 if "%" in unit else 1.0
    if name.startswith("plastic_strain"):
        return f"{name.replace('_', ' ')} [%]", 100.0
    return f"{name.replace('_', ' ')} [{units.stress}]", 1.0


def draw_outline(axes: Any, fields: Fields, x: Array, **style: Any) -> None:
    """The boundary of the bodies with the nodes at ``x``, every edge a parabola; it leaves the
    limits as they are."""
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(_EDGE @ x[fields.outline()]), **style), autolim=False)


def contact_panel(axes: Any, run: Run, steps: Sequence[int] = ()) -> None:
    """Mean contact pressure of each facet at ``steps`` (up to four), over the angle where all
    surfaces are arcs: the colour is that of the step, the style that of the surface."""
    edge_panel(axes, run, list(run.contact()), "facet_pressure", steps)
    axes.set(
        title="contact pressure", ylabel=f"pressure [{run.scene.units.stress}]", ylim=(0, None)
    )


def edge_panel(
    axes: Any, run: Run, edges: Sequence[str], quantity: str = "", steps: Sequence[int] = ()
) -> None:
    """A ``quantity`` of `Run.probe` (the hoop stress) along ``edges`` at ``steps`` (up to four).
    Raises `InputError`."""
    shown = list(steps) or shown_steps(run)
    name = _ALONG.get(quantity, quantity)
    probes = [run.probe(edge, name, step) for step in shown for edge in edges]
    # a colour has its step in the legend, a style its edge
    of_first = {probe.step: f"step {probe.step}" for probe in probes[:: len(edges)]}
    labels = [of_first.pop(probe.step, "") for probe in probes]
    dashes = [_STYLES[j % len(_STYLES)] for j in range(len(edges))]
    styles = [{"color": f"C{k}", "ls": dash} for k in range(len(shown)) for dash in dashes]
    if len(edges) > 1:
        for edge, dash in zip(edges, dashes, strict=True):
            axes.plot([], [], color="black", ls=dash, lw=1.3, label=edge)
    draw_probes(axes, probes, labels, run.scene.units.length, styles)
    axes.set_title(
        f"{probes[0].quantity.replace('_', ' ')} along {', '.join(edges)}", fontsize="medium"
    )


def draw_probes(
    axes: Any,
    probes: Sequence[Probe],
    labels: Sequence[str],
    length: str,
    styles: Sequence[dict[str, Any]] = (),
) -> None:
    """Quantities over the angle, or over the arc length in units of ``length`` where one of the
    edges is no arc."""
    angles = [probe.angle for probe in probes if probe.angle is not None]
    arcs = len(angles) == len(probes)
    for k, (probe, label) in enumerate(zip(probes, labels, strict=True)):
        along = angles[k] if arcs else probe.s
        order = np.argsort(along, kind="stable")
        axes.plot(
            along[order],
            probe.values[order],
            lw=1.3,
            label=label or None,
            **(styles[k] if styles else {}),
        )
    axes.set(xlabel="angle [°]" if arcs else f"arc length [{length}]")
    axes.set(ylabel=f"{probes[0].quantity.replace('_', ' ')} [{probes[0].unit or '-'}]")
    axes.legend(frameon=False, fontsize="small")
    axes.grid(alpha=0.3)


def load_panel(axes: Any, run: Run) -> None:
    """Force over displacement of every load; with units on the axes where all loads have the
    same."""
    pairs = [(f"{load.name} displacement", f"{load.name} force") for load in run.scene.load]
    units = {tuple(run.units.get(name, "-") for name in pair) for pair in pairs}
    one = len(units) == 1
    for load, (q, force) in zip(run.scene.load, pairs, strict=True):
        own = "" if one else f" [{run.units.get(force, '-')} over {run.units.get(q, '-')}]"
        axes.plot(
            [0, *run.columns[q]], [0, *run.columns[force]], ".-", ms=5, label=f"{load.name}{own}"
        )
    x, y = next(iter(units)) if one else ("", "")
    axes.set(xlabel=f"displacement [{x}]" if one else "displacement", title="loads")
    axes.set(ylabel=f"force [{y}]" if one else "force")
    axes.legend(frameon=False)
    axes.locator_params("x", nbins=6)
    axes.grid(alpha=0.3)

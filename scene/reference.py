"""What a scene file may hold, from the model of scenes: a commented example, and the reference
tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args, get_origin

from archord.materials.named import metals
from archord.report.by_name import ByName
from archord.report.table import Table
from archord.scene.parts import MeshSection
from archord.scene.presets.joint import FORMAT as JOINT_FORMAT
from archord.scene.presets.joint import Scene
from archord.scene.presets.known import PRESETS, SHAPES
from archord.scene.presets.preset import Preset
from archord.scene.problem import FORMAT, ProblemScene
from archord.scene.sections.bodies import Solid
from archord.scene.sections.errors import toml_value

_JOINT: ByName = {name: info for name, info in Scene.model_fields.items() if name != "format"}
_GENERAL: ByName = {
    name: info for name, info in ProblemScene.model_fields.items() if name != "format"
}
_GENERAL["mesh.circle"] = MeshSection.model_fields["circle"]
_PRESETS: dict[str, ByName] = {
    name: {
        section: info
        for section, info in scene.model_fields.items()
        if section not in Preset.model_fields or section in scene.__annotations__
    }
    for name, scene in PRESETS.items()
}
_SHAPED = {
    "pin": '`"half"`, `"whole"` or `"none"`, for a rigid disc',
    "rings": "list of [bore, outer] from the pin outward",
    "space": "a table with the keys of [space]",
    "core_radius": "ring: radius over R of the core that the force acts on",
}
_MEETING = (
    "### Sets that meet\n",
    "Supports, loads and rigid couplings may have nodes in common. The order of the sections does "
    "not matter. These rules hold:\n",
    "- A support wins over a displacement: its nodes stay, and a warning names the sets and a "
    "place.\n"
    "- A set that moves as one must not meet a support that bends it: an edge under a force, and a "
    "rigid coupling. The scene is refused, unless the set leaves the node at rest. Fix the same "
    "freedoms of the coupling, or load the set by a pressure or a distributing coupling.\n"
    "- A displacement is refused if supports hold every node of its set.\n"
    "- All other motions of a node must agree in value and path. Otherwise they are refused.\n"
    "- Supports that fix a node together have equal parts of its reaction.\n",
    "### Press fits\n",
    "Use `overlap` for a fit that the mesh shows: the surfaces cross in the mesh, such as a pin of "
    "radius 10.03 in a hole of radius 10. Use `interference` for a fit that the mesh does not "
    "show: the surfaces lie on one line in the mesh, such as a pin of radius 10 in a hole of "
    "radius 10, and archord makes the pin 0.03 too large.\n",
    "```text\n"
    "overlap = 0.03                     interference = 0.03\n"
    "\n"
    "  ------ edge of the pin, 10.03      ------ edge of the pin and edge of the hole, 10\n"
    "  ------ edge of the hole, 10\n"
    "```\n",
    "A fit that the mesh shows and that `interference` gives, too, would count twice: the scene is "
    "refused if both are of similar size.\n",
)
_SIGNS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
_KINDS = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true, false",
    "array": "list",
}


def example(general: bool = False) -> str:
    """A commented scene that shows every key, of a joint or a ``general`` one; alternatives and
    absent defaults are commented out."""
    sections, version = (_GENERAL, FORMAT) if general else (_JOINT, JOINT_FORMAT)
    text = (
        f"# An archord scene: archord solve scene.toml\n\nformat = {version}  # version of the "
        "scene format\n"
    )
    for section, info in sections.items():
        is_absent = not info.is_required() and info.get_default(call_default_factory=True) is None
        hidden = "# " if is_absent else ""
        text += f"\n{hidden}{_heading(section, info)}  # {info.description}\n"
        for name, key, schema in _keys(info):
            default = (
                ""
                if schema.get("default") is None
                else f", default {toml_value(schema['default'])}"
            )
            unit = f" [{schema['unit']}]" if schema["unit"] else ""
            comment = "# " if schema["hidden"] or is_absent else ""
            shown = f"{comment}{name} = {toml_value(schema['shown'])}"
            text += f"{shown}  # {key.description}{unit}{default}\n"
    return text


def reference() -> str:
    """All sections and keys as Markdown tables."""
    presets = " or ".join(_in_words(*preset) for preset in _PRESETS.items())
    parts = [
        "# Scene reference\n",
        "`archord scene --reference` prints this page. Any consistent set of units works. A scene "
        f"may begin with the version of its format: `format = {JOINT_FORMAT}` for a joint, and "
        f"`format = {FORMAT}` for a general scene. Scenes that archord writes have this line. A "
        "scene of a newer version is refused.\n",
        "## Joints\n",
        "A scene with the section `[joint]` describes a pin in a hole.\n",
        *_tables(_JOINT, {}),
        "## General scenes\n",
        "A scene with the section `[mesh]` is a general scene, with any bodies on any mesh. The "
        "sections units, stepping and output are the same as for joints. Headings in double "
        "brackets may be repeated.\n",
        *_tables(
            _GENERAL, {name: _JOINT[name] for name in ("units", "analysis", "stepping", "output")}
        ),
        *_shapes(),
        *_MEETING,
        "## Presets\n",
        f"A scene with {presets} stands for a general scene. `archord scene --expand` prints it. "
        "If a scene has several of these sections, the first one counts. The sections pin and "
        "space are the same as for joints. Plates, bushing, sleeves and housing have the same "
        "material keys. The other sections are the same as for general scenes.\n",
        *(
            table
            for sections in _PRESETS.values()
            for table in _tables(sections, _solids(sections))
        ),
        *_tables({"load": Preset.model_fields["load"]}, {}),
    ]
    return "\n".join(parts)


def _solids(sections: ByName) -> ByName:
    """The section of the block, with the keys of all materials, for each solid of ``sections``."""
    solid = [name for name, info in sections.items() if issubclass(_model_of(info), Solid)]
    return dict.fromkeys(solid, _JOINT["block"])


def _model_of(section: Any) -> Any:
    return next(iter(get_args(section.annotation)), section.annotation)


def _in_words(preset: str, sections: ByName) -> str:
    """The sections of a ``preset``, as the page names them."""
    others = [(_heading(name, info), info) for name, info in sections.items() if name != preset]
    needed = [f"`{heading}`" for heading, info in others if info.is_required()]
    possible = [f"perhaps `{heading}`" for heading, info in others if not info.is_required()]
    said = ", ".join(needed + possible)
    return f"`[{preset}]` (and {said})" if said else f"`[{preset}]`"


def _tables(sections: ByName, before: ByName) -> Iterator[str]:
    """Tables of the keys of ``sections``, without those that stood ``before``."""
    for section, info in sections.items():
        known = {}
        if section in before:
            known = {name: key.description for name, key, _ in _keys(before[section])}
        table = Table("key", "unit", "default", "allowed", "what")
        for name, key, schema in _keys(info):
            if known.get(name) != key.description:
                default = ""
                if schema.get("default") is not None:
                    default = f"`{toml_value(schema['default'])}`"
                if key.is_required():
                    default = "required"
                table.add(f"`{name}`", schema["unit"], default, _allowed(schema), key.description)
        if table.rows:
            also = ", also" if known else ""
            said = f"{info.description[0].upper()}{info.description[1:]}{also}.\n"
            yield from (f"### {_heading(section, info)}\n", said, table.markdown())


def _shapes() -> Iterator[str]:
    """The section of a mesh that a preset draws."""
    table = Table("kind", "has the keys of", "and")
    for name, shape in SHAPES.items():
        more = [f"`{key}`: {_SHAPED[key]}" for key in _SHAPED if key in shape.model_fields]
        table.add(f'`"{name}"`', f"[{name}]", "; ".join(more))
    yield "### [mesh.shape]\n"
    yield (
        "Instead of a file: the shape of a preset, as `archord scene --expand` prints it. Its "
        "`kind` decides which keys it has. `--set mesh.shape.radius=12.0` changes one key. The "
        "other sections do not follow the change. So change the `overlap` of an interaction, too, "
        "if you change a clearance below 0.\n"
    )
    yield table.markdown()


def _heading(section: str, info: Any) -> str:
    return f"[[{section}]]" if get_origin(info.annotation) is list else f"[{section}]"


def materials() -> str:
    """The metals that a scene may name, as a Markdown table; stresses in MPa."""
    table = Table(
        "name", "what", "E", "nu", "yield", "tensile", "hardens from", "to", "at PEEQ", "source"
    )
    for name, m in metals().items():
        _, first = m["hardening"][0]
        peeq, last = m["hardening"][-1]
        numbers = (m["E"], m["nu"], m["yield"], m["tensile"], first, last, peeq)
        values = [f"{value:g}" for value in numbers]
        table.add(f"`{name}`", m["title"], *values, m["source"])
    return table.markdown()


def _keys(section: Any) -> Iterator[tuple[str, Any, ByName]]:
    """Name, field and JSON schema of every key of a section."""
    model = _model_of(section)
    schemas = model.model_json_schema()["properties"]
    for name in sorted(schemas, key=lambda name: (name != "name", name not in ("E", "nu"))):
        if "unit" in schemas[name]:
            yield name, model.model_fields[name], schemas[name]


def _allowed(schema: ByName) -> str:
    """Type and limits of a key from its JSON schema, for a table."""
    kinds = [kind for part in schema.get("anyOf", [schema]) for kind in part.get("oneOf", [part])]
    one, *more = [s for s in kinds if s.get("type") != "null"]
    if "enum" in one:
        return ", ".join(f"`{toml_value(value)}`" for value in one["enum"])
    kind = " or ".join(_KINDS.get(s.get("type"), "table") for s in (one, *more))
    limits = [f"{sign} {one[limit]:g}" for limit, sign in _SIGNS.items() if limit in one]
    return f"{kind} {', '.join(limits)}".strip()

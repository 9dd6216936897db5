"""A joint's law as an FMU (FMI 2.0): the C header of the law, ``fmu.c`` around it, a description,
and a library for Linux where a C compiler is at hand.

The file depends on the law and the compiler alone: times within the archive are fixed, and the GUID
is a hash of the contents.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import subprocess
import tempfile
import uuid
import warnings
import zipfile
from dataclasses import dataclass, replace
from html import escape
from io import BytesIO
from pathlib import Path
from xml.etree import ElementTree

from archord.postprocess.laws.exports.contact import Contact
from archord.postprocess.laws.exports.export import export_law
from archord.postprocess.laws.exports.names import check_name
from archord.postprocess.laws.exports.program import Program
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.report.by_name import Names, Words
from archord.report.units import METRES
from archord.report.version import VERSION

_SOURCE = Path(__file__).with_name("fmu.c")
_MODEL = """/* What fmu.c has to know of the law {name}. */
#include "{name}.h"

#define LAW(name) {name}_##name
#define WITH_ERROR {error:d}
#define WITH_ELEMENT {element:d}
#define CLEARANCE {clearance!r}
"""
_GUID = '#define GUID "{guid}"\n'
_FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605, "kip": 4448.2216152605}  # in N
_FLAGS = ["-std=c99", "-O2", "-fPIC", "-shared", "-s", "-Wl,--build-id=none"]
_ABILITIES = {  # of both kinds of FMU
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "true",
}
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the first time that a zip can hold


@dataclass(frozen=True)
class _Variable:
    """A variable of the FMU; variables have the order of the value references in ``fmu.c``."""

    name: str
    causality: str
    unit: str  # of _units
    meaning: str
    start: float | None = None
    depends: Names = ()  # on which inputs
    from_start: Names = ()  # on which parameters
    part: str = "line"  # of the FMU, which some laws have not: error, or element


def _input(name: str, unit: str, meaning: str, part: str = "line") -> _Variable:
    return _Variable(name, "input", unit, meaning, 0.0, part=part)


def _parameter(name: str, unit: str, meaning: str, part: str = "line") -> _Variable:
    return _Variable(name, "parameter", unit, meaning, 0.0, part=part)


def _output(name: str, unit: str, meaning: str, part: str = "line") -> _Variable:
    """An output, which depends on all inputs of its kind of joint."""
    if part == "element":
        return _Variable(name, "output", unit, meaning, None, _MOTION, _OF_PLANE, part)
    from_start = _OF_LINE[1:] if unit == "length" else _OF_LINE
    return _Variable(name, "output", unit, meaning, None, ("delta",), from_start, part)


_MOTION = ("ex", "ey", "vx", "vy", "omega")
_OF_PLANE = ("damping", "mu_static", "mu_dynamic", "stick_speed", "length")
_OF_LINE = ("length", "deepest_start")
_VARIABLES = (
    _input("delta", "length", "joint along a line: displacement of the pin, 0 at first touch"),
    _input("delta_rate", "speed", "rate of delta, to find where the joint turns back; may stay 0"),
    _input("ex", "length", "joint in a plane: pin's centre less hole's, along x", "element"),
    _input("ey", "length", "the same along y", "element"),
    _input("vx", "speed", "rate of ex", "element"),
    _input("vy", "speed", "rate of ey", "element"),
    _input("omega", "turning", "angular velocity of the pin less the hole's", "element"),
    _parameter("damping", "damping", "c of the factor 1 + c d(delta)/dt", "element"),
    _parameter("mu_static", "one", "coefficient of static friction", "element"),
    _parameter("mu_dynamic", "one", "coefficient of dynamic friction", "element"),
    _parameter("stick_speed", "speed", "slip speed up to which friction rises", "element"),
    _parameter("length", "length", "length of the pin"),
    _parameter("deepest_start", "length", "largest delta before the simulation"),
    _output("P", "force", "joint along a line: force, total"),
    _output("stiffness", "stiffness", "dP/d(delta); nan beyond the range of the law"),
    _output("deepest", "length", "largest delta so far"),
    _output("residual", "length", "delta at which the joint opens on its way back", "error"),
    _output("expected_error", "force", "error of P below which 9 of 10 joints stay", "error"),
    _output("Fx", "force", "joint in a plane: force on the pin along x, total", "element"),
    _output("Fy", "force", "the same along y", "element"),
    _output("T", "torque", "torque on the pin about its own centre", "element"),
)


def export_fmu(law: JointCurve | FittedLaw, target: Path, contact: Contact | None = None) -> bytes:
    """The content of a file with the law of one joint as an FMU.

    It warns if there is no C compiler for a library: the FMU then holds sources alone.

    Parameters
    ----------
    law : JointCurve or FittedLaw
        The law.
    target : Path
        The file, which is not written. Its stem becomes the name of the model.
    contact : Contact
        Damping and friction at first, which are parameters of the model; None is neither.

    Returns
    -------
    bytes

    Raises
    ------
    ValueError
        As `export_law` for C.

    Examples
    --------
    >>> from pathlib import Path
    >>> from archord.postprocess.laws.exports.fmu import export_fmu
    >>> from archord.postprocess.laws.general.general_law import general_law
    >>> from archord.postprocess.laws.general.joint import LawJoint
    >>> joint = LawJoint(radius=10.0, clearance=0.05, E_star=115e3, plane="strain", nu=0.3)
    >>> content = export_fmu(general_law(joint), Path("pin_law.fmu"))
    >>> content[:2]
    b'PK'
    """
    name = target.stem
    check_name(target, "c")
    program = Program.of(law)
    contact = contact or Contact()
    header = export_law(law, target.with_suffix(".h"), contact)
    parts = {
        "line": True,
        "error": "expected_error" in program.functions,
        "element": "forces" in program.functions,
    }
    starts = vars(contact) | {"length": program.pin_length}
    variables = tuple(
        replace(one, start=starts.get(one.name, one.start)) for one in _VARIABLES if parts[one.part]
    )
    model = _MODEL.format(name=name, clearance=program.numbers["LENGTH"], **parts)
    source = _SOURCE.read_text(encoding="utf-8")
    unsigned = "\0".join([header, model, source, _description(program, name, variables, "")])
    digest = hashlib.sha256(unsigned.encode()).hexdigest()
    guid = f"{{{uuid.UUID(digest[:32])}}}"
    sources = {
        f"{name}.h": header,
        "fmu-model.h": model + _GUID.format(guid=guid),
        "fmu.c": source,
    }
    description = _description(program, name, variables, guid)
    contents = {"modelDescription.xml": description.encode()}
    contents["documentation/index.html"] = f"<pre>{escape(program.header)}</pre>\n".encode()
    contents |= {f"sources/{file}": text.encode() for file, text in sources.items()}
    library = _library(sources, target)
    if library:
        contents[f"binaries/linux64/{name}.so"] = library
    return _archive(contents)


def _archive(contents: dict[str, bytes]) -> bytes:
    """A zip of files by their names."""
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return buffer.getvalue()


def _library(sources: Words, target: Path) -> bytes | None:
    """The sources as a library for Linux on x86-64; None, with a warning, if that cannot be."""
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        fault = "this is not Linux on x86-64"
    else:
        with tempfile.TemporaryDirectory(prefix="archord-") as folder:
            for name, text in sources.items():
                Path(folder, name).write_text(text, encoding="utf-8")
            command = shlex.split(os.environ.get("CC", "cc"))
            command += [*_FLAGS, "fmu.c", "-o", "law.so", "-lm"]
            try:
                subprocess.run(command, cwd=folder, check=True, capture_output=True)
                return Path(folder, "law.so").read_bytes()
            except OSError:
                fault = "no C compiler is here"
            except subprocess.CalledProcessError:
                fault = f"the C compiler {command[0]} failed"
    warnings.warn(
        f"{target.name}: {fault}, so the FMU holds sources alone, which the importing program has "
        "to compile",
        stacklevel=3,
    )
    return None


def _description(program: Program, name: str, variables: tuple[_Variable, ...], guid: str) -> str:
    """The text of modelDescription.xml."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=name,
        guid=guid,
        description=program.about["title"],
        generationTool=f"archord {VERSION}",
        variableNamingConvention="flat",
        numberOfEventIndicators="1",
    )
    for kind, own in (
        ("ModelExchange", {}),
        ("CoSimulation", {"canHandleVariableCommunicationStepSize": "true"}),
    ):
        element = ElementTree.SubElement(root, kind, {"modelIdentifier": name} | _ABILITIES | own)
        files = ElementTree.SubElement(element, "SourceFiles")
        ElementTree.SubElement(files, "File", name="fmu.c")
    units = _units(program)
    if units:
        definitions = ElementTree.SubElement(root, "UnitDefinitions")
        for unit, base in dict(units.values()).items():
            element = ElementTree.SubElement(definitions, "Unit", name=unit)
            ElementTree.SubElement(element, "BaseUnit", base)
    categories = ElementTree.SubElement(root, "LogCategories")
    for category in ("logStatusWarning", "logStatusError"):
        ElementTree.SubElement(categories, "Category", name=category)
    listed = ElementTree.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        element = ElementTree.SubElement(
            listed,
            "ScalarVariable",
            name=variable.name,
            valueReference=str(reference),
            causality=variable.causality,
            variability="fixed" if variable.causality == "parameter" else "continuous",
            description=variable.meaning,
        )
        real = ElementTree.SubElement(element, "Real")
        if variable.unit in units:
            real.set("unit", units[variable.unit][0])
        if variable.start is not None:
            real.set("start", repr(float(variable.start)))
    _structure(ElementTree.SubElement(root, "ModelStructure"), variables)
    ElementTree.indent(root)
    head = '<?xml version="1.0" encoding="UTF-8"?>\n'
    return head + ElementTree.tostring(root, encoding="unicode") + "\n"


def _structure(parent: ElementTree.Element, variables: tuple[_Variable, ...]) -> None:
    """Add the outputs and what they depend on, in the course of time and at the start."""
    index = {variable.name: str(i) for i, variable in enumerate(variables, 1)}
    outputs = [variable for variable in variables if variable.causality == "output"]
    for kind, initially in (("Outputs", False), ("InitialUnknowns", True)):
        element = ElementTree.SubElement(parent, kind)
        for output in outputs:
            names = output.depends + (output.from_start if initially else ())
            ElementTree.SubElement(
                element,
                "Unknown",
                index=index[output.name],
                dependencies=" ".join(index[name] for name in names),
            )


def _units(program: Program) -> dict[str, tuple[str, Words]]:
    """Name and base of the unit of every quantity; none if the law's units are not known ones."""
    length = program.length_unit
    force = program.force_unit.removesuffix(f"/{length}")
    if length not in METRES or force not in _FORCES:
        return {}
    metre = METRES[length]
    newton = _FORCES[force]
    return {
        "length": (length, {"m": "1", "factor": repr(metre)}),
        "speed": (f"{length}/s", {"m": "1", "s": "-1", "factor": repr(metre)}),
        "turning": ("rad/s", {"rad": "1", "s": "-1"}),
        "damping": (f"s/{length}", {"m": "-1", "s": "1", "factor": repr(1 / metre)}),
        "force": (force, {"kg": "1", "m": "1", "s": "-2", "factor": repr(newton)}),
        "stiffness": (
            f"{force}/{length}",
            {"kg": "1", "s": "-2", "factor": repr(newton / metre)},
        ),
        "torque": (
            f"{force}.{length}",
            {"kg": "1", "m": "2", "s": "-2", "factor": repr(newton * metre)},
        ),
    }

"""The law of any pin joint as one HTML file that needs neither Python nor a network: ``python3 -m
archord.postprocess.laws.page.page docs/law.html``.

The page holds the modules of JavaScript beside this file without their comments, and their data:
the tables of the models of the law, the metals of named.toml, and the texts of the exports.
"""

from __future__ import annotations

import base64
import json
import re
import sys
import zlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from archord.materials.named import metals
from archord.postprocess.laws.exports.file_forms import FILE_FORMS
from archord.postprocess.laws.exports.program import Program
from archord.postprocess.laws.general import (
    elastic_model,
    factor_model,
    general_law,
    hardening_model,
    yield_model,
)
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.page.skeleton import skeleton
from archord.report.by_name import ByName, Words
from archord.report.files import read_json
from archord.report.version import VERSION

HERE = Path(__file__).parent
FLOWS = {"hardens": "hardens", "perfect": "perfectly plastic", "elastic": "does not yield"}
MODULES = ("factors.mjs", "law.mjs", "fits.mjs", "dents.mjs", "exports.mjs", "page.mjs")
_ONLY_IN_MODULES = re.compile(r"^(import .*\n|export | */\*\*(?s:.*?)\*/\n|// .*\n)", re.M)
_LENGTH = 12345.0  # which stands for any length of a pin
_CURVES = ("force", "peak", "angle")


def law_page() -> str:
    """The text of the page."""
    words, arrays = law_data()
    modules = [_ONLY_IN_MODULES.sub("", _source(name)) for name in MODULES]
    return Template(_source("page.html")).substitute(
        pin=_body("pin", {"rigid": "rigid"}),
        block=_body("block", {}),
        style=_source("page.css"),
        words=_packed(words.encode()),
        joints=_packed(arrays),
        program="\n".join(modules),
        version=VERSION,
    )


def _body(body: str, other: Words) -> str:
    """The fields of a ``body``, which can be an ``other`` thing than a metal."""
    named = dict.fromkeys(metals()) | {"own": "own E, nu, yield stress"} | other
    return Template(_source("body.html")).substitute(
        body=body, options=_options(named, "S355"), flows=_options(FLOWS, "hardens")
    )


def _options(labels: Mapping[str, str | None], chosen: str) -> str:
    selected = {chosen: " selected"}
    return "".join(
        f'<option value="{value}"{selected.get(value, "")}>{label or value}</option>'
        for value, label in labels.items()
    )


def law_data() -> tuple[str, bytes]:
    """What ``law.mjs`` takes: JSON, and arrays in planes of bytes, which compress well."""
    with np.load(yield_model.DATA) as stored:
        arrays = {name: _known(name, stored) for name in stored}
    listed = [[name, str(values.dtype), values.size] for name, values in arrays.items()]
    planes = [values.view(np.uint8).reshape(-1, values.itemsize).T for values in arrays.values()]
    words = {
        "version": VERSION,
        "arrays": listed,
        "sides": yield_model.SIDES,
        "step": yield_model.CURVE_STEP,
        "multiples": yield_model.MULTIPLES.tolist(),
        "elastic": read_json(elastic_model.TABLE),
        "kernels": read_json(yield_model.KERNELS),
        "hardening": read_json(hardening_model.TABLE)
        | {
            "terms": hardening_model.TERMS,
            "strains": hardening_model.STRAINS.tolist(),
            "shares": hardening_model.SHARES.tolist(),
        },
        "factors": {"products": factor_model.PRODUCTS, "models": read_json(factor_model.TABLE)},
        "solved": yield_model.SOLVED_ERROR,
        "range": _range(),
        "metals": metals(),
        "exports": _exports(),
    }
    return json.dumps(words), b"".join(plane.tobytes() for plane in planes)


def _known(name: str, stored: Any) -> np.ndarray:
    """An array ``(values,)`` of yield_model.npz, ways back column by column, which compress better
    so; of curves what is known, as rises from node to node."""
    values = stored[name]
    if name not in _CURVES:
        return values.ravel(order="F" if name == "back" else "C")
    rises = np.diff(values, axis=1, prepend=np.int16(0))
    known = np.arange(values.shape[1]) < stored["count"][:, None]
    return rises[known]


def _range() -> ByName:
    """The range of the law."""
    return {
        "nu": general_law.NU,
        "clearances": general_law.CLEARANCES,
        "ratios": general_law.RATIOS,
        "smallest": general_law.SMALLEST_S,
        "gain": general_law.LARGEST_GAIN,
        "friction": factor_model.LARGEST,
    }


def _exports() -> ByName:
    """The texts of the exports by kind of joint and suffix, as places of paragraphs, and the words
    around them."""
    elastic = LawJoint(radius=10.0, clearance=0.05, E_star=115e3, plane="strain", nu=0.3)
    yields = replace(elastic, pin_yield=400.0, block_yield=400.0)
    kinds = {"elastic": _in_mm(elastic, 1.0), "yields": _in_mm(yields, 1.0)}
    units = [Program.of(_in_mm(elastic, length)).units for length in (1.0, _LENGTH)]
    texts = {
        kind: {suffix: skeleton(law, suffix).split("\n\n") for suffix in FILE_FORMS}
        for kind, law in kinds.items()
    }
    # Kinds share most paragraphs, each of which is told once.
    parts = dict.fromkeys(part for own in texts.values() for text in own.values() for part in text)
    places = {part: place for place, part in enumerate(parts)}
    written = ("number", "table", "line_end")
    return {
        "forms": {
            suffix: {key: getattr(form, key) for key in written}
            for suffix, form in FILE_FORMS.items()
        },
        "paragraphs": list(parts),
        "texts": {
            kind: {suffix: [places[part] for part in text] for suffix, text in own.items()}
            for kind, own in texts.items()
        },
        "rules": {kind: Program.of(law).rule for kind, law in kinds.items()},
        "units": [text.replace(f"{_LENGTH:g}", "@length@") for text in units],
    }


def _in_mm(joint: LawJoint, length: float) -> JointCurve:
    """The law of a ``joint`` in mm and N, of a pin of this ``length``."""
    law = general_law.general_law(joint)
    return replace(law, length_unit="mm", force_unit="N", pin_length=length)


def _source(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")


def _packed(data: bytes) -> str:
    return base64.b64encode(zlib.compress(data, 9)).decode()


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(law_page(), encoding="utf-8")

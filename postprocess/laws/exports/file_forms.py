"""How each language writes the constants of a law: tables, numbers and words."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pprint import pformat
from typing import Any

from archord.postprocess.laws.exports.translate import (
    in_c,
    in_javascript,
    in_modelica,
    in_octave,
    in_python,
)
from archord.report.by_name import ByName

_IN_A_ROW = 5  # numbers of a table


@dataclass(frozen=True)
class FileForm:
    """How a language writes a number, a table with the ends of its lines, text, and functions; and
    whole numbers and words where they are not written as numbers are."""

    template: str
    number: str
    table: str
    line_end: str
    text: Callable[[ByName | str], str]
    function: Callable[..., str]
    whole: str = ""
    words: str = ""

    def constant(self, name: str, key: str, value: Any) -> str:
        """The definition of the constant ``key`` of the law ``name``."""
        if isinstance(value, list):
            starts = range(0, len(value), _IN_A_ROW)
            rows = [", ".join(map(repr, value[i : i + _IN_A_ROW])) for i in starts]
            text = self.line_end.join(rows)
            return self.table.format(name=name, key=key, n=len(value), value=text)
        if isinstance(value, str):
            form = self.words or self.number
            return form.format(name=name, key=key, value=self.text(value))
        form = self.whole if isinstance(value, int) else ""
        return (form or self.number).format(name=name, key=key, value=repr(value))


def _quoted(about: ByName | str) -> str:
    return json.dumps(about if isinstance(about, str) else json.dumps(about), ensure_ascii=False)


def _quoted_once(about: ByName | str) -> str:
    text = about if isinstance(about, str) else json.dumps(about)
    return "'" + text.replace("'", "''") + "'"


def _literal(about: ByName | str) -> str:
    return pformat(about, width=110, sort_dicts=False)


FILE_FORMS = {
    ".py": FileForm(
        template="python",
        number="{key} = {value}",
        table="{key}: Table = (\n    {value},\n)",
        line_end=",\n    ",
        text=_literal,
        function=in_python,
    ),
    ".h": FileForm(
        template="c",
        number="static const double {name}_{key} = {value};",
        table="static const double {name}_{key}[] = {{\n    {value}\n}};",
        line_end=",\n    ",
        text=_quoted,
        function=in_c,
        whole="enum {{ {name}_{key} = {value} }};",
        words="static const char {name}_{key}[] = {value};",
    ),
    ".mo": FileForm(
        template="modelica",
        number="  constant Real {key} = {value};",
        table="  constant Real {key}[{n}] = {{\n    {value}}};",
        line_end=",\n    ",
        text=_quoted,
        function=in_modelica,
        whole="  constant Integer {key} = {value};",
        words="  constant String {key} = {value};",
    ),
    ".mjs": FileForm(
        template="javascript",
        number="export const {key} = {value};",
        table="export const {key} = [\n    {value},\n];",
        line_end=",\n    ",
        text=json.dumps,
        function=in_javascript,
    ),
    ".m": FileForm(
        template="octave",
        number="    T.{key} = {value};",
        table="    T.{key} = [ ...\n        {value}];",
        line_end=", ...\n        ",
        text=_quoted_once,
        function=in_octave,
    ),
}

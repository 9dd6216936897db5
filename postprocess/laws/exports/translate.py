"""The functions of ``algorithm.py`` and ``element.py`` in other languages: their syntax trees,
pruned and printed line by line."""

from __future__ import annotations

import ast
import inspect
import math
import re
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from archord.postprocess.laws.exports import algorithm, element
from archord.report.by_name import Words

_TREES = [ast.parse(inspect.getsource(module)) for module in (algorithm, element)]
FUNCTIONS = {
    node.name: node for tree in _TREES for node in tree.body if isinstance(node, ast.FunctionDef)
}
TABLES = {name for module in (algorithm, element) for name in vars(module) if name.isupper()}


def select(wanted: list[str], flags: dict[str, bool]) -> tuple[list[ast.FunctionDef], set[str]]:
    """The functions that ``wanted`` ones call, less what ``flags`` switch off; and the names of the
    tables they use."""
    todo = list(wanted)
    used: dict[str, ast.FunctionDef] = {}
    tables: set[str] = set()
    while todo:
        name = todo.pop()
        used[name] = _Prune(flags).visit(deepcopy(FUNCTIONS[name]))
        names = _names(used[name].body)
        tables |= names & TABLES
        todo += (names & FUNCTIONS.keys()) - used.keys() - {"warn_outside"}
    return [used[name] for name in FUNCTIONS if name in used], tables


def _names(body: list[ast.stmt]) -> set[str]:
    """All names in a block."""
    nodes = (node for statement in body for node in ast.walk(statement))
    return {node.id for node in nodes if isinstance(node, ast.Name)}


class _Prune(ast.NodeTransformer):
    def __init__(self, flags: dict[str, bool]) -> None:
        self.flags = flags

    def visit_If(self, node: ast.If) -> Any:
        self.generic_visit(node)
        if isinstance(node.test, ast.Name):
            return node.body if self.flags[node.test.id] else node.orelse
        return node


@dataclass(frozen=True)
class Language:
    """How a language writes names, entries of tables (from ``base`` on), statements, the ends of
    blocks, and what takes the place of ``warn_outside``."""

    words: Words
    base: int
    entry: str
    half: str
    assign: str
    several: str
    if_: str
    else_: str
    for_: str
    ends: tuple[str, str]
    warning: str
    types: Words
    table: str = "{}"
    function: str = "{}"
    between: str = ", "

    def expression(self, node: ast.AST) -> str:
        """An expression of ``algorithm.py``."""
        return ast.unparse(_Words(self).visit(node))

    def statements(self, body: list[ast.stmt], indent: str) -> list[str]:
        """The lines of a block."""
        return [indent + line for statement in body for line in self._statement(statement)]

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Assign(targets=[ast.Tuple(elts=[first, *more])], value=value):
                open_call = self.expression(value)[:-1]
                others = self.between.join(ast.unparse(name) for name in more)
                return [self.several.format(ast.unparse(first), others, open_call)]
            case (
                ast.Assign(targets=[target], value=value)
                | ast.AnnAssign(target=target, value=ast.expr() as value)
            ):
                return [self.assign.format(ast.unparse(target), self.expression(value))]
            case ast.If():
                other = [self.else_, *self.statements(node.orelse, "    ")] if node.orelse else []
                test = self.if_.format(self.expression(node.test))
                return [test, *self.statements(node.body, "    "), *other, self.ends[0]]
            case ast.For(iter=ast.Call(args=[count])):
                return [
                    self.for_.format(self.expression(count)),
                    *self.statements(node.body, "    "),
                    self.ends[1],
                ]
            case ast.Expr(value=ast.Call(args=[delta])):
                return [self.warning.format(self.expression(delta))] if self.warning else []
        raise TypeError(f"algorithm.py: other languages have no words for {ast.unparse(node)}")


class _Words(ast.NodeTransformer):
    """Replaces the nodes of an expression by the words of a language."""

    def __init__(self, language: Language) -> None:
        self.language = language

    def visit_Name(self, node: ast.Name) -> ast.Name:
        word = self.language.words.get(node.id, node.id)
        if node.id in TABLES:
            word = self.language.table.format(word)
        elif node.id in FUNCTIONS:
            word = self.language.function.format(word)
        return ast.Name(word)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        if node.attr == "pi":
            return ast.Constant(math.pi)
        return ast.Name(self.language.words.get(node.attr, node.attr))

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.op, ast.FloorDiv):
            return ast.Name(self.language.half.format(ast.unparse(node.left)))
        return node

    def visit_Subscript(self, node: ast.Subscript) -> ast.Name:
        table = ast.unparse(self.visit(node.value))
        base = self.language.base
        match node.slice:
            case ast.Constant(value=int(number)):
                place = str(number + base)
            case ast.BinOp(left=name, right=ast.Constant(value=int(number))):
                place = f"{ast.unparse(self.visit(name))} + {number + base}"
            case name:
                place = ast.unparse(self.visit(name)) + (f" + {base}" if base else "")
        return ast.Name(self.language.entry.format(table, place))


@dataclass(frozen=True)
class Signature:
    """A function's name, its doc in one line (a comment of Octave ends with its line), inputs and
    locals with their types, the names that it returns, and its body."""

    name: str
    doc: str
    inputs: Words
    outputs: list[str]
    locals: Words
    body: list[ast.stmt]

    @classmethod
    def of(cls, node: ast.FunctionDef) -> Signature:
        """Taken from the syntax tree."""
        *body, last = node.body[1:]
        assert isinstance(last, ast.Return)
        assert last.value is not None
        inputs = {arg.arg: ast.unparse(arg.annotation) for arg in node.args.args if arg.annotation}
        own: Words = {}
        for part in (n for statement in body for n in ast.walk(statement)):
            if isinstance(part, ast.AnnAssign):
                own[ast.unparse(part.target)] = ast.unparse(part.annotation)
            elif isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store) and part.id != "_":
                own.setdefault(part.id, "float")
        outputs = ast.unparse(last.value).strip("()").split(", ")
        doc = " ".join((ast.get_docstring(node) or "").split())
        return cls(node.name, doc, inputs, outputs, own, body)


def in_python(node: ast.FunctionDef, name: str) -> str:
    """The function in Python."""
    return ast.unparse(node) + "\n"


def in_c(node: ast.FunctionDef, name: str) -> str:
    """The function in C99; all results but the first by pointers."""
    f = Signature.of(node)
    c = _c(f"{name}_")
    result, *more = f.outputs
    inputs = [f"{c.types[kind]}{name}" for name, kind in f.inputs.items()]
    inputs += [f"double *{name}_out" for name in more]
    names_by_kind: dict[str, list[str]] = {}
    for local, kind in f.locals.items():
        names_by_kind.setdefault(kind, []).append(local)
    body = c.statements(f.body, "")
    lines = [f"{c.types[kind]}{', '.join(names)};" for kind, names in names_by_kind.items()]
    lines += [f"(void){name};" for name in f.inputs if not re.search(rf"\b{name}\b", str(body))]
    lines += [*body, *(f"*{name}_out = {name};" for name in more), f"return {result};"]
    head = f"static inline {c.types[f.locals[result]]}{name}_{f.name}({', '.join(inputs)}) {{"
    return "\n".join([f"/* {f.doc} */", head, *(f"    {line}" for line in lines), "}"])


def in_modelica(node: ast.FunctionDef, name: str) -> str:
    """The function in Modelica."""
    f = Signature.of(node)
    inner = {name: kind for name, kind in f.locals.items() if name not in f.outputs}
    lines = [f"    input {MODELICA.types[kind].format(name)};" for name, kind in f.inputs.items()]
    lines += [f"    output {MODELICA.types[f.locals[name]].format(name)};" for name in f.outputs]
    lines += ["  protected"] if inner else []
    lines += [f"    {MODELICA.types[kind].format(name)};" for name, kind in inner.items()]
    lines += ["  algorithm", *MODELICA.statements(f.body, "    "), f"  end {f.name};"]
    return f'  function {f.name} "{f.doc}"\n' + "\n".join(lines)


def in_octave(node: ast.FunctionDef, name: str) -> str:
    """The function in Matlab and Octave; tables are a persistent structure ``T``."""
    f = Signature.of(node)
    lines = [f"% {f.doc}"]
    if _names(f.body) & {*TABLES, "warn_outside"}:  # which asks the tables for their end
        lines += ["persistent T", "if isempty(T)", "    T = tables();", "end"]
    lines += OCTAVE.statements(f.body, "")
    head = f"function [{', '.join(f.outputs)}] = {f.name}({', '.join(f.inputs)})\n"
    return head + "".join(f"    {line}\n" for line in lines) + "end"


def in_javascript(node: ast.FunctionDef, name: str) -> str:
    """The function in JavaScript; several results as an array."""
    f = Signature.of(node)
    given = {"deepest": " = 0"} if f.name in ("force", "expected_error") else {}
    inputs = ", ".join(f"{key}{given.get(key, '')}" for key in f.inputs)
    body = [f"let {', '.join(f.locals)};", *JAVASCRIPT.statements(f.body, "")]
    results = ", ".join(f.outputs)
    body.append(f"return [{results}];" if len(f.outputs) > 1 else f"return {results};")
    lines = [f"export function {f.name}({inputs}) {{", *(f"    {line}" for line in body), "}"]
    return "\n".join([f"/** {f.doc} */", *lines])


def _c(prefix: str) -> Language:
    return Language(
        words={"min": "fmin", "max": "fmax", "abs": "fabs", "int": "(int)"},
        base=0,
        entry="{}[{}]",
        half="({}) / 2",
        assign="{} = {};",
        several="{0} = {2}, &{1});",
        if_="if ({}) {{",
        else_="} else {",
        for_="for (int k = 0; k < {}; k++) {{",
        ends=("}", "}"),
        warning="",
        types={"Table": "const double *", "float": "double ", "int": "int "},
        table=f"{prefix}{{}}",
        function=f"{prefix}{{}}",
        between=", &",
    )


MODELICA = Language(
    words={"int": "integer"},
    base=1,
    entry="{}[{}]",
    half="div({}, 2)",
    assign="{} := {};",
    several="({0}, {1}) := {2});",
    if_="if {} then",
    else_="else",
    for_="for k in 1:{} loop",
    ends=("end if;", "end for;"),
    warning='assert({} <= REACH, "delta is beyond the tables of this law", '
    "AssertionLevel.warning);",
    types={"Table": "Real {}[:]", "float": "Real {}", "int": "Integer {}"},
)

OCTAVE = Language(
    words={"int": "floor"},
    base=1,
    entry="{}({})",
    half="floor(({}) / 2)",
    assign="{} = {};",
    several="[{0}, {1}] = {2});",
    if_="if {}",
    else_="else",
    for_="for k = 1:{}",
    ends=("end", "end"),
    warning="warn_outside({}, T.REACH);",
    types={},
    table="T.{}",
)

JAVASCRIPT = Language(
    words={
        "min": "Math.min",
        "max": "Math.max",
        "abs": "Math.abs",
        "sqrt": "Math.sqrt",
        "log": "Math.log",
        "sin": "Math.sin",
        "cos": "Math.cos",
        "atan2": "Math.atan2",
        "int": "Math.floor",
    },
    base=0,
    entry="{}[{}]",
    half="Math.floor(({}) / 2)",
    assign="{} = {};",
    several="[{0}, {1}] = {2});",
    if_="if ({}) {{",
    else_="} else {",
    for_="for (let k = 0; k < {}; k++) {{",
    ends=("}", "}"),
    warning="warn_outside({});",
    types={},
)

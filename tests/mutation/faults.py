"""The small faults that can be put into a source file: one operator, constant or condition each.

A fault is a change of the text, so every line keeps its number. Left alone is what no test should notice:
docstrings, messages, types, decorators, ``__slots__``, ``__all__``, and arguments that say how, not what.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass

OPERATORS = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*"),
    ast.FloorDiv: ("//", "*"), ast.Mod: ("%", "+"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"),
    ast.BitXor: ("^", "&"), ast.LShift: ("<<", ">>"), ast.RShift: (">>", "<<"),
    ast.Lt: ("<", ">="), ast.LtE: ("<=", ">"), ast.Gt: (">", "<="), ast.GtE: (">=", "<"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"), ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
PAIRS = (("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("any", "all"), ("floor", "ceil"))
TWINS = {a: b for pair in (*PAIRS, ("left", "right")) for a, b in (pair, pair[::-1])}
UNSEEN = {"annotation", "returns", "decorator_list", "format_spec"}  # parts of a node
HOW = {"strict", "check_finite", "copy", "repr", "init", "hint", "help", "exist_ok", "parents"}  # arguments
SPEAKING = {
    "note",
    "progress",
    "debug",
    "info",
    "warn",
    "fault",
    "BadParameter",
}  # calls that only say something


@dataclass(frozen=True)
class Fault:
    """One change of a file, from byte ``start`` to byte ``stop``."""

    path: str
    line: int
    lines: tuple[int, ...]  # of its statement
    at_import: bool  # outside every function: no single test runs it
    start: int
    stop: int
    was: str
    now: str
    text: str  # of its line

    def put_into(self, source: bytes) -> bytes:
        """Return the source with the fault in it."""
        return source[: self.start] + self.now.encode() + source[self.stop :]

    @property
    def change(self) -> str:
        """The change in one line."""
        return " ".join(f"{self.was}  ->  {self.now}".split())


def faults_in(path: str, source: bytes) -> list[Fault]:
    """Return all faults that can be put into a source file, in the order of the syntax tree."""
    text, rows = source.decode(), source.splitlines(keepends=True)
    begins = [0, 0]
    for row in rows:
        begins.append(begins[-1] + len(row))

    def part(node: ast.expr) -> str:
        return f"({ast.get_source_segment(text, node)})"

    def visit(node: ast.AST, statement: ast.stmt | None, *, at_import: bool) -> Iterator[Fault]:
        if _is_left_alone(node):
            return
        if isinstance(node, ast.stmt):
            statement = node
        if isinstance(node, ast.stmt | ast.expr) and statement is not None:
            start = begins[node.lineno] + node.col_offset
            stop = begins[node.end_lineno] + node.end_col_offset
            row, lines = rows[node.lineno - 1].decode().strip(), _lines(statement)
            for now in _changes(node, part):
                was = source[start:stop].decode()
                yield Fault(path, node.lineno, lines, at_import, start, stop, was, now, row)
        for name, value in ast.iter_fields(node):
            runs = name == "body" and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST) and name not in UNSEEN:
                    yield from visit(child, statement, at_import=at_import and not runs)

    return list(visit(ast.parse(source), None, at_import=True))


def _lines(statement: ast.stmt) -> tuple[int, ...]:
    """Lines of a statement; of its head alone where it has a body."""
    body = getattr(statement, "body", None)
    last = max(body[0].lineno - 1, statement.lineno) if body else statement.end_lineno
    return tuple(range(statement.lineno, last + 1))


def _is_left_alone(node: ast.AST) -> bool:
    said = isinstance(node, ast.Call) and _name(node.func) in SPEAKING
    text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    typing = isinstance(node, ast.If) and _name(node.test) == "TYPE_CHECKING"
    how = isinstance(node, ast.keyword) and node.arg in HOW
    listed = isinstance(node, ast.Assign) and _name(node.targets[0]) in {"__slots__", "__all__"}
    message = isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr)
    return said or text or typing or how or listed or message


def _name(node: ast.AST) -> str:
    return getattr(node, "attr", getattr(node, "id", ""))


def _changes(node: ast.AST, part: Callable[[ast.expr], str]) -> Iterator[str]:
    """Yield what may stand there instead."""
    match node:
        case ast.BinOp(left, op, right) if type(op) in OPERATORS:
            if not (isinstance(op, ast.Mod) and isinstance(left, ast.Constant | ast.JoinedStr)):
                yield f"({part(left)} {OPERATORS[type(op)][1]} {part(right)})"
        case ast.AugAssign(target, op, value) if type(op) in OPERATORS:
            yield f"{part(target)[1:-1]} {OPERATORS[type(op)][1]}= {part(value)}"
        case ast.BoolOp(op, values):
            yield "(" + f" {OPERATORS[type(op)][1]} ".join(map(part, values)) + ")"
        case ast.Compare(left, [op], [right]):
            sign, opposite = OPERATORS[type(op)]
            yield f"({part(left)} {opposite} {part(right)})"
            if sign[0] in "<>" and (_is_whole(left) or _is_whole(right)):  # one off
                yield f"({part(left)} {sign[0] if sign[1:] else sign + '='} {part(right)})"
        case ast.UnaryOp(ast.USub() | ast.Not() | ast.Invert(), operand):
            yield part(operand)
        case ast.IfExp(test, body, orelse):
            yield f"({part(orelse)} if {part(test)} else {part(body)})"
        case ast.Call(ast.Attribute(attr=name) | ast.Name(name)) if name in TWINS:
            yield part(node)[1:-1].replace(f"{name}(", f"{TWINS[name]}(", 1)
        case ast.Constant(bool() as value):
            yield str(not value)
        case ast.Constant(int() as value):
            yield from (str(value + 1), f"({value - 1})")
        case ast.Constant(float() as value):
            yield repr(2.0 * value or 1.0)
        case ast.Constant(str() as value) if value in TWINS:
            yield repr(TWINS[value])


def _is_whole(node: ast.AST) -> bool:
    """Whether it looks like a whole number: there a border moved by one shows."""
    called = isinstance(node, ast.Call) and _name(node.func) in {"len", "int", "round"}
    number = isinstance(node, ast.Constant) and isinstance(node.value, int)
    return called or number or _name(node) in {"size", "n_h", "n_q"}

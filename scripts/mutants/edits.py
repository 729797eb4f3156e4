"""Small faults for a source file: which single edits there are, each as a changed text; pure.

An edit exchanges an operator or a comparison, shifts a number, turns a condition round, leaves out
a statement that acts, or lets a loop serve its first element only. Annotations, texts and the
messages of errors are left alone: types are checked by pyrefly, and wording is no behaviour.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "+"),
    ast.Pow: ("**", "*"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
    ast.BitXor: ("^", "&"),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}
COMPARISONS: dict[type[ast.AST], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", ("<=", ">=")),
    ast.LtE: ("<=", ("<", ">")),
    ast.Gt: (">", (">=", "<=")),
    ast.GtE: (">=", (">", "<")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
}
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}
TURNED = (ast.Name, ast.Attribute, ast.Call)
"""Conditions that are no comparison and get a `not`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutation:
    """One edit of one file: the characters from `start` to `end` become `text`."""

    start: int
    end: int
    text: str
    scope: str
    """Qualified name of the innermost function or class; empty at module level."""
    at_import: bool
    """Whether it runs when the module is imported, not when a function is called."""

    def apply(self, source: str) -> str:
        """The changed source."""
        return source[: self.start] + self.text + source[self.end :]

    def lines(self, source: str) -> tuple[str, str]:
        """The lines that it touches, before and after, each joined and stripped."""
        first = source.rfind("\n", 0, self.start) + 1
        last = source.find("\n", self.end)
        last = len(source) if last < 0 else last
        changed = source[first : self.start] + self.text + source[self.end : last]
        return " ".join(source[first:last].split()), " ".join(changed.split())

    def line_number(self, source: str) -> int:
        """Number of its first line, from 1."""
        return source.count("\n", 0, self.start) + 1


class _Finder:
    def __init__(self, source: str) -> None:
        self._source = source
        lengths = [len(line) for line in source.splitlines(keepends=True)]
        self._starts = [sum(lengths[:number]) for number in range(len(lengths))]
        self._lines = source.splitlines(keepends=True)
        self._scope = ""
        self._at_import = True

    def _at(self, line: int, column: int) -> int:
        """Offset of a place, whose column counts bytes of UTF-8."""
        text = self._lines[line - 1].encode()[:column].decode()
        return self._starts[line - 1] + len(text)

    def _span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self._at(node.lineno, node.col_offset), self._at(
            node.end_lineno, node.end_col_offset
        )

    def _edit(self, start: int, end: int, text: str) -> Mutation:
        return Mutation(
            start=start,
            end=end,
            text=text,
            scope=self._scope,
            at_import=self._at_import,
        )

    def _replace(self, node: ast.expr | ast.stmt, text: str) -> Mutation:
        return self._edit(*self._span(node), text)

    def _between(self, left: ast.expr, right: ast.expr, old: str, new: str) -> Iterator[Mutation]:
        """Exchange an operator; comments do not stand between operands of this project."""
        start, end = self._span(left)[1], self._span(right)[0]
        word = rf"(?<!\w){re.escape(old)}(?!\w)" if old.isalpha() else re.escape(old)
        found = re.search(word.replace(r"\ ", r"\s+"), self._source[start:end])
        if found is not None:
            yield self._edit(start + found.start(), start + found.end(), new)

    def walk(self, node: ast.AST) -> Iterator[Mutation]:
        """All edits in a node and below it."""
        if isinstance(node, ast.JoinedStr | ast.Raise | ast.Assert | ast.Import | ast.ImportFrom):
            return
        scope, at_import = self._scope, self._at_import
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            inside = "" if not scope else "." if at_import else ".<locals>."
            self._scope = f"{scope}{inside}{node.name}"
            self._at_import = at_import and isinstance(node, ast.ClassDef)
        yield from self._own(node)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "args", "bases") and isinstance(
                node, ast.FunctionDef | ast.ClassDef | ast.AnnAssign
            ):
                yield from self._defaults(value)
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from self.walk(child)
        self._scope, self._at_import = scope, at_import

    def _defaults(self, value: object) -> Iterator[Mutation]:
        if isinstance(value, ast.arguments):
            inner, self._at_import = self._at_import, True
            for default in (*value.defaults, *value.kw_defaults):
                if default is not None:
                    yield from self.walk(default)
            self._at_import = inner

    def _own(self, node: ast.AST) -> Iterator[Mutation]:
        match node:
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                yield from self._between(left, right, *OPERATORS[type(op)])
            case ast.BoolOp(op=op, values=values):
                yield from self._between(values[-2], values[-1], *OPERATORS[type(op)])
            case ast.Compare(left=left, ops=ops, comparators=others):
                for op, before, after in zip(ops, [left, *others], others, strict=False):
                    old, news = COMPARISONS[type(op)]
                    for new in news:
                        yield from self._between(before, after, old, new)
            case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
                start, end = self._span(operand)
                yield self._replace(node, self._source[start:end])
            case ast.Constant(value=bool() as value):
                yield self._replace(node, str(not value))
            case ast.Constant(value=int() as value):
                yield self._replace(node, str(value + 1))
            case ast.Constant(value=float() as value):
                yield self._replace(node, repr(2.0 * value if value else 1.0))
            case ast.Call(func=ast.Name(id=name) as function) if name in NAMES:
                yield self._replace(function, NAMES[name])
            case _:
                yield from self._statement(node)

    def _statement(self, node: ast.AST) -> Iterator[Mutation]:
        match node:
            case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
                if isinstance(test, TURNED):
                    start, end = self._span(test)
                    yield self._edit(start, start, "not ")
            case ast.Expr(value=ast.Call()) | ast.AugAssign():
                yield self._replace(node, "pass")
            case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
                yield self._replace(node, "pass")
            case ast.For(iter=sequence):
                start, end = self._span(sequence)
                yield self._edit(start, end, f"list({self._source[start:end]})[:1]")
            case ast.Continue():
                yield self._replace(node, "break")
            case ast.Break():
                yield self._replace(node, "continue")
            case _:
                pass


def mutations(source: str) -> list[Mutation]:
    """Every edit of a source file that this module knows, in the order of the text."""
    found = _Finder(source).walk(ast.parse(source))
    return sorted(found, key=lambda edit: (edit.start, edit.end, edit.text))

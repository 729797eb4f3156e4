"""Probes in the statements of the package, which tell what a test runs.

A trace by `sys.settrace` makes these tests seven to ten times as long, and Python 3.11 has nothing
faster; a probe is one store into a byte array.
"""

import ast
import importlib.abc
import importlib.machinery
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

HITS = "__hits__"
"""Name under which a module finds its byte array."""


class Probes(importlib.abc.MetaPathFinder):
    """Imports a package so that each line of its functions is marked when it begins to run.

    Attributes:
        hits: file -> array in which byte n is 1 once the statement that begins on line n has run.
    """

    def __init__(self, package: Path) -> None:
        self._package, self.hits = package, dict[str, bytearray]()

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Find modules of the package, and leave others to those who find them otherwise."""
        if fullname.split(".")[0] != self._package.name:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            spec.loader = _Loader(fullname, spec.loader.path, self.hits)
        return spec

    def reset(self) -> None:
        """Unmark all lines."""
        for hits in self.hits.values():
            hits[:] = bytes(len(hits))

    def lines(self) -> dict[str, int]:
        """File, as its path in the package -> the lines that are marked, line n as bit n."""
        found: dict[str, int] = {}
        for file, hits in self.hits.items():
            if any(hits):
                marked = sum(1 << line for line, hit in enumerate(hits) if hit)
                found[Path(file).relative_to(self._package).as_posix()] = marked
        return found


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, fullname: str, path: str, hits: dict[str, bytearray]) -> None:
        super().__init__(fullname, path)
        self._hits = hits

    def exec_module(self, module: ModuleType) -> None:
        source = self.get_data(self.path)
        lines = bytearray(source.count(b"\n") + 2)
        # A module that is imported once more marks where its functions of before do.
        module.__dict__[HITS] = self._hits.setdefault(self.path, lines)
        exec(compile(probed(source), self.path, "exec", dont_inherit=True), module.__dict__)


def probed(source: bytes) -> ast.Module:
    """A module with a probe before each statement of its functions."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            node.body = _probed_block(node.body)
    return ast.fix_missing_locations(tree)


def _probed_block(block: Sequence[ast.stmt]) -> list[ast.stmt]:
    probed: list[ast.stmt] = []
    for statement in block:
        # A text that says what a function does must stay its first statement.
        if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
            probed.append(_probe(statement))
        # Functions inside are found by themselves.
        if not isinstance(statement, ast.FunctionDef | ast.ClassDef):
            for part in (
                statement,
                *getattr(statement, "handlers", ()),
                *getattr(statement, "cases", ()),
            ):
                for name in ("body", "orelse", "finalbody"):
                    if inner := getattr(part, name, None):
                        setattr(part, name, _probed_block(inner))
        probed.append(statement)
    return probed


def _probe(statement: ast.stmt) -> ast.stmt:
    array = ast.Name(id=HITS, ctx=ast.Load())
    byte = ast.Subscript(value=array, slice=ast.Constant(statement.lineno), ctx=ast.Store())
    mark = ast.Assign(targets=[byte], value=ast.Constant(1))
    return ast.copy_location(mark, statement)

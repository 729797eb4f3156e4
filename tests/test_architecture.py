"""The laws of the house that no other tool of `make check` keeps."""

import ast
import re
import tomllib
from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import pytest
from source_trees import SOURCES, tree_of

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
MACHINE_PATH = re.compile(r"(?<![\w./~-])/(?:home|root|work|tmp|Users|mnt|opt|srv)/")
TEXTS = [
    *SOURCES,
    *sorted((ROOT / "tests").rglob("*.py")),
    *sorted((ROOT / "scripts").glob("*.py")),
    *sorted((ROOT / "models").iterdir()),
    *[ROOT / name for name in ("README.md", "CHANGELOG.md", "Makefile", "pyproject.toml")],
]


def test_every_room_has_its_layer() -> None:
    layers = PROJECT["tool"]["importlinter"]["contracts"][0]["layers"]
    named = set(re.findall(r"legbench\.(\w+)", " ".join(layers)))
    rooms = {path.stem for path in (ROOT / "src" / "legbench").glob("*.py")}
    rooms |= {path.parent.name for path in (ROOT / "src" / "legbench").glob("*/__init__.py")}
    assert rooms - {"__init__", "__main__"} <= named


def test_no_file_knows_the_machine_that_it_was_written_on() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in TEXTS
        if path.is_file() and path.suffix != ".pyc"
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if MACHINE_PATH.search(line)
    ]
    assert found == []


KEEP_STOPPING = ("stop.py", "sdo_stop.py", "port.py", "link_end.py", "can.py", "session.py")
"""On the way to rest one failure must not prevent the next step, whatever a driver raises."""
GUESTS = ("loop.py", "onlooker.py", "each_leg.py")
"""Controllers, plants and onlookers of others may raise anything; it is told as their failure."""


def test_no_module_needs_itself_through_others() -> None:
    """Imports run one way, those for the type checker and those inside functions too."""
    graph = grimp.build_graph("legbench")
    face = {"legbench"}  # It names for type checkers what it loads only when it is asked for.
    TopologicalSorter(
        {
            module: graph.find_modules_directly_imported_by(module) - face
            for module in graph.modules - face
        }
    ).prepare()


def hides(node: ast.ExceptHandler | ast.Call, file: str) -> bool:
    """Whether a node catches whatever comes and cannot raise it again, or calls what hides it."""
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id in ("hasattr", "eval", "exec")
    if node.type is None:
        return True
    names = {name.id for name in ast.walk(node.type) if isinstance(name, ast.Name)}
    if not names & {"Exception", "BaseException"} or file in KEEP_STOPPING + GUESTS:
        return False
    return not any(isinstance(inner, ast.Raise) for inner in ast.walk(node))


def test_no_error_is_caught_blindly() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in SOURCES
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.ExceptHandler | ast.Call) and hides(node, path.name)
    ]
    assert found == []


def test_every_command_is_documented_where_it_is_found() -> None:
    scripts = PROJECT["project"]["scripts"]
    assert scripts == {"legbench": "legbench.cli:main"}


def test_the_package_is_typed_for_others() -> None:
    assert (ROOT / "src" / "legbench" / "py.typed").is_file()


MEASURING = [path for path in SOURCES if {"metrics", "viz"} & set(path.parts)]
KINDS = {"bang-bang", "position-jump", "three-levels"} | {"sim", "analytic", "can"}
"""Words that only controllers and plants are called by; the jump is also a setup."""


@pytest.mark.parametrize("path", MEASURING, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_whoever_measures_or_draws_a_run_takes_its_description(path: Path) -> None:
    """No manifest, no table of it by a key, no controller or plant by name."""
    tree = tree_of(path)
    docs = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        where = f"{path.name}:{getattr(node, 'lineno', 0)}"
        if isinstance(node, ast.Attribute):
            assert node.attr != "manifest", where
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            assert node.value not in KINDS, where
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            named = [isinstance(each, ast.Constant) for each in node.args[:1]]
            environment = ast.unparse(node.func.value) == "os.environ"
            assert environment or not (node.func.attr == "get" and named == [True]), where
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
            held = ast.unparse(node.value).rsplit(".", maxsplit=1)[-1]
            words = ("manifest", "experiment", "controller", "description", "conventions")
            assert held not in words, where
        if isinstance(node, ast.Compare):
            named = [each for each in (node.left, *node.comparators) if _is_controller(each)]
            assert not named, where
        if isinstance(node, ast.ImportFrom):
            assert not (node.module or "").startswith("legbench.control"), where
            assert "Phase" not in {name.name for name in node.names}, where


def _is_controller(node: ast.expr) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "controller"


@pytest.mark.parametrize(
    ("call", "home"),
    [
        ("savefig", "viz/print/save.py"),
        ("replace(path)", "writing.py"),
        ("os.replace", None),
        ("isfinite(value) else", "strict_json.py"),
    ],
)
def test_there_is_one_saver_one_atomic_writer_and_one_way_to_null(
    call: str, home: str | None
) -> None:
    found = [path for path in SOURCES if call in path.read_text(encoding="utf-8")]
    inside = [path.relative_to(ROOT / "src" / "legbench").as_posix() for path in found]
    others = ["recording/manifest.py"] if call.startswith("isfinite") else []
    assert inside == [*others, *([home] if home else [])]


def test_a_class_has_a_name_of_its_own() -> None:
    """A name that two rooms use for two things sends the reader to the wrong one."""
    places: dict[str, list[str]] = {}
    for path in SOURCES:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(str(path.relative_to(ROOT / "src")))
    assert {name: found for name, found in places.items() if len(found) > 1} == {}

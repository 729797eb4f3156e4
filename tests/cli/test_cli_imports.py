"""What a command imports: nothing that it does not use."""

import pytest
from commands import DESIGN, MODELS, DoneTogether, started_together

WATCHED = (
    *("numpy", "tyro", "pyarrow", "mujoco", "scipy", "can", "typeguard", "pyarrow.dataset", "cma"),
    # Of a data sheet, which none of these lines reads.
    "canopen",
)
BUS = MODELS.parent / "hardware" / "leg.toml"
RUN = ("run", "jump", *DESIGN, "--duration", "0.01", "--out", "runs", "--plant")
LINES: dict[str, tuple[tuple[str, ...], set[str]]] = {
    "help": (("run", "--help"), {"numpy", "tyro"}),
    "help of a controller": (("run", "jump", "--help"), {"numpy", "tyro"}),
    "help with drives": (("run", "bang-bang", "--plant", "can", "--help"), {"numpy", "tyro"}),
    "help of a search": (("design", "--help"), {"numpy", "tyro"}),
    "sim": ((*RUN, "sim"), {"numpy", "tyro", "pyarrow", "mujoco"}),
    "can": (
        (*RUN, "can", "--interface", "legbench", "--bus", str(BUS)),
        {"numpy", "tyro", "pyarrow", "mujoco", "can"},
    ),
    # MuJoCo writes the model into the run folder.
    "analytic": ((*RUN, "analytic"), {"numpy", "tyro", "pyarrow", "mujoco", "can", "scipy"}),
}
"""Command lines, each of which loads more than those before it, and all that is loaded by then."""


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, DoneTogether]:
    """The end of each line, all in one process."""
    lines = [words for words, _ in LINES.values()]
    found = started_together(lines, cwd=tmp_path_factory.mktemp("imports"))
    return dict(zip(LINES, found, strict=True))


@pytest.mark.parametrize("name", LINES)
def test_a_command_loads_what_it_needs_and_no_more(
    name: str, loaded: dict[str, DoneTogether]
) -> None:
    done = loaded[name]
    assert done.status == 0, done.err
    assert {module for module in WATCHED if module in done.loaded} == LINES[name][1]

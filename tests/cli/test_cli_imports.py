"""What a command imports: nothing that it does not use."""

from pathlib import Path

import pytest
from commands import DESIGN, started

WATCHED = ("numpy", "tyro", "pyarrow", "mujoco", "scipy", "can", "typeguard", "pyarrow.dataset")
TELL = (
    "import atexit; "
    f"atexit.register(lambda: print('loaded', *[m for m in {WATCHED} if m in sys.modules]))"
)


def loaded(*words: str | Path, cwd: Path) -> set[str]:
    done = started(*words, before=TELL, cwd=cwd)
    assert done.status == 0, done.err
    return set(done.out.splitlines()[-1].split()[1:])


@pytest.mark.parametrize("subject", [(), ("jump",), ("bang-bang", "--plant", "can")])
def test_help_loads_neither_a_plant_nor_a_recording(
    subject: tuple[str, ...], tmp_path: Path
) -> None:
    assert loaded("run", *subject, "--help", cwd=tmp_path) == {"numpy", "tyro"}


@pytest.mark.parametrize(
    ("plant", "more"),
    [
        (("sim",), {"mujoco"}),
        (("analytic",), {"mujoco", "scipy"}),  # MuJoCo writes the model into the run folder
        (("can", "--interface", "legbench"), {"mujoco", "can"}),
    ],
    ids=["sim", "analytic", "can"],
)
def test_a_run_loads_what_its_plant_needs(
    plant: tuple[str, ...], more: set[str], tmp_path: Path
) -> None:
    hardware = Path(__file__).parents[2] / "hardware" / "leg.toml"
    bus = ("--bus", hardware) if "can" in plant else ()
    words = ("run", "jump", *DESIGN, "--duration", "0.01", "--plant", *plant, *bus)
    found = loaded(*words, "--out", tmp_path, cwd=tmp_path)
    assert found == {"numpy", "tyro", "pyarrow"} | more

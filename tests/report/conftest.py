import json
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from campaign_tables import MODELS

from legbench.cli import main

SMALL = f"""
format = 1
name = "small <b> & fair"

[base]
design = "{MODELS / "prototype.toml"}"
linkage.kind = "reduced"

[base.imperfections]
link_noise = [1e-4, 1e-4]

[[cells]]
name = "step"
set."controller.kind" = "position-jump"
set.duration = 2.0
grid."setup.kind" = ["hfts", "vfts", "ffs"]
list = [
  {{ "controller.settings.z2" = 1.0, "controller.settings.dz2" = -0.3 }},
  {{ "controller.settings.z2" = 1.8, "controller.settings.dz2" = -0.3 }},
]

[[cells]]
name = "bang-bang"
set."controller.kind" = "bang-bang"
set."controller.settings.threshold" = 0.04
grid."setup.kind" = ["hfts", "vfts"]
grid."controller.settings.z2" = [1.0, 1.8]
set.duration = 3.5

[[cells]]
name = "bang-bang, fixed foot"
list = [{{ "controller.settings.z2" = 1.24, "controller.settings.dz2" = 0.077 }}]
set."controller.kind" = "bang-bang"
set."controller.settings.threshold" = 0.04
set."setup.kind" = "ffs"
set.duration = 6.5

[[cells]]
name = "jump"
set."controller.kind" = "jump"
set.duration = 2.5
"""
"""The paper's campaign, as few runs of an ideal leg as show its statements."""


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a small campaign that kept no recordings."""
    folder = tmp_path_factory.mktemp("small")
    (folder / "small.toml").write_text(SMALL, encoding="utf-8")
    out = folder / "out"
    assert (
        main(["campaign", str(folder / "small.toml"), "--out", str(out), "--executor", "serial"])
        == 0
    )
    return out


@pytest.fixture(scope="session")
def reported(small: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Page of the small campaign with its single figures, and its content as JSON."""
    page = tmp_path_factory.mktemp("report") / "out" / "report.html"
    with redirect_stdout(StringIO()) as printed:
        code = main(["report", str(small), "--out", str(page), "--figures", "png", "--json"])
    assert code == 0
    return page, json.loads(printed.getvalue())

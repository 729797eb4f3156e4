"""A campaign of the paper's experiments, as few runs of an ideal leg as show its statements."""

from pathlib import Path
from unittest.mock import patch

from campaign_tables import MODELS

from legbench.cli import main

IDEAL = f"""
format = 1
name = "small <b> & fair"

[base]
design = "{MODELS / "prototype.toml"}"
linkage.kind = "reduced"

[base.imperfections]
link_noise = [1e-4, 1e-4]
"""
"""What all runs of a leg without flaws, but with noise, have in common."""
JUMP = """
[[cells]]
name = "jump"
set."controller.kind" = "jump"
set.duration = 2.0
"""
STEPS = """
[[cells]]
name = "step"
set."controller.kind" = "position-jump"
set.duration = 1.4
grid."setup.kind" = ["hfts", "vfts", "ffs"]
list = [
  { "controller.settings.z2" = 1.0, "controller.settings.dz2" = -0.3 },
  { "controller.settings.z2" = 1.8, "controller.settings.dz2" = -0.3 },
]

[[cells]]
name = "bang-bang"
set."controller.kind" = "bang-bang"
set."controller.settings.threshold" = 0.04
grid."setup.kind" = ["hfts", "vfts"]
grid."controller.settings.z2" = [1.0, 1.8]
set.duration = 2.0

[[cells]]
name = "bang-bang, fixed foot"
list = [{ "controller.settings.z2" = 1.24, "controller.settings.dz2" = 0.077 }]
set."controller.kind" = "bang-bang"
set."controller.settings.threshold" = 0.04
set."setup.kind" = "ffs"
set.duration = 6.5
"""
SMALL = IDEAL + STEPS + JUMP
"""The paper's campaign, as few runs of an ideal leg as show its statements."""


def campaign(text: str, folder: Path) -> Path:
    """Run a campaign that keeps no recordings; returns its folder."""
    (folder / "small.toml").write_text(text, encoding="utf-8")
    out = folder / "out"
    words = [str(folder / "small.toml"), "--out", str(out), "--executor", "serial"]
    # Threads that step a few legs wait for each other for a quarter of the time.
    with patch("os.cpu_count", return_value=1):
        assert main(["campaign", *words]) == 0
    return out

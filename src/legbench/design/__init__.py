"""Parameters of a leg, their file, and their consequences at rest."""

from legbench.design.leg import LegDesign, Limits, Segment
from legbench.design.toml import load_design, save_design

__all__ = ["LegDesign", "Limits", "Segment", "load_design", "save_design"]

"""What a leg is made of: parameters, their file, and what they imply at rest."""

from legbench.design.leg import LegDesign, Limits, Segment
from legbench.design.toml import load_design, save_design

__all__ = ["LegDesign", "Limits", "Segment", "load_design", "save_design"]

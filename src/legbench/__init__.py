"""legbench: a testbed for segmented legs whose natural motion is a pure radial oscillation."""

__version__ = "0.1.0"

"""The one door to pycma, which warns when it is imported where matplotlib is not installed."""

import warnings

with warnings.catch_warnings():
    warnings.filterwarnings("ignore", message="Could not import matplotlib", category=UserWarning)
    import cma

__all__ = ["cma"]

"""Synthesis of a leg from requirements: search, cost of its bounds, tolerances, manufacture."""

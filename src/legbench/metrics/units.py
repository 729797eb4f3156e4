"""Units of the figures of a summary, for tables, searches and reports."""

from typing import Final

UNITS: Final = {
    "duration": "s",
    "periods": "s",
    "limited_max": "rad",
    "trunk_excursion": "m",
    "foot_clearance": "m",
    "drift": "m",
    "foot_travel": "m",
    "foot_travel_in_hip": "m",
    "hop_freq": "Hz",
    "flight_time": "s",
    "stance_time": "s",
    "apex_change": "m",
    "polar_max": "rad",
    "loop_gap_max": "m",
    "motor_work": "J",
    "damper_loss": "J",
    "impact_loss": "J",
    "stop_loss": "J",
    "contact_loss": "J",
    "other_loss": "J",
}
"""Figure of a summary -> its SI unit; what is not named is a ratio, a count or a word."""

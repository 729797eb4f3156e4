"""The watch over all encoders of a leg asks its momentum only in what it knows of it."""

from test_momentum import PERIOD, POSTURE, SPIN, springs

from legbench.limits.encoder_watch import EncoderWatch
from legbench.limits.safety import SafetyLimits

MOTORS = (POSTURE[0] + 0.2, POSTURE[1] + 0.2)
"""Springs that are wound along q1 + q2, which no support explains [rad]."""


def watching() -> EncoderWatch:
    """Watch over a leg that may sway so far that a sway hides an encoder that is wrong."""
    limits = SafetyLimits(sway=0.2, standing=0.02, joint_speed=60.0, link_error=0.025)
    watch = EncoderWatch(limits, PERIOD, two_encoders=True, momentum=springs(SPIN))
    watch.start(MOTORS)
    return watch


def first_doubt(watch: EncoderWatch, silent: int | None = None) -> int | None:
    """Number of cycles until the leg is doubted, while drive 2 is silent in some."""
    for cycle in range(1, 1300):
        fresh = (True, silent is None or cycle % silent != 0)
        if watch.see(MOTORS, POSTURE, MOTORS, fresh, 1, PERIOD) is not None:
            return cycle
    return None


def test_a_row_without_an_answer_begins_the_averages_anew() -> None:
    assert first_doubt(watching(), silent=30) is None
    assert first_doubt(watching()) is not None


def test_a_start_forgets_what_was_learned_of_the_leg() -> None:
    watch = watching()
    found = first_doubt(watch)
    assert found is not None
    watch.start(MOTORS)
    assert first_doubt(watch) == found

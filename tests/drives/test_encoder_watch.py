"""The watch over all encoders of a leg: whom it doubts first, and when it asks its momentum."""

from collections.abc import Sequence

import pytest
from test_momentum import PERIOD, POSTURE, SPIN, springs

from legbench.limits.encoder_watch import EncoderWatch
from legbench.limits.plausibility import Doubt
from legbench.limits.safety import SafetyLimits

MOTORS = (POSTURE[0] + 0.2, POSTURE[1] + 0.2)
"""Springs that are wound along q1 + q2, which no support explains [rad]."""


def watching() -> EncoderWatch:
    """Watch over a leg that may sway so far that a sway hides an encoder that is wrong."""
    limits = SafetyLimits(sway=0.2, standing=0.02, joint_speed=60.0, link_error=0.025)
    watch = EncoderWatch(limits, PERIOD, two_encoders=True, momentum=springs(SPIN))
    watch.start(MOTORS)
    return watch


def looked(
    watch: EncoderWatch,
    motors: Sequence[float],
    joints: Sequence[float],
    commands: Sequence[float],
    fresh: tuple[bool, bool] = (True, True),
) -> Doubt | None:
    """What a watch says of a cycle in which commands act."""
    watch.expect(commands)
    return watch.see(motors, joints, fresh, 1, PERIOD)


def first_doubt(watch: EncoderWatch, silent: int | None = None) -> int | None:
    """Number of cycles until the leg is doubted, while drive 2 is silent in some."""
    for cycle in range(1, 1300):
        fresh = (True, silent is None or cycle % silent != 0)
        assert looked(watch, MOTORS, POSTURE, MOTORS, fresh) is None
        found = watch.see_momentum()
        # A cycle is held against the momentum once.
        assert watch.see_momentum() is None
        if found is not None:
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


@pytest.mark.parametrize("after", ["start", "silent"])
def test_a_reading_of_before_is_no_first_one_of_what_begins_anew(after: str) -> None:
    counts = []
    for asked in (True, False):
        watch = watching()
        assert first_doubt(watch) is not None
        looked(watch, MOTORS, POSTURE, MOTORS)
        if after == "start":
            watch.start(MOTORS)
        else:
            looked(watch, MOTORS, POSTURE, MOTORS, (True, False))
        if asked:
            assert watch.see_momentum() is None
        counts.append(first_doubt(watch))
    assert None not in counts
    assert counts[0] == counts[1]


# --- motors before links ---------------------------------------------------------------------

JUMPED = (POSTURE[0], POSTURE[1] + 0.3)
"""Link 2 is elsewhere within a cycle, at 300 rad/s."""


def simple(*, two_encoders: bool = True, link_error: float | None = None) -> EncoderWatch:
    """Watch over motors that may be off by 0.03 rad for five cycles, and links up to 60 rad/s."""
    limits = SafetyLimits(following_error=0.03, joint_speed=60.0, link_error=link_error)
    leg = springs(SPIN)
    watch = EncoderWatch(limits, PERIOD, two_encoders=two_encoders, momentum=leg)
    watch.start(POSTURE)
    return watch


def seen(
    watch: EncoderWatch,
    motors: tuple[float, float] = POSTURE,
    joints: tuple[float, float] = POSTURE,
    cycles: int = 1,
) -> str | None:
    """Cause and whom it names, after some cycles under commands that rest."""
    doubt: Doubt | None = None
    for _ in range(cycles):
        doubt = looked(watch, motors, joints, POSTURE)
    return None if doubt is None else f"{doubt.cause}: {' '.join(doubt.message.split()[:2])}"


def test_each_motor_is_named_and_of_both_the_outer_one() -> None:
    off = tuple(angle + 0.1 for angle in POSTURE)
    for motors, name in (
        ((off[0], POSTURE[1]), "motor 1"),
        ((POSTURE[0], off[1]), "motor 2"),
        ((off[0], off[1]), "motor 2"),
    ):
        for two_encoders in (True, False):
            watch = simple(two_encoders=two_encoders)
            assert seen(watch, motors, cycles=5) is None
            assert seen(watch, motors) == f"following error: {name}"


def test_a_link_is_doubted_where_it_has_an_encoder_of_its_own() -> None:
    watch = simple()
    assert seen(watch) is None
    assert seen(watch, joints=JUMPED) == "joint speed: joint 2"
    watch = simple(two_encoders=False)
    assert seen(watch) is None
    assert seen(watch, joints=JUMPED) is None


@pytest.mark.parametrize(
    ("first", "second", "name"),
    [(0.1, 0.0, "motor 1"), (0.0, 0.1, "motor 2"), (0.1, 0.1, "motor 1")],
)
def test_a_motor_that_is_suspected_is_the_cause_of_links_that_are_doubted(
    first: float, second: float, name: str
) -> None:
    watch = simple()
    motors = (POSTURE[0] + first, POSTURE[1] + second)
    assert seen(watch, motors) is None
    assert seen(watch, motors, JUMPED) == f"following error: {name}"
    # A motor that is off for too long is so whatever its links do.
    watch = simple()
    assert seen(watch, motors, cycles=5) is None
    assert seen(watch, motors, JUMPED) == f"following error: motor {2 if second else 1}"


def test_a_start_forgets_where_motors_and_links_were() -> None:
    watch = simple(link_error=0.025)
    assert seen(watch, cycles=3) is None
    elsewhere = (POSTURE[0] + 0.5, POSTURE[1] - 0.5)
    watch.start(elsewhere)
    for _ in range(10):
        assert looked(watch, elsewhere, elsewhere, elsewhere) is None

"""Verdict on the end of a run that has lasted its time, which its plant may turn into a fault."""

from dataclasses import replace

from legbench.loop import Outcome

STOP_FAILED = "stop failed"
"""Cause of a run whose drives could not be shown to be without power in the end."""
GONE = "process data lost"
"""Cause of a run whose plant had not answered for long when its time was over."""


def answered(outcome: Outcome, gone: str | None) -> Outcome:
    """Return how a run ended, as a fault if it lasted its time and its plant had been gone by then.

    A run that the user interrupts claims no time that it did not last; whether its drives are
    without power is what the stop has to show.

    Args:
        outcome: what the loop says.
        gone: why the plant was gone, none if it was there.
    """
    if gone is None or outcome.status != "complete":
        return outcome
    return replace(outcome, status="fault", cause=GONE, message=gone)


def stopped_well(outcome: Outcome, trouble: str | None) -> Outcome:
    """Return how a run ended, as a fault if its drives could not be shown to be without power.

    The first cause stays the cause; what the stop has to tell is added to the message.
    """
    if trouble is None:
        return outcome
    message = trouble if outcome.message is None else f"{outcome.message}; {trouble}"
    return replace(outcome, status="fault", cause=outcome.cause or STOP_FAILED, message=message)

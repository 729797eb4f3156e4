"""What a stop has to tell a person beside the leg, and how whoever leads drives tells it."""

import pytest

from legbench.drives.errors import StopError
from legbench.drives.master.stop_report import DriveLeader, StopReport, add_trouble

POWERED = StopReport(powered=("hip",), states=("0237h: operation enabled",))
SILENT = StopReport(silent=("knee",))
KEEPS = (
    "drive 'hip' keeps its power after the stop (0237h: operation enabled): switch its power off"
)
MUTE = (
    "drive 'knee' no longer answers, so whether it has power is not known: its own watchdogs have "
    "to stop it; switch its power off before you touch the leg"
)


class Leader(DriveLeader):
    """Closes as a test says."""

    def __init__(self, stopped: StopReport | None, late: BaseException | None = None) -> None:
        self._stopped, self.late, self.closed = stopped, late, 0

    @property
    def stopped(self) -> StopReport | None:
        return self._stopped

    def close(self) -> None:
        self.closed += 1
        if self.late is not None:
            raise self.late


def test_a_stop_is_verified_when_no_drive_has_power_or_is_silent() -> None:
    for report, trouble in (
        (StopReport(), None),
        (StopReport(cut_off=("hip",), errors=("BusError: full",)), None),
        (POWERED, KEEPS),
        (SILENT, MUTE),
        (
            StopReport(powered=POWERED.powered, states=POWERED.states, silent=SILENT.silent),
            f"{KEEPS}; {MUTE}",
        ),
    ):
        assert report.trouble == trouble
        assert report.verified is (trouble is None)


def test_every_drive_with_power_has_its_state() -> None:
    both = StopReport(powered=("hip", "knee"), states=("one", "two"))
    assert [part.split(": ")[0] for part in str(both.trouble).split("; ")] == [
        "drive 'hip' keeps its power after the stop (one)",
        "drive 'knee' keeps its power after the stop (two)",
    ]
    with pytest.raises(ValueError, match="zip"):
        _ = StopReport(powered=("hip", "knee"), states=("one",)).trouble


def test_a_repeated_stop_tells_each_trouble_of_both_once() -> None:
    first = StopReport(powered=("hip",), states=("x",), cut_off=("hip",), errors=("a", "b"))
    second = StopReport(silent=("knee",), cut_off=("knee", "hip"), errors=("b", "c"))
    assert second.after(None) == second
    assert second.after(first) == StopReport(
        silent=("knee",), cut_off=("hip", "knee"), errors=("a", "b", "c")
    )


@pytest.mark.parametrize("stopped", [None, StopReport()])
def test_a_lead_that_ends_well_closes_and_says_nothing(stopped: StopReport | None) -> None:
    with Leader(stopped) as lead:
        pass
    assert lead.closed == 1
    with pytest.raises(ZeroDivisionError) as caught, Leader(stopped) as lead:
        raise ZeroDivisionError
    assert lead.closed == 1
    assert not hasattr(caught.value, "__notes__")


def test_a_lead_whose_drives_keep_their_power_ends_in_an_error() -> None:
    with pytest.raises(StopError) as caught, Leader(POWERED):
        pass
    assert str(caught.value) == KEEPS


def test_an_exception_on_its_way_or_out_of_closing_gets_the_trouble_once() -> None:
    with pytest.raises(ZeroDivisionError) as caught, Leader(POWERED) as lead:
        raise ZeroDivisionError
    assert lead.closed == 1
    assert caught.value.__notes__ == [KEEPS]
    add_trouble(caught.value, POWERED)
    assert caught.value.__notes__ == [KEEPS]
    add_trouble(caught.value, SILENT)
    assert caught.value.__notes__ == [KEEPS, MUTE]
    with pytest.raises(KeyboardInterrupt) as late, Leader(SILENT, KeyboardInterrupt()):
        pass
    assert late.value.__notes__ == [MUTE]

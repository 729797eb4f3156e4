"""A configuration as it is written and read back: refusals, and cycles that are fixed."""

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import can
import pytest
from drives_rig import START, config, node, rig
from object_tables import NO_OBJECT, Objects

from legbench.drives.errors import DriveError
from legbench.drives.master.port import Port
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.writing import read_configuration, write_configuration
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.setup.config import Parameter
from legbench.errors import PlantFault

I8, U8, U32 = DataType.INTEGER8, DataType.UNSIGNED8, DataType.UNSIGNED32
READ_ONLY, HARDWARE = 0x06010002, 0x06060000
CYCLE = (
    Parameter(index=0x60C2, sub=2, kind=I8, value=-3),
    Parameter(index=0x60C2, sub=1, kind=U8, value=1),
)
RAMP = Parameter(index=0x6084, sub=0, kind=U32, value=500)


class Refusing(Objects):
    """Drives that refuse some writes, the first times alone if so."""

    def __init__(self, **held: int) -> None:
        super().__init__()
        self.sizes |= {(0x60C2, 1): 1, (0x60C2, 2): 1}
        self.tables[0] |= {(0x60C2, 1): held.get("count", 7), (0x60C2, 2): held.get("index", -2)}
        self.tables[0][0x6084, 0] = 9
        self.refuses_writes: dict[tuple[int, int], list[int]] = {}

    def send(self, message: can.Message) -> None:
        data = bytes(message.data)
        key = (data[1] | data[2] << 8, data[3])
        codes = self.refuses_writes.get(key, [])
        kept = dict(self.aborts)
        if data[0] >> 5 == 1 and codes:
            self.aborts[key] = codes.pop(0)
        super().send(message)
        self.aborts = kept

    def sdo(self) -> SdoPort:
        return SdoPort(Port(cast(Any, self), self), 1)

    def write(self, *parameters: Parameter) -> dict[tuple[int, int], Any]:
        found = write_configuration(self.sdo(), node(0), parameters)
        return {entry.parameter.key: entry for entry in found}


def test_a_cycle_that_can_be_said_is_written_as_it_is() -> None:
    it = Refusing()
    outcomes = it.write(*CYCLE, RAMP)
    assert [entry[1:] for entry in it.wrote] == [
        (0x60C2, 2, -3),
        (0x60C2, 1, 1),
        (0x6084, 0, 500),
    ]
    assert all(entry.agrees and entry.code is None for entry in outcomes.values())


@pytest.mark.parametrize(("there", "count"), [(-4, 10), (-5, 100), (-2, 1), (-6, 1)])
def test_a_cycle_is_fitted_to_a_power_of_ten_that_is_fixed(there: int, count: int) -> None:
    it = Refusing(index=there & 0xFF)
    it.refuses_writes = {(0x60C2, 2): [READ_ONLY]}
    said = count * 10.0**there
    fits = abs(said - 1e-3) < 1e-9
    if fits:
        outcomes = it.write(*CYCLE, RAMP)
        assert outcomes[0x60C2, 1].agrees
        assert outcomes[0x60C2, 2].agrees
    else:
        with pytest.raises(DriveError, match="60C2h"):
            it.write(*CYCLE, RAMP)
    # Every other object is written as it is.
    assert [entry[1:] for entry in it.wrote[:3]] == [
        (0x60C2, 2, -3),
        (0x60C2, 1, count),
        (0x6084, 0, 500),
    ]


def test_the_last_write_of_an_object_decides() -> None:
    it = Refusing()
    it.refuses_writes = {(0x6084, 0): [HARDWARE]}
    outcome = it.write(RAMP, replace(RAMP, value=600))[0x6084, 0]
    assert (outcome.there, outcome.agrees, outcome.code) == (600, True, None)
    it = Refusing()
    it.refuses_writes = {(0x6084, 0): [HARDWARE, HARDWARE]}
    outcome = it.write(RAMP, replace(RAMP, value=9))[0x6084, 0]
    # A value that is there already counts as written.
    assert (outcome.there, outcome.agrees, outcome.code) == (9, True, HARDWARE)


def test_an_object_that_is_not_there_is_neither_tried_again_nor_read() -> None:
    it = Refusing()
    it.refuses_writes = {(0x6084, 0): [NO_OBJECT]}
    outcome = it.write(RAMP)[0x6084, 0]
    assert (outcome.there, outcome.code) == (None, NO_OBJECT)
    assert len(it.wrote) == 1
    assert (0, 0x6084, 0) not in it.asked


@pytest.mark.parametrize(("code", "values"), [(HARDWARE, [3, 1]), (NO_OBJECT, [3])])
def test_what_may_stand_in_its_place_is_tried_where_the_object_is_there(
    code: int, values: list[int]
) -> None:
    # Quick stop (3) when the connection is lost, or else a fault (1).
    stop = Parameter(index=0x6007, sub=0, kind=DataType.INTEGER16, value=3)
    it = Refusing()
    it.sizes[0x6007, 0] = 2
    it.tables[0][0x6007, 0] = 0
    it.refuses_writes = {(0x6007, 0): [code]}
    outcome = it.write(stop)[0x6007, 0]
    assert [entry[3] for entry in it.wrote] == values
    assert (outcome.there, outcome.agrees) == ((1, True) if code == HARDWARE else (None, False))


def test_what_cannot_be_read_keeps_the_reason() -> None:
    it = Refusing()
    it.aborts = {(0x6084, 0): HARDWARE}
    (outcome,) = read_configuration(it.sdo(), [RAMP])
    assert (outcome.there, outcome.agrees, outcome.code) == (None, False, HARDWARE)
    it.aborts = {}
    (outcome,) = read_configuration(it.sdo(), [replace(RAMP, value=9)])
    assert (outcome.there, outcome.agrees, outcome.code) == (9, True, None)
    assert it.wrote == []


# --- a link ----------------------------------------------------------------------------------


def test_a_link_looks_at_its_limits_in_every_cycle_and_begins_anew_where_it_is_told(
    tmp_path: Path,
) -> None:
    with rig(tmp_path) as it:
        link = it.link
        link.start()
        link.command(START)
        began: list[str] = []
        real = link._guard
        fake: Any = type("Guard", (), {})()
        fake.restart_from_applied = lambda: began.append("anew")
        fake.applied = (0.25, 0.5)
        link._guard = fake
        assert link.restart_from_applied() == (0.25, 0.5)
        assert began == ["anew"]
        link._guard = real

        def beyond(sample: object) -> None:
            raise PlantFault("sway", "it sways")

        cast(Any, link._motion).check = beyond
        with pytest.raises(PlantFault, match="it sways"):
            link.exchange()
        assert link.stopped is not None


def test_a_master_that_came_after_the_opening_keeps_its_drives(tmp_path: Path) -> None:
    with rig(tmp_path, bus_config=config()) as it:
        it.link.open()
        began = len(it.network.log or [])
        cast(Any, it.link.cycle).led_by_another = lambda: True

        def refuse() -> None:
            raise PlantFault("second master", "somebody else leads")

        cast(Any, it.link._supervisor).check_no_other_master = refuse
        with pytest.raises(PlantFault, match="somebody else leads"):
            it.link.start()
        # Nothing has been sent.
        assert len(it.network.log or []) == began

"""1010h and 1011h of an emulated drive as CiA 301 (7.5.2.13 and 7.5.2.14) describes them."""

import pytest
from drive_bench import Bench
from drives_rig import MS

from legbench.drives.errors import SdoAbortError
from legbench.drives.protocol.cia402 import Mode
from legbench.drives.protocol.nmt import NmtCommand, NmtState, nmt_frame

SAVE, LOAD = 0x65766173, 0x64616F6C
"""The signatures as the standard prints them: "save" and "load", lowest byte first."""
DECELERATION, HEARTBEAT = 123_456, 55


def restart(bench: Bench, command: NmtCommand = NmtCommand.RESET_NODE) -> None:
    bench.give(nmt_frame(command, 1))
    while bench.drive.state is NmtState.BOOT_UP:
        bench.wait(1)


def changed() -> Bench:
    bench = Bench(configured=False)
    bench.put(0x6085, 0, DECELERATION)
    bench.put(0x1017, 0, HEARTBEAT)
    return bench


def shown(bench: Bench) -> tuple[int, int]:
    return bench.get(0x1017), bench.get(0x6085)


@pytest.mark.parametrize(
    ("part", "kept"),
    [(1, (HEARTBEAT, DECELERATION)), (2, (HEARTBEAT, 0)), (3, (0, DECELERATION))],
)
def test_what_is_stored_outlasts_the_power_and_nothing_else_does(
    part: int, kept: tuple[int, int]
) -> None:
    bench = changed()
    bench.put(0x1010, part, SAVE)
    # The object shows again what it can do: store on command.
    assert bench.get(0x1010, part) == 1
    restart(bench)
    assert shown(bench) == kept


def test_nothing_is_stored_unasked() -> None:
    bench = changed()
    restart(bench)
    assert shown(bench) == (0, 0)


@pytest.mark.parametrize("index", [0x1010, 0x1011])
@pytest.mark.parametrize("signature", [0, 1, SAVE - 1, int.from_bytes(b"save", "big"), 0xFFFFFFFF])
def test_a_wrong_signature_is_refused_and_stores_nothing(index: int, signature: int) -> None:
    bench = changed()
    for value in (signature, LOAD if index == 0x1010 else SAVE):
        with pytest.raises(SdoAbortError) as caught:
            bench.put(index, 1, value)
        assert caught.value.code == 0x08000020
    restart(bench)
    assert shown(bench) == (0, 0)


@pytest.mark.parametrize(
    ("part", "left"), [(1, (0, 0)), (2, (0, DECELERATION)), (3, (HEARTBEAT, 0))]
)
def test_defaults_are_back_after_the_next_reset(part: int, left: tuple[int, int]) -> None:
    bench = changed()
    bench.put(0x1010, 1, SAVE)
    restart(bench)
    bench.put(0x1011, part, LOAD)
    assert bench.get(0x1011, part) == 1
    assert shown(bench) == (HEARTBEAT, DECELERATION)
    restart(bench)
    assert shown(bench) == left


def test_an_enabled_drive_stores_nothing() -> None:
    bench = Bench()
    bench.cycle(5)
    bench.enable()
    with pytest.raises(SdoAbortError) as caught:
        bench.put(0x1010, 1, SAVE)
    assert caught.value.code == 0x08000022


def test_a_whole_configuration_is_back_and_works_after_a_reset() -> None:
    bench = Bench()
    bench.put(0x1010, 1, SAVE)
    told = {key: bench.get(*key) for key in ((0x1400, 1), (0x1600, 1), (0x1A00, 2), (0x60C2, 2))}
    restart(bench)
    bench.wait(4)
    assert {key: bench.get(*key) for key in told} == told
    assert bench.get(0x6061) == Mode.CYCLIC_SYNCHRONOUS_POSITION
    bench.target = bench.get(0x6064)
    bench.give(nmt_frame(NmtCommand.START, 1))
    bench.cycle(3)
    bench.enable()


def test_neither_commands_nor_signatures_are_parameters() -> None:
    bench = changed()
    bench.put(0x607A, 0, 4711)
    bench.put(0x6040, 0, 6)
    bench.put(0x1010, 1, SAVE)
    restart(bench)
    assert (bench.get(0x607A), bench.get(0x6040)) == (0, 0)
    assert bench.now_ns % MS == 0

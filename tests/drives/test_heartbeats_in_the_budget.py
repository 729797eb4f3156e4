"""Heartbeats in front of SYNC, answers and commands: what the budget says and what the wire shows.

A frame on the wire is not interrupted (ISO 11898-1). Both drives and the master send heartbeats, so
that one may have begun before each of the three.
"""

from dataclasses import replace
from pathlib import Path

import can
import pytest
from drives_rig import START, Rig, config, rig

from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.protocol.frame import Frame
from legbench.drives.setup.exchange import check_budget, exchanges
from legbench.errors import ConfigError

SYNC, ANSWERS, COMMANDS, BEATS = 0x080, (0x181, 0x182), (0x201, 0x202), (0x701, 0x702, 0x77E)
SLOWEST_US = 250
US = 1000
BUS = config(heartbeat_ms=100)
"""The bits of this bus are as long as microseconds: 1 Mbit/s."""


def message(cob_id: int, data: bytes = b"") -> can.Message:
    return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)


def wait_for(it: Rig, cob_ids: tuple[int, ...], since: int) -> int:
    """Let time pass until frames have been on the wire; when the last one has ended [ns]."""
    log = it.network.log
    assert log is not None
    for _ in range(1000):
        ended = {frame.cob_id: at_ns for at_ns, frame in log[since:]}
        if all(cob_id in ended for cob_id in cob_ids):
            return max(ended[cob_id] for cob_id in cob_ids)
        it.network.advance(it.network.now_ns + US)
    raise AssertionError(f"{cob_ids} have not come")


def one_exchange(folder: Path, beats: int) -> tuple[float, float, list[Frame]]:
    """Hand an exchange to the wire, heartbeats beginning 1 us before SYNC, answers and commands.

    Returns:
        End of the last answer and of the last command after the tick [us], and all frames.
    """
    slowest = [Behaviour(start_pos=pos, reply_delay_us=(SLOWEST_US, SLOWEST_US)) for pos in START]
    with rig(folder, bus_config=BUS, behaviours=slowest) as it:
        it.link.start()
        it.run(5)
        network, others = it.network, LockstepBus("beats", network=it.network)
        network.advance(network.now_ns + 1500 * US)  # The last commands are long out.
        since = len(network.log or [])

        def in_front(place: int, at_ns: int) -> None:
            network.advance(at_ns - US)
            if place < beats:
                others.send(message(BEATS[place], b"\x05"))
            network.advance(at_ns)

        tick_ns = network.now_ns + 100 * US
        in_front(0, tick_ns)
        it.bus.send(message(SYNC))
        in_front(1, wait_for(it, (SYNC,), since) + SLOWEST_US * US)
        answered_ns = wait_for(it, ANSWERS, since)
        in_front(2, answered_ns + US)
        for cob_id in COMMANDS:
            it.bus.send(message(cob_id, it.link.cycle.axes[0].frames(0x0F)[0][1]))
        commanded_ns = wait_for(it, COMMANDS, since)
        frames = [frame for _, frame in (network.log or [])[since:]]
        others.shutdown()
    return 1e-3 * (answered_ns - tick_ns), 1e-3 * (commanded_ns - tick_ns), frames


def test_each_heartbeat_in_front_is_in_the_budget(tmp_path: Path) -> None:
    (budget,) = exchanges(BUS)
    assert budget.answers_us == 55 + SLOWEST_US + 2 * 135 + 2 * 65
    assert budget.commands_us == budget.answers_us + 2 * 115 + 65
    answered, commanded, frames = one_exchange(tmp_path, beats=3)
    assert [frame.cob_id for frame in frames] == [
        *(BEATS[0], SYNC, BEATS[1], *ANSWERS, BEATS[2], *COMMANDS)
    ]
    # Bits are stuffed as badly as can be; each heartbeat begins 1 us before it is in the way.
    assert answered == pytest.approx(budget.answers_us - 2, abs=0.5)
    assert commanded == pytest.approx(budget.commands_us - 2, abs=1.5)


def test_the_wire_without_heartbeats_is_so_much_faster(tmp_path: Path) -> None:
    (budget,) = exchanges(BUS)
    answered, commanded, frames = one_exchange(tmp_path, beats=0)
    assert [frame.cob_id for frame in frames] == [SYNC, *ANSWERS, *COMMANDS]
    assert answered == pytest.approx(budget.answers_us - 2 * 65, abs=0.5)
    assert commanded == pytest.approx(budget.commands_us - 3 * 65, abs=1.5)


def test_a_channel_with_one_drive_has_two_that_send_heartbeats() -> None:
    first, second = BUS.nodes
    split = replace(BUS, channel="can0", nodes=(first, replace(second, channel="can1")))
    for one in exchanges(split):
        assert one.answers_us == 55 + SLOWEST_US + 135 + 2 * 65
        assert one.commands_us == one.answers_us + 115


def test_nodes_that_send_several_heartbeats_a_cycle_are_in_front_of_all_three() -> None:
    first, second = BUS.nodes
    often = replace(
        *(BUS,),
        channel="can0",
        nodes=(first, replace(second, channel="can1")),
        period_us=4000,
        heartbeat_ms=2,
        master_heartbeat_ms=100,
    )
    for one in exchanges(often):
        assert one.commands_us == 55 + SLOWEST_US + 135 + 115 + 3 * 65


def test_a_deadline_with_room_for_one_heartbeat_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"may come 705 us after SYNC .* is 704 us: raise it to"):
        check_budget(replace(BUS, tpdo_deadline_us=704))
    check_budget(replace(BUS, tpdo_deadline_us=705))
    check_budget(BUS)

"""Speeds that a homing method needs, and the statuswords with which it ends."""

import math
from dataclasses import replace
from typing import Any, cast

import pytest
from drives_rig import node
from service_rig import BENCH, opened, written

from legbench.commissioning import home as home_module
from legbench.commissioning.home import home
from legbench.drives.errors import DriveError
from legbench.drives.protocol.frame import Frame
from legbench.errors import ConfigError

COUNTS_PER_RAD = (1 << 20) / (2.0 * math.pi)


class Speeds:
    """A drive's 6099h: speed to search a switch, and to search zero [counts/s]."""

    def __init__(self, switch: int, zero: int) -> None:
        self._speeds = {1: switch, 2: zero}

    def get_int(self, index: int, sub: int, _kind: object) -> int:
        assert index == 0x6099
        return self._speeds[sub]


def refusal(method: int, switch: int, zero: int) -> str | None:
    try:
        home_module._check_speed(cast(Any, Speeds(switch, zero)), node(1), method)
    except ConfigError as error:
        return str(error)
    return None


@pytest.mark.parametrize(
    ("method", "needs"),
    [
        # CiA 402-2: 1 to 14 with index pulse, 17 to 30 without, 33 and 34 the pulse alone.
        *[(method, (True, True)) for method in (1, 14, 17, 30)],
        *[(method, (False, True)) for method in (33, 34)],
        *[(method, (True, False)) for method in (-1, -128)],
    ],
)
def test_a_search_needs_the_speeds_that_it_uses(method: int, needs: tuple[bool, bool]) -> None:
    assert refusal(method, 1000, 1000) is None
    told = [refusal(method, 0, 1000), refusal(method, 1000, 0)]
    assert [said is not None for said in told] == list(needs)
    if needs[0]:
        assert 'no speed to search a switch or stop with; give "6099:01 u32"' in str(told[0])
    if needs[1]:
        assert 'no speed to search zero with; give "6099:02 u32"' in str(told[1])


@pytest.mark.parametrize("sub", [1, 2])
def test_a_search_is_at_most_as_fast_as_1_rad_a_second(sub: int) -> None:
    for counts, refused in (
        (math.floor(COUNTS_PER_RAD), False),
        (math.ceil(COUNTS_PER_RAD), True),
    ):
        speeds = [1000, 1000]
        speeds[sub - 1] = counts
        assert (refusal(17, *speeds) is not None) is refused


class Looks:
    """A master whose drive shows one statusword after the other, 5 ms apart."""

    def __init__(self, *words: int) -> None:
        self.words, self.now, self._node, self._timebase = list(words), 0, node(0), self

    def now_ns(self) -> int:
        return self.now

    def _look(self) -> int:
        self.now += 5_000_000
        return self.words.pop(0) if len(self.words) > 1 else self.words[0]


def ended(*words: int) -> tuple[str | None, int]:
    """What ended a homing of 0.1 s, and the words that are left."""
    it = Looks(*words)
    try:
        home_module._Master.await_end(cast(Any, it), 0.1)
    except DriveError as error:
        return str(error), len(it.words)
    return None, len(it.words)


ENABLED, REACHED, ATTAINED, ERROR = 0x0237, 1 << 10, 1 << 12, 1 << 13
"""Operation enabled, and bits 10, 12 and 13 of the statusword in homing mode (CiA 402-2)."""


def test_a_homing_has_ended_once_it_is_attained_and_its_target_reached() -> None:
    # Neither bit alone: 10 alone is a homing that has not begun, 12 alone one that still moves.
    both = ENABLED | REACHED | ATTAINED
    assert ended(ENABLED, ENABLED | REACHED, ENABLED | ATTAINED, both, ENABLED) == (None, 1)
    told, _ = ended(ENABLED | REACHED)
    assert told == (
        "homing of 'hip' has not ended within 0.1 s; raise --timeout, or the speeds of a search "
        "(6099h) in its parameters"
    )
    assert ended(ENABLED | ATTAINED)[0] == told


@pytest.mark.parametrize("word", [ENABLED | ERROR, ENABLED | REACHED | ATTAINED | ERROR, 0x0218])
def test_a_homing_that_failed_is_told_with_its_statusword(word: int) -> None:
    told, left = ended(ENABLED, word, ENABLED)
    assert told == f"homing of 'hip' failed with statusword {word:04X}h"
    assert left == 1


def test_all_nodes_are_pre_operational_before_any_is_configured_and_again_in_the_end() -> None:
    session, network = opened()
    with session:
        home(session, session.config.nodes[0], 37)
        orders = [frame for frame in written(network) if frame.cob_id == 0]
    down = [Frame(0, b"\x80\x01"), Frame(0, b"\x80\x02")]
    assert orders == [*down, Frame(0, b"\x01\x01"), *down]
    assert written(network)[: len(down)] == down


@pytest.mark.parametrize(("beat_ms", "rest_us"), [(2, 1000), (4, 2000), (10, 5000), (50, 5000)])
def test_a_drive_is_looked_at_twice_a_heartbeat_and_every_5_ms_at_least(
    beat_ms: int, rest_us: int
) -> None:
    session, _ = opened(replace(BENCH, master_heartbeat_ms=beat_ms))
    with session:
        master = home_module._Master(session, session.bring_up(), session.config.nodes[0])
        assert master._rest_ns == 1000 * rest_us


@pytest.mark.parametrize("timeout", [0.0, -1.0, 600.1, math.nan])
def test_a_homing_has_some_time_and_ten_minutes_at_most(timeout: float) -> None:
    session, network = opened()
    with session, pytest.raises(ConfigError, match=f"timeout is {timeout:g} s"):
        home(session, session.config.nodes[0], 37, timeout=timeout)
    assert written(network) == []
    home_module._check_asked(node(0), 37, 600.0)

"""Homing methods of CiA 402-2 as sequences of moves; pure.

A move goes in one direction until a switch or the index pulse of the encoder is met. Methods 17 to
30 are 1 to 14 without the last move, to the index pulse.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum


class Until(Enum):
    """Condition that ends a move."""

    NEGATIVE_LIMIT = "negative limit switch"
    POSITIVE_LIMIT = "positive limit switch"
    HOME = "home switch"
    INDEX = "index pulse"
    STOP = "mechanical stop"


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """One leg of a search."""

    direction: int
    """Sign of the speed: 1 or -1."""
    until: Until
    on: bool = True
    """Whether the switch has to become active, or inactive."""
    fast: bool = False
    """Whether the speed is 6099h:01, for a switch; otherwise 6099h:02, for zero."""
    turns: bool = False
    """Whether a limit switch on the way turns the search round, once."""


def mirrored(moves: tuple[Move, ...]) -> tuple[Move, ...]:
    """Moves of the method that searches the other way."""
    other = {
        Until.NEGATIVE_LIMIT: Until.POSITIVE_LIMIT,
        Until.POSITIVE_LIMIT: Until.NEGATIVE_LIMIT,
    }
    return tuple(
        replace(move, direction=-move.direction, until=other.get(move.until, move.until))
        for move in moves
    )


def _move(direction: int, until: Until, *, on: bool = True) -> Move:
    return Move(direction=direction, until=until, on=on)


_INDEX_UP, _INDEX_DOWN = _move(1, Until.INDEX), _move(-1, Until.INDEX)
_ON_UP, _ON_DOWN = _move(1, Until.HOME), _move(-1, Until.HOME)
_OFF_UP, _OFF_DOWN = _move(1, Until.HOME, on=False), _move(-1, Until.HOME, on=False)
_FIND = replace(_ON_UP, fast=True)
_FIND_OR_TURN = replace(_FIND, turns=True)
_LIMIT = (
    Move(direction=-1, until=Until.NEGATIVE_LIMIT, fast=True),
    _move(1, Until.NEGATIVE_LIMIT, on=False),
    _INDEX_UP,
)
_HARD_STOP = (Move(direction=-1, until=Until.STOP, fast=True),)


def _indexed() -> Mapping[int, tuple[Move, ...]]:
    """Methods 1 to 14, all of which end at an index pulse (CiA 402-2, homing methods)."""
    upwards = {
        1: _LIMIT,
        3: (_FIND, _OFF_DOWN, _INDEX_DOWN),
        4: (_FIND, _OFF_DOWN, _ON_UP, _INDEX_UP),
        7: (_FIND_OR_TURN, _OFF_DOWN, _INDEX_DOWN),
        8: (_FIND_OR_TURN, _OFF_DOWN, _ON_UP, _INDEX_UP),
        9: (_FIND_OR_TURN, _OFF_UP, _ON_DOWN, _INDEX_DOWN),
        10: (_FIND_OR_TURN, _OFF_UP, _INDEX_UP),
    }
    mirror = {1: 2, 3: 5, 4: 6, 7: 11, 8: 12, 9: 13, 10: 14}
    return upwards | {mirror[method]: mirrored(moves) for method, moves in upwards.items()}


METHODS: Mapping[int, tuple[Move, ...]] = {
    **_indexed(),
    **{method + 16: moves[:-1] for method, moves in _indexed().items()},
    33: (_INDEX_DOWN,),
    34: (_INDEX_UP,),
    35: (),
    37: (),
    -1: (*_HARD_STOP, _INDEX_UP),
    -2: mirrored((*_HARD_STOP, _INDEX_UP)),
    -3: _HARD_STOP,
    -4: mirrored(_HARD_STOP),
}
"""Method (6098h) -> its moves; -1 to -4 are the maker's own, against a mechanical stop."""

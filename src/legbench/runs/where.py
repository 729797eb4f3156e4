"""Conditions on runs, such as `controller = jump and (rating > 0.97 or not status = complete)`.

A comparison is a column, an operator and a value: a number, a word, or any text in quotes. It is
false for a run that does not have the column, whatever the operator, but for `= none`. `and` binds
closer than `or`, `not` closer than both.
"""

import operator
import re
from collections.abc import Callable, Mapping
from typing import Any, Final, final

from legbench.errors import ConfigError
from legbench.runs.columns import column_named

Condition = Callable[[Mapping[str, Any]], bool]

OPERATORS: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "=": operator.eq,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
TOKEN: Final = re.compile(
    r"""\s*(?:(?P<operator><=|>=|==|!=|<|>|=)|(?P<bracket>[()])"""
    r"""|"(?P<double>[^"]*)"|'(?P<single>[^']*)'|(?P<word>[^\s()<>=!"']+))"""
)
NONE: Final = "none"
WORDS: Final = {"true": True, "false": False, NONE: None}
JOINING: Final = ("and", "or", "not")


def parse_where(text: str, names: list[str]) -> Condition:
    """Return the condition that a text states on columns with these names.

    Raises:
        ConfigError: the text is no condition, or no run has a column of it.
    """
    parser = _Parser(text, names)
    condition = parser.either()
    parser.end()
    return condition


def comparison(name: str, sign: str, word: str, wanted: Any) -> Condition:
    """Return the condition that a column stands so to a value, which a word was taken for."""
    compare = OPERATORS[sign]

    def holds(row: Mapping[str, Any]) -> bool:
        found = row.get(name)
        if wanted is None:
            return compare(found is None, True)
        if found is None:
            return False
        number = isinstance(found, bool | int | float)
        if number != isinstance(wanted, bool | int | float):
            # A version such as 1.0 is a text, and a word never equals a number.
            return compare(str(found), word)
        return compare(found, wanted)

    return holds


@final
class _Parser:
    """Reads a condition from left to right."""

    def __init__(self, text: str, names: list[str]) -> None:
        self._text, self._names = text, names
        self._tokens: list[tuple[str, str]] = []
        place = 0
        while text[place:].strip():
            match = TOKEN.match(text, place)
            if match is None or match.lastgroup is None:
                raise self._refusal(f"{text[place:].strip()[:20]!r} is no part of a condition")
            self._tokens.append((match.lastgroup, match[match.lastgroup]))
            place = match.end()
        self._place = 0

    def either(self) -> Condition:
        """Read conditions joined by `or`."""
        parts = [self._both()]
        while self._takes("word", "or"):
            parts.append(self._both())
        return parts[0] if len(parts) == 1 else lambda row: any(part(row) for part in parts)

    def end(self) -> None:
        """Check that nothing is left."""
        if self._place < len(self._tokens):
            _, text = self._tokens[self._place]
            raise self._refusal(f"{text!r} comes where `and`, `or` or the end should")

    def _both(self) -> Condition:
        parts = [self._one()]
        while self._takes("word", "and"):
            parts.append(self._one())
        return parts[0] if len(parts) == 1 else lambda row: all(part(row) for part in parts)

    def _one(self) -> Condition:
        if self._takes("word", "not"):
            inner = self._one()
            return lambda row: not inner(row)
        if self._takes("bracket", "("):
            inner = self.either()
            if not self._takes("bracket", ")"):
                raise self._refusal("a bracket is not closed")
            return inner
        return self._comparison()

    def _comparison(self) -> Condition:
        kind, name = self._next("a figure or setting")
        if kind != "word" or name in JOINING:
            raise self._refusal(f"{name!r} comes where a figure or setting should")
        column = column_named(name, self._names)
        kind, sign = self._next(f"an operator after {name!r}")
        if kind != "operator":
            raise self._refusal(f"{sign!r} is no operator; there are {', '.join(OPERATORS)}")
        kind, value = self._next(f"a value after '{name} {sign}'")
        if kind in ("operator", "bracket"):
            raise self._refusal(f"{value!r} comes where a value should")
        return comparison(column, sign, value, _value(value) if kind == "word" else value)

    def _takes(self, kind: str, text: str) -> bool:
        """Go past a token if it is this one; whether it was."""
        found = self._tokens[self._place : self._place + 1] == [(kind, text)]
        self._place += found
        return found

    def _next(self, wanted: str) -> tuple[str, str]:
        if self._place == len(self._tokens):
            raise self._refusal(f"it ends where {wanted} should come")
        self._place += 1
        return self._tokens[self._place - 1]

    def _refusal(self, why: str) -> ConfigError:
        return ConfigError(
            f"--where {self._text!r}: {why}; write such as 'controller=jump and rating>0.97'"
        )


def _value(word: str) -> Any:
    """Number, truth value or none that a word stands for, else the word."""
    if word in WORDS:
        return WORDS[word]
    try:
        return float(word)
    except ValueError:
        return word

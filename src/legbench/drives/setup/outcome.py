"""Outcome of writing an object: taken, there already, rounded, or missing; pure."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from legbench.drives.protocol.objects import Key, name_of
from legbench.drives.protocol.sdo import ABSENT, LENGTHS, MEANINGS, Abort
from legbench.drives.setup.needs import BY_THE_MAKER, TABLE, Need, NeedRow, row_of
from legbench.drives.setup.parameters import PDO_OBJECTS, Parameter

MISSING = (Abort.NO_OBJECT, Abort.NO_SUB_INDEX)
"""Abort codes of a drive that has no such object."""
CYCLE, CYCLE_INDEX = (0x60C2, 1), (0x60C2, 2)
"""Interpolation time: its value, and its power of ten, which mean something together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectOutcome:
    """Outcome of one object of the configuration on one drive."""

    parameter: Parameter
    there: int | None
    """Value that the drive holds; none where there is none, or it cannot be read."""
    agrees: bool
    """Whether that value does what the wanted one does."""
    code: int | None = None
    """Abort code with which the drive refused the object; none if it took it."""

    @property
    def row(self) -> NeedRow:
        """Entry of the table of needs."""
        return row_of(self.parameter)

    @property
    def name(self) -> str:
        """Name of the object in messages."""
        return name_of(*self.parameter.key)

    @property
    def missing(self) -> bool:
        """Whether the drive has no such object.

        Some say so by a general code; then the object cannot be read, either.
        """
        return self.code in MISSING or (self.code in ABSENT and self.there is None)

    @property
    def passes(self) -> bool:
        """Whether the drive may be used: what is required agrees, or may be missing.

        A protection may be refused, since another one may replace it. One that the drive has taken
        and does not hold, or takes for an object of another length, is a doubt.
        """
        row = self.row
        if self.agrees or (self.missing and row.may_lack):
            return True
        if row.need is Need.PROTECTION:
            return self.code is not None and self.code not in LENGTHS
        return row.need is Need.OPTIONAL

    @property
    def why(self) -> str:
        """Description of what the drive answered."""
        wanted = self.parameter.value
        if self.code is None:
            return f"wrote {wanted}, reads {self.there}; the drive does not take this value"
        if self.missing:
            return f"the drive has no such object (abort {self.code:08X}h)"
        known = {int(abort): text for abort, text in MEANINGS.items()}
        refusal = f"{known.get(self.code, 'aborted')} (abort {self.code:08X}h)"
        held = "" if self.there is None else f", holds {self.there}, wanted {wanted}"
        return refusal + held

    @property
    def demand(self) -> str:
        """Reason for which the drive cannot be used, and the way out."""
        if self.row.need is Need.PROTECTION:
            return f"{self.row.purpose}: give a value and a type that the drive takes"
        way = self.row.way or (BY_THE_MAKER if self.parameter.key in TABLE else "")
        if self.parameter.index in PDO_OBJECTS:
            way = "map its objects into the PDOs that the drive has, in the way that it has them"
        return f"it is required: {self.row.purpose}{': ' if way else ''}{way}"

    @property
    def line(self) -> str | None:
        """Line that a person has to know; none where the drive took what was wanted.

        It says what is not protected and what takes its place, or what the drive made of a value.
        """
        row = self.row
        if not self.agrees:
            if not row.instead and self.missing:
                return None
            return f"{self.name}: {self.why}; {row.loss}"
        if self.there in (None, self.parameter.value) or not row.instead:
            return None
        return f"{self.name}: wanted {self.parameter.value}, the drive holds {self.there}"


def judge(
    parameters: Iterable[Parameter],
    held: Mapping[Key, int],
    codes: Mapping[Key, int],
) -> tuple[ObjectOutcome, ...]:
    """Return what became of every object, the last value of each, in writing order.

    Args:
        parameters: objects as they were written; one may be written several times.
        held: what the drive holds, as far as it can be read.
        codes: abort codes of the last write of those that the drive refused, or of reading those
            that were not written.
    """
    wanted = {parameter.key: parameter for parameter in parameters}
    same_cycle = _period(held) is not None and _period(held) == _period(
        {key: parameter.value for key, parameter in wanted.items()}
    )
    outcomes: list[ObjectOutcome] = []
    for key, parameter in wanted.items():
        there, code = held.get(key), codes.get(key)
        if there is not None:
            agrees = row_of(parameter).agrees(parameter.value, there)
            agrees = agrees or (same_cycle and key in (CYCLE, CYCLE_INDEX))
        else:
            # An object that is write-only was taken, and nobody can say more.
            agrees = code is None or code == Abort.WRITE_ONLY
        outcomes.append(ObjectOutcome(parameter=parameter, there=there, agrees=agrees, code=code))
    return tuple(outcomes)


def _period(values: Mapping[Key, int]) -> Fraction | None:
    """Interpolation time that 60C2h says [s]; none where one half of it is missing."""
    if CYCLE not in values or CYCLE_INDEX not in values:
        return None
    return values[CYCLE] * Fraction(10) ** values[CYCLE_INDEX]


def cycle_count(value: int, index: int, there: int) -> int | None:
    """Value of 60C2h:01 that says the same time at another power of ten.

    Args:
        value: wanted 60C2h:01.
        index: wanted 60C2h:02.
        there: 60C2h:02 of a drive that does not let it be changed.

    Returns:
        None where no whole number from 1 to 255 says it.
    """
    count = value * Fraction(10) ** (index - there)
    return int(count) if count.denominator == 1 and 1 <= count <= 255 else None


def held_by(outcomes: Iterable[ObjectOutcome]) -> dict[Key, int]:
    """Return what a drive holds of its configuration, by index and sub-index.

    An object that was taken and cannot be read counts as taken; a missing one is left out.
    """
    return {
        entry.parameter.key: entry.parameter.value if entry.there is None else entry.there
        for entry in outcomes
        if entry.there is not None or entry.agrees
    }

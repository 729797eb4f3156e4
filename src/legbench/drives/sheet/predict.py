"""Prediction of how a drive takes its configuration, from its data sheet alone; pure."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import takewhile

from legbench.drives.protocol.datatypes import (
    FORMATS,
    DataType,
    fitting_type,
    range_of,
    size_of,
)
from legbench.drives.protocol.frame import COB_INVALID, COB_MASK
from legbench.drives.protocol.objects import PDO_COUNT, Access, Key
from legbench.drives.protocol.sdo import Abort
from legbench.drives.setup.config import BusConfig, NodeConfig, Parameter
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.needs import MAPPINGS, RPDOS, TPDOS, row_of
from legbench.drives.setup.outcome import CYCLE, CYCLE_INDEX, ObjectOutcome, cycle_count, judge
from legbench.drives.sheet.data_sheet import DataSheet


def predict(sheet: DataSheet, bus: BusConfig, node: NodeConfig) -> tuple[ObjectOutcome, ...]:
    """Return what becomes of every object of a node's configuration on the drive of a data sheet.

    An object that is fixed and whose value the data sheet does not tell is given the benefit of the
    doubt: the drive itself shows it, when it is configured.
    """
    held: dict[Key, int] = {}
    codes: dict[Key, int] = {}
    plan = list(configuration(bus, node))
    plan += _beyond(sheet, node, {parameter.index for parameter in plan})
    wanted = {parameter.key: parameter.value for parameter in plan}
    for parameter in plan:
        if parameter.key == CYCLE and CYCLE_INDEX in codes:
            parameter = _fitting(sheet, parameter, wanted[CYCLE_INDEX])
        code, value = _written(sheet, node, parameter)
        if code is None:
            codes.pop(parameter.key, None)
        else:
            codes[parameter.key] = code
        if value is not None:
            held[parameter.key] = value
    return judge(plan, held, codes)


def _written(
    sheet: DataSheet, node: NodeConfig, parameter: Parameter
) -> tuple[int | None, int | None]:
    """Abort code of a write, and what the object holds afterwards."""
    key = parameter.key
    entry = sheet.objects.get(key)
    if entry is None:
        known = any(index == parameter.index for index, _ in sheet.objects)
        return (Abort.NO_SUB_INDEX if known else Abort.NO_OBJECT), None
    there = sheet.default(key, node.node_id)
    if not _fits(entry.kind, parameter):
        return Abort.TYPE_LENGTH, None
    if entry.access in (Access.RO, Access.CONST):
        return Abort.READ_ONLY, parameter.value if there is None else there
    if _is_mapping(parameter) and sheet.stays_on(parameter.index - 0x200):
        # A PDO that is on cannot be mapped.
        return Abort.DEVICE_STATE, there
    low, high = sheet.limits.get(key, range_of(entry.kind))
    for value in (parameter.value, *row_of(parameter).fallbacks.get(parameter.value, ())):
        if low <= value <= high:
            return None, value
    return (Abort.TOO_HIGH if parameter.value > high else Abort.TOO_LOW), there


def _fits(kind: DataType, parameter: Parameter) -> bool:
    """Whether an object takes a value, in a length of its own where it has another one."""
    size = size_of(kind)
    if size is None or kind not in FORMATS:
        return False
    same = size == size_of(parameter.kind)
    return same or fitting_type(parameter.kind, size, parameter.value) is not None


def _is_mapping(parameter: Parameter) -> bool:
    return any(parameter.index in mapping for mapping in MAPPINGS)


def _fitting(sheet: DataSheet, parameter: Parameter, index: int) -> Parameter:
    there = sheet.default(CYCLE_INDEX, 0)
    count = None if there is None else cycle_count(parameter.value, index, there)
    return parameter if count is None else replace(parameter, value=count)


def _beyond(sheet: DataSheet, node: NodeConfig, known: set[int]) -> Iterator[Parameter]:
    """Yield the PDOs beyond the fourth that are on at power-on, as they are switched off.

    They are looked for in a row, and the first that is missing ends the search.
    """
    for indices in (RPDOS, TPDOS):
        for index in takewhile(lambda each: sheet.has((each, 1)), indices[PDO_COUNT:]):
            cob = sheet.default((index, 1), node.node_id) or 0
            if index not in known and not cob & COB_INVALID:
                kind = sheet.objects[index, 1].kind
                yield Parameter(index=index, sub=1, kind=kind, value=COB_INVALID | cob & COB_MASK)

"""Writing the configuration of a drive by SDO, and reading back what the drive made of it."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from legbench.drives.errors import DriveError, SdoAbortError
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.frame import COB_INVALID, COB_MASK
from legbench.drives.protocol.objects import PDO_COUNT, Key
from legbench.drives.setup.config import NodeConfig
from legbench.drives.setup.needs import RPDOS, TPDOS, row_of
from legbench.drives.setup.outcome import (
    CYCLE,
    CYCLE_INDEX,
    MISSING,
    ObjectOutcome,
    cycle_count,
    judge,
)
from legbench.drives.setup.parameters import Parameter


def write_configuration(
    sdo: SdoPort, node: NodeConfig, parameters: Sequence[Parameter]
) -> tuple[ObjectOutcome, ...]:
    """Write objects in order and read back the last value of each.

    A refusal ends nothing here: a value that is there already counts as written.

    Args:
        sdo: access to the drive.
        node: the drive, for messages.
        parameters: objects in writing order; one may occur several times.

    Returns:
        What became of each object, those included that nothing is lost without.

    Raises:
        DriveError: the drive does not take what is required, see `setup.needs`.
        NoAnswerError: it does not answer.
        BusError: the bus does not work.
    """
    codes: dict[Key, int] = {}
    written = [*parameters, *unknown_process_data(sdo, parameters)]
    wanted = {parameter.key: parameter.value for parameter in written}
    for parameter in written:
        if parameter.key == CYCLE and CYCLE_INDEX in codes:
            parameter = _fitting(sdo, parameter, wanted.get(CYCLE_INDEX, 0))
        code = _put(sdo, parameter)
        if code is None:
            codes.pop(parameter.key, None)
        else:
            codes[parameter.key] = code
    outcomes = judge(written, dict(_held(sdo, written, codes)), codes)
    check_outcomes(node, outcomes)
    return outcomes


def read_configuration(sdo: SdoPort, parameters: Sequence[Parameter]) -> tuple[ObjectOutcome, ...]:
    """Compare what a drive holds with a configuration; nothing is written.

    Raises:
        NoAnswerError: the drive does not answer.
        BusError: the bus does not work.
    """
    codes: dict[Key, int] = {}
    wanted = [*parameters, *unknown_process_data(sdo, parameters)]
    held = dict(_held(sdo, wanted, codes))
    return judge(wanted, held, codes)


def check_outcomes(node: NodeConfig, outcomes: Iterable[ObjectOutcome]) -> None:
    """Refuse a drive that does not hold what is required; raises DriveError for the first object.

    Where the drive has aborted the transfer, the error is an SdoAbortError with its code.
    """
    for outcome in outcomes:
        if outcome.passes:
            continue
        text = (
            f"node {node.node_id} ('{node.name}'), {outcome.name}: {outcome.why}; {outcome.demand}"
        )
        if outcome.code is None:
            raise DriveError(text)
        error = SdoAbortError(outcome.code, *outcome.parameter.key, "")
        error.args = (text,)
        raise error


def unknown_process_data(sdo: SdoPort, parameters: Iterable[Parameter]) -> Iterator[Parameter]:
    """Find process data beyond the fourth object each way that is switched on, to switch it off.

    CiA 301 numbers them in a row; the first that is missing ends the search. Those that the
    configuration names are left to it.
    """
    known = {parameter.index for parameter in parameters}
    for indices in (RPDOS, TPDOS):
        for index in indices[PDO_COUNT:]:
            try:
                there = sdo.get_int(index, 1, DataType.UNSIGNED32)
            except SdoAbortError:
                break
            if not there & COB_INVALID and index not in known:
                value = COB_INVALID | there & COB_MASK
                yield Parameter(index=index, sub=1, kind=DataType.UNSIGNED32, value=value)


def _fitting(sdo: SdoPort, parameter: Parameter, index: int) -> Parameter:
    """Return 60C2h:01 for a drive whose power of ten (60C2h:02) is fixed."""
    try:
        there = sdo.get_int(*CYCLE_INDEX, DataType.INTEGER8)
    except SdoAbortError:
        return parameter
    count = cycle_count(parameter.value, index, there)
    return parameter if count is None else replace(parameter, value=count)


def _put(sdo: SdoPort, parameter: Parameter) -> int | None:
    """Write an object, or what may stand in its place; returns the abort code of a refusal."""
    refused: int | None = None
    for value in (parameter.value, *row_of(parameter).fallbacks.get(parameter.value, ())):
        try:
            sdo.put(parameter.index, parameter.sub, parameter.kind, value)
        except SdoAbortError as error:
            refused = refused or error.code
            if error.code in MISSING:
                break
        else:
            return None
    return refused


def _held(
    sdo: SdoPort, parameters: Iterable[Parameter], codes: dict[Key, int]
) -> Iterator[tuple[Key, int]]:
    """Read every object once; the abort codes of those that cannot be read are added."""
    for parameter in {parameter.key: parameter for parameter in parameters}.values():
        if codes.get(parameter.key) in MISSING:
            continue
        try:
            there = sdo.get_certain(parameter.index, parameter.sub, parameter.kind)
        except SdoAbortError as error:
            codes.setdefault(parameter.key, error.code)
        else:
            yield parameter.key, there

"""Errors go from one process to another as they are."""

import pickle
from typing import Any

import pytest

from legbench.drives.errors import SdoAbortError
from legbench.errors import LegbenchError, PlantFault


def all_below(kind: type[LegbenchError]) -> list[type[LegbenchError]]:
    return [kind, *(below for child in kind.__subclasses__() for below in all_below(child))]


ARGUMENTS: dict[type[LegbenchError], tuple[Any, ...]] = {
    PlantFault: ("sway", "the links sway"),
    SdoAbortError: (0x0602_0000, 0x6040, 1, "no such object"),
}


KINDS = sorted(set(all_below(LegbenchError)), key=str)


@pytest.mark.parametrize("kind", KINDS, ids=[kind.__name__ for kind in KINDS])
def test_an_error_of_another_process_is_the_same_error(kind: type[LegbenchError]) -> None:
    error = kind(*ARGUMENTS.get(kind, ("what it is",)))
    found = pickle.loads(pickle.dumps(error))
    assert type(found) is kind
    assert str(found) == str(error)
    assert vars(found) == vars(error)

"""Words that stand for members: as good as the member, and refused where there is none."""

from collections.abc import Callable
from enum import StrEnum
from typing import Any

import pytest

from legbench.control.chirp import ChirpConfig, ChirpCoordinate, ChirpWave
from legbench.design.setup import Setup, SetupKind
from legbench.errors import ConfigError
from legbench.experiment import Conventions
from legbench.kinematics import ModalConvention
from legbench.mjcf import Linkage, LinkageKind
from legbench.plant.can_choice import CanChoice
from legbench.plant.landing import End

FIELDS: list[tuple[Callable[..., Any], str, StrEnum]] = [
    (Setup, "kind", SetupKind.HFTS),
    (Linkage, "kind", LinkageKind.REDUCED),
    (Conventions, "modal", ModalConvention.ORTHONORMAL),
    (CanChoice, "end", End.STOP),
    (ChirpConfig, "coordinate", ChirpCoordinate.Z1),
    (ChirpConfig, "wave", ChirpWave.SQUARE),
]


@pytest.mark.parametrize(("make", "name", "member"), FIELDS)
def test_a_word_is_the_member_that_it_names(
    make: Callable[..., Any], name: str, member: StrEnum
) -> None:
    assert getattr(make(**{name: member.value}), name) is member
    with pytest.raises(ConfigError, match=f"{name} is 'nothing'; choose from .*{member}"):
        make(**{name: "nothing"})

import math

import pytest

from legbench.design.setup import Setup, SetupKind
from legbench.design.statics import Support
from legbench.errors import ConfigError


def test_what_carries_the_weight_and_what_moves() -> None:
    expected = {
        SetupKind.HFTS: (Support.NONE, False),
        SetupKind.VFTS: (Support.TRUNK, False),
        SetupKind.FFS: (Support.FOOT, True),
        SetupKind.JUMP: (Support.FOOT, True),
    }
    assert expected.keys() == set(SetupKind)
    for kind, (support, moves) in expected.items():
        setup = Setup(kind=kind)
        assert (setup.support, setup.trunk_moves) == (support, moves)


def test_a_boom_belongs_to_the_fixed_foot() -> None:
    assert Setup(kind=SetupKind.FFS, boom_radius=1.2).boom_radius == 1.2
    for kind in set(SetupKind) - {SetupKind.FFS}:
        with pytest.raises(ConfigError, match=rf"setup {kind} has no boom; .* belongs to ffs"):
            Setup(kind=kind, boom_radius=1.2)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, math.inf])
def test_a_boom_has_a_length(radius: float) -> None:
    with pytest.raises(ConfigError, match=r"boom_radius is .* m; it must be positive and finite"):
        Setup(kind=SetupKind.FFS, boom_radius=radius)

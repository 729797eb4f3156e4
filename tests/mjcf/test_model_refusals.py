import math
from dataclasses import replace

import pytest

from legbench.design import LegDesign
from legbench.errors import ConfigError
from legbench.mjcf import BuildOptions, Ground, Linkage, LinkageKind, Numerics, build_spec


def test_a_trunk_lighter_than_the_bars(optimal: LegDesign) -> None:
    feather = replace(optimal, trunk_mass=0.001)
    with pytest.raises(ConfigError, match=r"bars weigh 0\.0013054 kg.*trunk of 0\.001 kg.*reduced"):
        build_spec(feather, BuildOptions())
    build_spec(feather, BuildOptions(linkage=Linkage(kind=LinkageKind.REDUCED)))


def test_an_inertia_that_mujoco_refuses(optimal: LegDesign) -> None:
    thin = replace(optimal, foot=replace(optimal.foot, inertia=1e-20))
    with pytest.raises(ConfigError, match=r"refuses the leg of design 'optimal'.*foot"):
        build_spec(thin, BuildOptions())


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_ground_needs_real_numbers(value: float) -> None:
    with pytest.raises(ConfigError, match=r"friction is .*; it must be finite, zero or more"):
        Ground(friction=value)
    with pytest.raises(
        ConfigError, match=r"tip_radius is .* m; it must be above 0 and at most 0.05 m"
    ):
        Ground(tip_radius=value)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_a_linkage_needs_real_dimensions(value: float) -> None:
    with pytest.raises(ConfigError, match=r"crank_length is .* m; it must be positive and finite"):
        Linkage(crank_length=value)
    with pytest.raises(ConfigError, match=r"bar_density is .* kg/m; from 0\.0005 kg/m on"):
        Linkage(bar_density=value)


def test_every_whole_part_of_the_period_is_a_time_step() -> None:
    for parts in range(1, 1000):
        assert Numerics(timestep=0.001 / parts).timestep == 0.001 / parts


@pytest.mark.parametrize("value", [0.0, -0.001, 0.0003, 0.002, 1.0, math.nan, math.inf])
def test_other_time_steps_are_refused(value: float) -> None:
    with pytest.raises(ConfigError, match=r"timestep is .* s; it must divide .* 0\.001 s"):
        Numerics(timestep=value)

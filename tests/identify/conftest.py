import pytest
from twins import experiments, trials

from legbench.identify.trial import MeasuredRun
from legbench.mjcf.options import Linkage


@pytest.fixture(scope="session")
def steps() -> tuple[MeasuredRun, ...]:
    """Steps of the prototype in hfts, vfts and ffs."""
    return trials(experiments())


@pytest.fixture(scope="session")
def steps_of_bars() -> tuple[MeasuredRun, ...]:
    """The same of a leg whose bars have mass."""
    return trials(experiments(linkage=Linkage(), duration=0.4))

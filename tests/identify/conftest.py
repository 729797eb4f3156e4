import pytest
from twins import experiments, trials

from legbench.identify.trial import FitTrial
from legbench.mjcf.options import Linkage


@pytest.fixture(scope="session")
def steps() -> tuple[FitTrial, ...]:
    """Steps of the prototype in hfts, vfts and ffs."""
    return trials(experiments())


@pytest.fixture(scope="session")
def steps_of_bars() -> tuple[FitTrial, ...]:
    """The same of a leg whose bars have mass."""
    return trials(experiments(linkage=Linkage(), duration=0.4))

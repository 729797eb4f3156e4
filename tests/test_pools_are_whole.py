"""^C while a pool of processes is made comes once it is whole, so that it leaves nothing behind."""

import signal
from types import ModuleType, SimpleNamespace
from typing import Any, cast

import pytest

from legbench.campaign import pool as campaign_pool
from legbench.modes import basin


@pytest.mark.parametrize("module", [basin, campaign_pool])
def test_an_interrupt_waits_until_a_pool_is_whole(
    module: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole: list[bool] = []

    def made(*_arguments: object, **_options: object) -> SimpleNamespace:
        signal.raise_signal(signal.SIGINT)
        whole.append(True)
        return SimpleNamespace(shutdown=lambda **_options: None)

    monkeypatch.setattr(module, "ProcessPoolExecutor", made)
    opened: Any = vars(module)["_pool"]
    arguments = (None, 2) if module is basin else (2, cast(Any, SimpleNamespace(is_set=False)))
    with pytest.raises(KeyboardInterrupt), opened(*arguments):
        pass
    assert whole == [True]

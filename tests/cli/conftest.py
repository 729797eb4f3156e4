"""What a command must not do to the process of the tests."""

import pytest


@pytest.fixture(autouse=True)
def leave_the_process_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drives that are served in this process ask for nothing that would stay until its end.

    Real-time priority, memory that is locked and garbage that is no longer collected would slow
    down all tests after it, and keep gigabytes.
    """
    monkeypatch.setattr("legbench.commissioning.emulate.ask", lambda **_: None)

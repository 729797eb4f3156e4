import sys
from importlib import import_module

import pytest

from legbench.errors import MissingExtraError


def test_a_missing_jinja2_is_told_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    door = "legbench.report._jinja2"
    monkeypatch.delitem(sys.modules, door, raising=False)
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'legbench\[report\]'"):
        import_module(door)

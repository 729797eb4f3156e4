import json
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from small_campaign import SMALL, campaign

from legbench.cli import main


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a small campaign that kept no recordings."""
    return campaign(SMALL, tmp_path_factory.mktemp("small"))


@pytest.fixture(scope="session")
def reported(small: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Page of the small campaign with its single figures, and its content as JSON."""
    page = tmp_path_factory.mktemp("report") / "out" / "report.html"
    with redirect_stdout(StringIO()) as printed:
        code = main(["report", str(small), "--out", str(page), "--figures", "png", "--json"])
    assert code == 0
    return page, json.loads(printed.getvalue())

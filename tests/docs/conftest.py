"""The documents' commands are tested by what reads and runs them."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[2] / "scripts"))


@pytest.fixture(scope="session")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with every file that the documents name."""
    from docs_parse import lay_out  # noqa: PLC0415
    from docs_run import prepare  # noqa: PLC0415

    folder = tmp_path_factory.mktemp("desk")
    prepare(folder)
    lay_out(folder)
    return folder

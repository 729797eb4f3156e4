"""A notebook in Jupyter's kernel: its cells show a table and a figure, and no wall of text."""

import json
import os
import re
import warnings
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
CELLS = ROOT / "scripts" / "examples" / "notebook_figure.py"
LONGEST = 40
"""Lines of text that a cell may show."""

pytestmark = pytest.mark.long
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # Jupyter's packages warn of each other while they are loaded.
    nbclient = pytest.importorskip(
        "nbclient", reason="no notebook can be executed: pip install 'legbench[notebook]'"
    )
    nbformat = pytest.importorskip("nbformat")  # nbclient needs it, too


def notebook_of(program: str) -> dict[str, Any]:
    """Notebook of a program, whose cells begin behind `# %%`."""
    _, *cells = re.split(r"^# %%.*\n", program, flags=re.MULTILINE)
    return {
        "nbformat": 4,
        "nbformat_minor": 5,
        "metadata": {"kernelspec": {"name": "python3", "display_name": "Python 3"}},
        "cells": [
            {
                "id": f"cell-{place}",
                "cell_type": "code",
                "source": source.strip(),
                "metadata": {},
                "outputs": [],
                "execution_count": None,
            }
            for place, source in enumerate(cells)
        ],
    }


@pytest.mark.filterwarnings("ignore")  # The kernel's warnings are those of Jupyter.
def test_cells_show_a_table_and_a_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "models").symlink_to(ROOT / "models")
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT / "src")]))
    told = notebook_of(CELLS.read_text(encoding="utf-8"))
    notebook = nbformat.from_dict(told)
    nbclient.execute(notebook, cwd=str(tmp_path), timeout=300)
    run, figure, rows = (json.loads(json.dumps(cell))["outputs"] for cell in notebook["cells"])
    assert "ended       complete" in "".join(each.get("text", "") for each in run)
    (shown,) = [each["data"] for each in figure if "data" in each]
    assert shown["image/png"].startswith("iVBOR")
    assert any("joint_pos_1" in each["data"]["text/plain"] for each in rows if "data" in each)
    for cell in (run, figure, rows):
        text = "".join(each.get("text") or each["data"]["text/plain"] for each in cell)
        assert text.count("\n") < LONGEST
    assert list(tmp_path.iterdir()) == [tmp_path / "models"]

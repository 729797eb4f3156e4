import subprocess
import sys

import pytest


@pytest.mark.long
def test_a_library_that_is_missing_alone_is_told_with_the_extra_that_has_it() -> None:
    """That two are missing is tried with the other commands."""
    code = """
import sys
sys.modules["jinja2"] = None
from legbench.cli import main
raise SystemExit(main(["report", "nowhere"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("legbench: jinja2 is not installed; a report needs it: ")
    assert "pip install 'legbench[report]'" in done.stderr
    assert done.stderr.count("\n") == 1

import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    "absent", [pytest.param(["jinja2"], marks=pytest.mark.long), ["jinja2", "matplotlib"]]
)
def test_missing_libraries_are_told_with_the_extra_that_has_all_of_them(absent: list[str]) -> None:
    code = f"""
import sys
sys.modules.update(dict.fromkeys({absent}))
from legbench.cli import main
raise SystemExit(main(["report", "nowhere"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("legbench: jinja2 is not installed; a report needs it: ")
    assert "pip install 'legbench[report]'" in done.stderr
    assert done.stderr.count("\n") == 1

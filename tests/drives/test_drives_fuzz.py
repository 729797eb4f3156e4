import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts" / "fuzz_drives.py"


def test_noise_and_mutated_traffic_raise_nothing_on_either_side() -> None:
    command = [sys.executable, "-W", "error", str(SCRIPT), "--frames", "15000", "--seed", "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("15000 frames") == 2
    assert "operation enabled" in done.stdout

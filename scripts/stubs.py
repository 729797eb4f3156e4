"""Write type stubs of MuJoCo, which ships none, for the type checker."""

import subprocess
import sys

MODULES = ("mujoco", "mujoco.batch", "mujoco.viewer", "mujoco.rendering")


def main() -> None:
    """Generate the stubs into the folder given as the first argument."""
    folder = sys.argv[1]
    for module in MODULES:
        subprocess.run(
            [sys.executable, "-m", "pybind11_stubgen", module, "--ignore-all-errors", "-o", folder],
            check=True,
            capture_output=True,
        )


if __name__ == "__main__":
    main()

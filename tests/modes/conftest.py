"""The exact leg is shared with the tests of the equations, the reference with the scripts."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "analytic"))
sys.path.append(str(Path(__file__).parent))
sys.path.append(str(Path(__file__).parents[2] / "scripts"))

"""Scripts that strike drives are tested beside what they strike."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[2] / "scripts"))

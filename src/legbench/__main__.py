"""`python -m legbench`."""

import sys

from legbench.cli import main

sys.exit(main())

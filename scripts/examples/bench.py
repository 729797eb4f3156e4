"""One experiment simulated, then on the bench, whose drives are emulated, and what differs.

    python scripts/examples/bench.py

Without `interface` the same lines drive the leg that hangs on the bus of the file.
"""

from dataclasses import replace
from pathlib import Path

import legbench


def main() -> None:
    leg = legbench.load_design("models/prototype.toml")
    hop = legbench.Experiment(design=leg, controller=legbench.JumpConfig(), duration=1.5)
    bench = legbench.CanChoice(bus=Path("hardware/leg.toml"), interface="legbench")
    simulated = legbench.run(hop)
    driven = legbench.run(replace(hop, plant=bench), out="runs")
    print(driven)
    difference = legbench.compare(simulated, driven)
    print(f"links differ by up to {difference.joint_before_touchdown:.4f} rad before touchdown")


if __name__ == "__main__":
    main()

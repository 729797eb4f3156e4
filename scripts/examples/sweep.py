"""Sweep of a jump's amplitude: how much of each flight is the mode, and how high the leg hops.

python scripts/examples/sweep.py
"""

from dataclasses import replace

import numpy as np

import legbench


def main() -> None:
    leg = legbench.load_design("models/prototype.toml")
    hop = legbench.Experiment(design=leg, controller=legbench.JumpConfig(), duration=2.0)
    print("dz2 [rad]  P^r flight [-]  foot clearance [mm]")
    for dz2 in np.linspace(0.10, 0.18, 5):
        run = legbench.run(replace(hop, controller=legbench.JumpConfig(dz2=float(dz2))))
        found = legbench.summarise(run)
        rating = float(np.mean(found.rating_flight))
        print(f"{dz2:9.3f}  {rating:14.4f}  {1e3 * found.foot_clearance:19.1f}")


if __name__ == "__main__":
    main()

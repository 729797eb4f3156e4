"""Time and memory of many imperfect legs, rated over two seconds with the foot fixed.

    python scripts/bench_explain.py [legs]

Ten thousand legs are to take a minute and 500 MB on two cores at the most; progress is printed on
the way. Wall time holds on an idle machine alone, processor time on any.
"""

import resource
import sys
import time

import numpy as np

from legbench.control import PositionJumpConfig
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.experiment import Experiment
from legbench.explain.causes import CAUSES, combined
from legbench.explain.engine import Watch, rate_many
from legbench.imperfections import Imperfections

LEGS = 10_000
LONGEST = 60.0
"""Longest time [s]."""
LARGEST = 500.0
"""Largest memory of the process [MB]."""


def drawn(count: int) -> list[Imperfections]:
    """Legs with every cause that acts on the leg itself, each within its plausible size."""
    random = np.random.default_rng(0)
    causes = [cause for cause in CAUSES.values() if not cause.sampled]
    shares = random.uniform(-1.0, 1.0, (count, len(causes)))
    return [
        combined(
            causes,
            [
                cause.plausible * (share if cause.signed else abs(share))
                for cause, share in zip(causes, row, strict=True)
            ],
        )
        for row in shares.tolist()
    ]


def main() -> int:
    """Rate the legs and print what it took; 1 if that was too much."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else LEGS
    experiment = Experiment(
        design=load_design("models/prototype.toml"),
        controller=PositionJumpConfig(z2=1.4, dz2=0.3, delay=0.0),
        setup=Setup(kind=SetupKind.FFS),
        duration=2.0,
    )
    legs, done = drawn(count), 0

    def advance(some: int) -> None:
        nonlocal done
        before, done = done, done + some
        if 10 * before // count < 10 * done // count:
            print(f"{done} of {count} legs, {time.perf_counter() - began:.1f} s", flush=True)

    began, cpu = time.perf_counter(), time.process_time()
    shapes = rate_many(experiment, legs, periods=2, watch=Watch(advance=advance))
    wall, cpu = time.perf_counter() - began, time.process_time() - cpu
    memory = 1e-3 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    rated = np.isfinite(shapes.equilibrium[:, 0])
    print(f"rated     {rated.sum()} of {count} legs, P_1 {shapes.equilibrium[rated, 0].mean():.3f}")
    print(f"wall      {wall:.1f} s (bound {LONGEST:g} s for {LEGS} legs)")
    print(f"processor {cpu:.1f} s, {count / cpu:.0f} legs a second of it")
    print(f"memory    {memory:.0f} MB (bound {LARGEST:g} MB)")
    allowed = LONGEST * count / LEGS
    return 0 if min(wall, cpu) <= allowed and memory <= LARGEST else 1


if __name__ == "__main__":
    sys.exit(main())

"""Let link encoders drift while a leg sways, at many moments of one long jump, and print the times.

    python scripts/check_sway_drifts.py                  # about 100 s of a processor
    python scripts/check_sway_drifts.py --seconds 150 --trials 20

A jump is simulated until it sways as it does after minutes of hopping. Its encoders are then read
again and again: rounded at random phases, healthy, and with a drift that begins at a seeded moment
on either drive, to either side. The leg itself is the same each time, so that only the watch over
its angular momentum is tried. Exit status 1 if a drift is found too late, or a healthy leg doubted.
"""

import argparse
import math
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from legbench.commissioning.broken_plant import DRIFT
from legbench.commissioning.dead_part_stage import Bench, Emulation, staged
from legbench.commissioning.dead_parts import DRIFT_BOUND
from legbench.design import load_design
from legbench.design.setup import Setup, SetupKind
from legbench.limits.momentum import LegMomentum, MomentumReading
from legbench.limits.momentum_watch import MomentumWatch
from legbench.plant.leg_momentum import momentum_of
from legbench.plant.start import PERIOD
from legbench.servo import PERFECT, ServoConfig
from legbench.signals import Floats

ROOT = Path(__file__).parents[1]
BENCH = Bench(
    design=load_design(ROOT / "models" / "optimal.toml"), bus_file=ROOT / "hardware" / "leg.toml"
)
COUNTS = (4096, 1 << 16)
"""Counts of the encoders per turn."""
LEARNING, AFTER = 1200, 300
"""Cycles for which a watch looks on before a drift, and after it began."""
SWAYING_TIME = 100.0
"""Last part of the jump, in which drifts begin and a healthy leg is looked at [s]."""


class Angles(NamedTuple):
    """True angles of a leg, a row for each cycle."""

    motor: Floats
    joint: Floats

    def rounded(self, counts: int, dice: random.Random) -> "Angles":
        """Return what encoders of so many counts show, each at a random phase."""
        step = 2.0 * math.pi / counts
        phases = np.array([[dice.uniform(-0.5, 0.5) for _ in range(2)] for _ in range(2)])
        motor, joint = (
            step * (np.round(each / step + phase) - phase)
            for each, phase in zip(self, phases, strict=True)
        )
        return Angles(motor, joint)

    def between(self, first: int, last: int) -> "Angles":
        """Return some of the cycles."""
        return Angles(self.motor[first:last], self.joint[first:last])

    def readings(self) -> Iterator[MomentumReading]:
        """Yield what a watch looks at."""
        for motor, joint in zip(self.motor.tolist(), self.joint.tolist(), strict=True):
            yield MomentumReading(PERIOD, tuple(motor), tuple(joint))


def jump(seconds: float, servo: ServoConfig) -> Angles:
    """Simulate a jump; encoders without rounding show the true angles."""
    with staged(BENCH, Emulation.SIM, "jump", servo, None) as stage:
        observation = stage.plant.reset()
        stage.controller.reset(observation)
        motor, joint = [], []
        for _ in range(round(seconds / PERIOD)):
            observation = stage.plant.step(stage.controller.step(observation))
            motor.append(observation.motor_pos.copy())
            joint.append(observation.joint_pos.copy())
    return Angles(np.array(motor), np.array(joint))


def leg_of(counts: int) -> LegMomentum:
    """Return what is known of the leg to one who reads such encoders."""
    step = 2.0 * math.pi / counts
    found = momentum_of(BENCH.design, Setup(kind=SetupKind.JUMP), step, PERFECT)
    if found is None:
        raise SystemExit("the momentum of a jump is always known")
    return found


def watch_over(leg: LegMomentum, angles: Angles) -> tuple[int | None, list[float]]:
    """Return the cycle of the first doubt, and the torque that is left in each cycle [N m]."""
    watch = MomentumWatch(leg, BENCH.limits.link_error or math.inf, PERIOD)
    doubt, left = None, []
    for cycle, reading in enumerate(angles.readings()):
        if watch.see(reading) is not None and doubt is None:
            doubt = cycle
        left.append(math.nan if watch.residual is None else watch.residual)
    return doubt, left


def drifted(angles: Angles, dice: random.Random) -> Angles:
    """Let a random link encoder drift to a random side, once the watch has learned."""
    drift = np.maximum(0.0, np.arange(len(angles.joint)) - LEARNING) * PERIOD * DRIFT
    joint = angles.joint.copy()
    joint[:, dice.randrange(2)] += dice.choice((-1.0, 1.0)) * drift
    return Angles(angles.motor, joint)


def report(counts: int, angles: Angles, trials: int, dice: random.Random) -> bool:
    """Print what happens with encoders of so many counts; whether all is as it should be."""
    leg = leg_of(counts)
    limit = (BENCH.limits.link_error or math.inf) * min(leg.stiffness)
    doubt, left = watch_over(leg, angles.rounded(counts, dice))
    healthy = np.sort(left[LEARNING:])
    print(
        f"{counts} counts, healthy: median {np.median(healthy):.3f} N m, 95 % "
        f"{healthy[int(0.95 * len(healthy))]:.2f} N m, {100.0 * np.mean(healthy > limit):.0f} % "
        f"above {limit:.3f} N m, {'no doubt' if doubt is None else f'doubt in cycle {doubt}'}"
    )
    times, torques = [], []
    for _ in range(trials):
        first = dice.randrange(len(angles.joint) - LEARNING - AFTER)
        part = drifted(angles.between(first, first + LEARNING + AFTER), dice)
        found, left = watch_over(leg, part.rounded(counts, dice))
        times.append(math.inf if found is None else (found - LEARNING) * PERIOD)
        torques.append([left[LEARNING + after] for after in (50, 100, 150)])
    times.sort()
    later = np.array(torques)
    for after, column in zip((50, 100, 150), later.T, strict=True):
        above = 100.0 * np.mean(column > limit)
        print(f"  {after} ms after: median {np.median(column):.2f} N m, above in {above:.0f} %")
    middle, most = times[len(times) // 2], times[int(0.95 * len(times))]
    print(
        f"  {trials} drifts, found after {1e3 * middle:.0f} ms (median), {1e3 * most:.0f} ms "
        f"(95 %), {1e3 * times[-1]:.0f} ms at most",
        flush=True,
    )
    return doubt is None and times[0] > 0.0 and times[-1] <= DRIFT_BOUND


def main() -> int:
    """Print what is found with each kind of encoder; 1 if that is too late, or too soon."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=460.0, help="virtual time of the jump")
    parser.add_argument("--trials", type=int, default=384, help="drifts for each kind of encoder")
    parser.add_argument("--bandwidth", type=float, help="of the position loops [Hz], else ideal")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    angles = jump(chosen.seconds, ServoConfig(bandwidth=chosen.bandwidth))
    angles = angles.between(-round(SWAYING_TIME / PERIOD), len(angles.joint))
    sway = float(np.ptp(angles.joint.sum(axis=1)))
    print(f"a jump of {chosen.seconds:g} s, which sways by {sway:.2f} rad from side to side")
    dice = random.Random(chosen.seed)
    well = [report(counts, angles, chosen.trials, dice) for counts in COUNTS]
    return 0 if all(well) else 1


if __name__ == "__main__":
    sys.exit(main())

"""The loop closed on the desk, with bounds: a leg with hidden parameters behind emulated drives.

    python scripts/check_twin.py [--only twin plan]

`twin` drives it over emulated CAN, identifies it, and predicts a hop that no fit has seen; `plan`
asks which run of 3 s would sharpen the coupling of the inertias. Ends with status 1 where a bound
is missed.
"""

import argparse
import sys
import time
from pathlib import Path

from legbench.control import JumpConfig, PositionJumpConfig
from legbench.design.setup import SetupKind
from legbench.identify import identify, parse_free, repeat, task_of, written_back
from legbench.identify.base import LegParameters
from legbench.identify.parameters import INDEX
from legbench.identify.plan import ranked
from legbench.identify.trial import FIXED, bars_of

sys.path.append(str(Path(__file__).parents[1] / "tests" / "identify"))
from twins import HIDDEN, PROTOTYPE, driven

WITHIN = {"k": 2e-4, "d": 1e-3, "s": 5e-4}
"""Largest shares by which stiffness, damping and first moments may be off [-]."""
SHRINKS = 8.0
"""Least factor by which the best run shrinks the error of the coupling [-]."""
STEP = PositionJumpConfig(z2=1.0, dz2=0.3)


def twin() -> bool:
    """Identify nine parameters from three steps, and predict a hop; whether all is within."""
    runs = [driven(STEP, SetupKind(kind), 3.0) for kind in FIXED]
    task = task_of(runs, free=parse_free(["nine"]))
    outcome = identify(task)
    truth = LegParameters.of(HIDDEN.leg_of(PROTOTYPE), bars=bars_of(runs[0])).values
    met = outcome.trusted
    print(f"trusted: {outcome.trusted}", *outcome.reasons)
    for each in outcome.estimates:
        off, within = each.value / truth[INDEX[each.name]] - 1.0, WITHIN.get(each.name[0])
        met &= within is None or abs(off) <= within
        bound = "" if within is None else f", bound {within:.3%}"
        print(f"{each.name} is off by {off:+.4%}{bound}")
    hop = repeat(
        driven(JumpConfig(), SetupKind.JUMP, 4.0), written_back(PROTOTYPE, outcome, task.bars)
    )
    print(hop.text, *hop.misses)
    return met and hop.good


def plan() -> bool:
    """Rank the next run after three steps; whether the best shrinks the coupling's error."""
    runs = [driven(STEP, SetupKind(kind), 3.0) for kind in FIXED]
    best = ranked(task_of(runs, free=parse_free(["nine"])), None, sharpen="B")[0]
    print(f"{best.name} shrinks the error of B by {best.shrinks['B']:.1f}, bound {SHRINKS:g}")
    return best.shrinks["B"] >= SHRINKS


def main() -> int:
    """Run the proofs that were asked for; 1 if a bound is missed."""
    proofs = {"twin": twin, "plan": plan}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", choices=list(proofs), default=list(proofs))
    met = True
    for name in parser.parse_args().only:
        before = time.process_time()
        good = proofs[name]()
        print(f"{'ok' if good else 'MISSED'}: {name}, {time.process_time() - before:.0f} s of CPU")
        met &= good
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())

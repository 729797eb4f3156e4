"""One hop on the fast path against scipy's RK45 at 1e-6: how much faster, how much more exact.

The same undamped leg and the same start in the air, through touchdown and lift-off to about the
next apex. RK45 runs twice: as `solve_ivp` is usually fed, with matrices and a linear solve, and
on this package's scalar equations, which are already several times faster; the bound is on the
first, the second is printed beside it. The yardstick is DOP853 at 1e-12. Compiling is done before
the clock starts. The fast path runs at both of its tolerances, for reference and for maps. Rounds
go through all paths in turn, so that a machine that slows down slows them all.

Then: legs a second side by side, for 2 s of FFS on one core, plain and with derivatives to nine
parameters; a hop under the jump controller over heyoka alone on the same pieces; processor time
from the start of Python to the first hop of a new leg, nothing compiled yet and all compiled.
`--basin N` maps N x N starts in two processes.
"""

import argparse
import copy
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from legbench.analytic import Accuracy, HybridLeg, LegModel, LegState, RungeKutta, flying
from legbench.analytic import matrices as mx
from legbench.analytic.compiled import TOLERANCE
from legbench.analytic.contact import switch
from legbench.analytic.leg_batch import LegBatch
from legbench.analytic.state import Regime
from legbench.analytic.taylor import MAP_TOLERANCE, TaylorLeg
from legbench.control import JumpConfig
from legbench.design import load_design
from legbench.design.statics import Support, motor_holding
from legbench.modes.basin import BasinTask, GridAxis, map_basin
from legbench.modes.drive import JumpLaw
from legbench.modes.fixed_point import fixed_point
from legbench.modes.hop import Apex, return_map, settle
from legbench.signals import Floats

DESIGN = Path(__file__).parents[1] / "models" / "optimal.toml"
SECONDS = 0.58
BOUND = 50.0
OVER_BARE = 1.5
"""Time of a hop over that of heyoka alone on the same pieces that is aimed at [-]."""
ROUNDS = (40, 50)
"""Times in which hops and pieces are measured in turn, and repetitions in each [-]."""
MAPS = f"fast, {MAP_TOLERANCE:g}"
Motor = tuple[float, float]


def best(paths: dict[str, tuple[Callable[[], Any], int]], rounds: int = 7) -> dict[str, float]:
    """Least mean wall time of a call of each over a few rounds [s]."""
    taken = dict.fromkeys(paths, float("inf"))
    for _ in range(rounds):
        for name, (function, repeats) in paths.items():
            began = time.perf_counter()
            for _ in range(repeats):
                function()
            taken[name] = min(taken[name], (time.perf_counter() - began) / repeats)
    return taken


def matrix_hop(model: LegModel, start: LegState, motor: Motor) -> LegState:
    """RK45 at 1e-6 on `M(q) a + C(q, v) v + g(q) = tau`, solved anew at every evaluation."""
    stiffness, terms, state = np.asarray(model.stiffness), model.floating, start

    def flight(_time: float, y: Floats) -> Any:
        right = -mx.floating_coriolis(terms, y[:4], y[4:]) @ y[4:]
        right -= mx.floating_gravity(terms, y[:4])
        right[2:] += stiffness * (motor - y[2:4])
        return np.concatenate([y[4:], np.linalg.solve(mx.floating_mass(terms, y[:4]), right)])

    def stance(_time: float, y: Floats) -> Any:
        right = -mx.pair_coriolis(model.stance, y[:2], y[2:]) @ y[2:]
        right += stiffness * (motor - y[:2]) - mx.pair_gravity(model.stance, y[:2])
        return np.concatenate([y[2:], np.linalg.solve(mx.pair_mass(model.stance, y[:2]), right)])

    def height(_time: float, y: Floats) -> float:
        return float(y[1] + model.foot_from_hip((y[2], y[3]))[1])

    def force(_time: float, y: Floats) -> float:
        return float(model.stance_force(motor, (y[0], y[1]), (y[2], y[3]))[1])

    while state.time < SECONDS:
        flies = state.regime is Regime.FLIGHT

        def event(at: float, y: Floats, flies: bool = flies, since: float = state.since) -> float:
            if at < since + 2e-4:
                return 1.0
            return height(at, y) if flies else force(at, y)

        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
        pack = [*state.trunk_pos, *state.q, *state.trunk_vel, *state.v]
        pack = pack if flies else [*state.q, *state.v]
        solved = solve_ivp(
            flight if flies else stance,
            (state.time, SECONDS),
            pack,
            method="RK45",
            rtol=1e-6,
            atol=1e-6,
            events=event,
        )
        end: list[float] = solved.y[:, -1].tolist()
        if flies:
            trunk, q, speed, v = zip(end[::2], end[1::2], strict=True)
        else:
            q, v = zip(end[::2], end[1::2], strict=True)
            foot, moved = model.foot_from_hip(q), model.foot_vel_from_hip(q, v)
            trunk, speed = (-foot[0], -foot[1]), (-moved[0], -moved[1])
        state = LegState(
            time=float(solved.t[-1]),
            regime=state.regime,
            q=q,
            v=v,
            trunk_pos=trunk,
            trunk_vel=speed,
            since=state.since,
        )
        if solved.status == 1:
            state = switch(model, state)
    return state


def legs_a_second() -> dict[str, float]:
    """Legs a second, side by side on one core, for two seconds of FFS."""
    model, count, times = LegModel.of(load_design(DESIGN)), 64, np.array([0.0, 2.0])
    starts = np.tile([-0.9, 0.85, 0.0, 0.0], (count, 1)) + np.linspace(
        0.0, 0.05, 4 * count
    ).reshape(count, 4)
    found = {}
    for name, derivatives in (("plain", False), ("with nine derivatives", True)):
        lanes = LegBatch([model] * count, Regime.PINNED, derivatives=derivatives)

        def run(lanes: LegBatch = lanes) -> None:
            lanes.start(starts)
            lanes.path(times, np.tile([-0.7, 0.7], (count, 1)))

        found[name] = count / best({name: (run, 1)}, 25)[name]
    return found


def over_bare(name: str, tolerance: float) -> tuple[float, float]:
    """A hop [s], and heyoka's own share of it [s].

    The share is that of the same calls in their order, each from the same state to the same event,
    without what lies between them and without setting the state. It is the sum of each call's least
    time, and the hop the least of whole hops; both are measured in turn.
    """
    design = load_design(DESIGN.parent / f"{name}.toml")
    law = JumpLaw(JumpConfig(), design)
    leg = TaylorLeg(LegModel.of(design), probe=law.probe, tolerance=tolerance)
    start = Apex(height=0.27, speed=0.0, z1=0.0, z2=0.6, dz1=0.0, dz2=0.0)
    apex = settle(leg, law, start, 30)[-1]
    pieces: list[tuple[Any, Floats, Floats, float, tuple[Any, ...]]] = []
    return_map(leg, law, apex)
    regimes = leg.course.compiled_regimes()
    for compiled in regimes:
        real, alone = compiled.integrator, copy.deepcopy(compiled.integrator)

        def noted(*until: Any, real: Any = real, alone: Any = alone) -> Any:
            pieces.append((alone, real.state.copy(), real.pars.copy(), real.time, until))
            return real.propagate_until(*until)

        compiled.run = noted
    return_map(leg, law, apex)
    for compiled in regimes:
        compiled.run = compiled.integrator.propagate_until
    hop, least = float("inf"), [float("inf")] * len(pieces)
    for _ in range(ROUNDS[0]):
        hop = min(hop, best({"hop": (lambda: return_map(leg, law, apex), 1)}, ROUNDS[1])["hop"])
        for _ in range(ROUNDS[1]):
            for index, (real, state, pars, begin, until) in enumerate(pieces):
                real.state[:], real.pars[:], real.time = state, pars, begin
                real.reset_cooldowns()
                began = time.perf_counter()
                real.propagate_until(*until)
                least[index] = min(least[index], time.perf_counter() - began)
    return hop, sum(least)


def start_up() -> tuple[float, float, float]:
    """Processor time of `hop` for a leg: NumPy's import, nothing compiled, all compiled [s]."""
    hop = (
        "from legbench.cli.hop import main; "
        f"main([{str(DESIGN)!r}, '--z2', '0.65', '--dz2', '0.1', '--json'])"
    )
    with tempfile.TemporaryDirectory() as folder:
        cache = {"LEGBENCH_CACHE": str(Path(folder) / "cache")}
        return _seconds("import numpy", cache), _seconds(hop, cache), _seconds(hop, cache)


def _seconds(code: str, environment: dict[str, str]) -> float:
    script = f"import time; {code}; import sys; print(time.process_time(), file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stderr.split()[-1])


def basin(points: int) -> tuple[float, float]:
    """Wall and processor time of a basin map in two processes [s]."""
    design = load_design(DESIGN.parent / "prototype.toml")
    law = JumpLaw(JumpConfig(), design)
    leg = TaylorLeg(LegModel.of(design), probe=law.probe)
    start = Apex(height=0.27, speed=0.0, z1=0.0, z2=0.6, dz1=0.0, dz2=0.0)
    centre = fixed_point(leg, law, settle(leg, law, start, 60)[-1]).apex
    height = centre.height
    task = BasinTask(
        design=design,
        jump=JumpConfig(),
        motor=(0.0, 0.0),
        undamped=False,
        centre=centre,
        across=GridAxis(name="z1", low=-0.3, high=0.3, count=points),
        up=GridAxis(name="height", low=height - 0.08, high=height + 0.08, count=points),
    )
    with tempfile.TemporaryDirectory() as folder:
        began, busy = time.perf_counter(), sum(os.times()[:4])
        map_basin(task, Path(folder) / "basin.jsonl", workers=2)
        return time.perf_counter() - began, sum(os.times()[:4]) - busy


def figures(points: int) -> None:
    """Print what has no bound here."""
    for name, rate in legs_a_second().items():
        print(f"2 s of FFS, {name}: {rate:.0f} legs a second")
    for name in ("prototype", "optimal"):
        for tolerance in (MAP_TOLERANCE, TOLERANCE):
            hop, bare = over_bare(name, tolerance)
            print(
                f"hop of {name} at {tolerance:g}: {1e6 * hop:.0f} us, heyoka alone on its pieces "
                f"{1e6 * bare:.0f} us, ratio {hop / bare:.3f} ({OVER_BARE:g} is aimed at)"
            )
    numpy, cold, warm = start_up()
    print(
        f"processor time of hop besides numpy: cold {cold - numpy:.2f} s, warm {warm - numpy:.2f} s"
    )
    if points:
        wall, busy = basin(points)
        print(
            f"basin, {points} x {points}, two processes: {wall:.1f} s, processor time {busy:.1f} s"
        )


def main() -> int:
    """Print one line a path; fail below the bound."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--basin", type=int, default=0, help="points a side of a basin map")
    flags = parser.parse_args()
    design = load_design(DESIGN)
    model = LegModel.of(design, undamped=True, stops=False)
    held = motor_holding(design, np.array([-0.8, 0.8]), Support.FOOT)
    motor = (float(held[0]), float(held[1]))
    trunk = (0.0, 0.05 - model.foot_from_hip(motor)[1])
    start = flying(model, motor, (0.0, 0.0), trunk, (0.0, 0.0))

    def hops(leg: HybridLeg | TaylorLeg) -> Callable[[], LegState]:
        return lambda: leg.advance(start, SECONDS, motor)[0]

    exact, events = HybridLeg(model, Accuracy(rtol=1e-12, atol=1e-14)).advance(
        start, SECONDS, motor
    )
    began = time.perf_counter()
    fast = hops(TaylorLeg(model))
    fast()
    compiled = time.perf_counter() - began
    scalar = Accuracy(method=RungeKutta.RK45, rtol=1e-6, atol=1e-6, max_step=1.0)
    slow = {
        "RK45, matrices": (lambda: matrix_hop(model, start, motor), 5),
        "RK45, scalars": (hops(HybridLeg(model, scalar)), 20),
    }
    paths = slow | {
        "DOP853, 1e-9": (hops(HybridLeg(model)), 10),
        "fast, 1e-15": (fast, 300),
        MAPS: (hops(TaylorLeg(model, tolerance=MAP_TOLERANCE)), 300),
    }
    print(f"one hop, {SECONDS} s, {len(events)} events; compiling takes {compiled:.2f} s")
    print(f"{'path':<16}{'ms a hop':>10}{'error':>12}{'/ matrices':>12}{'/ scalars':>12}")
    ends = {name: function() for name, (function, _) in paths.items()}
    wrong = {
        name: float(np.max(np.abs(np.subtract(end.q + end.v, exact.q + exact.v))))
        for name, end in ends.items()
    }
    taken = best(paths)
    for name, seconds in taken.items():
        ratios = [taken[other] / seconds for other in slow]
        print(
            f"{name:<16}{1e3 * seconds:10.3f}{wrong[name]:12.1e}{ratios[0]:12.1f}{ratios[1]:12.1f}"
        )
    figures(flags.basin)
    ratio = taken["RK45, matrices"] / taken[MAPS]
    good = ratio >= BOUND and wrong[MAPS] < min(wrong[other] for other in slow)
    print("ok" if good else f"below the bound of {BOUND:g} times at a smaller error")
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())

"""Recordings with known answers, built from closed forms instead of plants."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from legbench.control.jump_rules import JumpPhase
from legbench.design.leg import LegDesign
from legbench.design.toml import design_to_mapping, load_design
from legbench.phases import ControllerDescription, Counting, PhaseInfo
from legbench.recording.controller_table import controller_table
from legbench.recording.reader import Recording, described
from legbench.signals import SIGNALS, Floats, Ints

MODELS = Path(__file__).parents[2] / "models"
PROTOTYPE = load_design(MODELS / "prototype.toml")
GRAVITY = 9.81
PERIOD = 0.001


def clock(count: int) -> Floats:
    """Plant time of so many rows from zero [s]."""
    return PERIOD * np.arange(count, dtype=np.float64)


def manifest(design: LegDesign = PROTOTYPE, **entries: Any) -> dict[str, Any]:
    """A manifest of format 1 with what metrics need; `entries` replace whole tables."""
    tables: dict[str, Any] = {
        "format": 1,
        "design": design_to_mapping(design),
        "setup": {"kind": "jump"},
        "controller": {"kind": "jump", "z2": 0.8, "dz2": 0.28},
        "conventions": {"modal": "orthonormal"},
        "period": PERIOD,
        "status": "complete",
        "cause": None,
    }
    return tables | entries


def recording(time: Floats, entries: dict[str, Any] | None = None, **signals: Any) -> Recording:
    """A recording whose unnamed signals are zero, or unknown where only a simulation knows."""
    count = len(time)
    columns: dict[str, np.ndarray] = {}
    for signal in SIGNALS:
        shape = (count, len(signal.columns))
        known = "simulation only" not in signal.doc
        missing = np.zeros(shape) if known else np.full(shape, np.nan)
        values = np.asarray(signals.pop(signal.name, missing), dtype=np.float64).reshape(shape)
        if signal.name in ("phase", "contact"):
            values = np.where(np.isnan(values), -1, values).astype(np.int8)
        columns |= dict(zip(signal.columns, values.T, strict=True))
    assert not signals, f"no such signals: {sorted(signals)}"
    return Recording(
        path=Path("runs/one"),
        manifest={},
        described=described(manifest() if entries is None else entries, Path("one")),
        time=time,
        columns=MappingProxyType(columns),
        events=(),
    )


def remade(run: Recording, entries: dict[str, Any]) -> Recording:
    """The same rows under another manifest."""
    return replace(run, described=described(entries, run.path))


def guest(
    phase: Ints,
    phases: tuple[PhaseInfo, ...],
    counting: Counting | None = None,
    *,
    setup: dict[str, Any] | None = None,
    signals: dict[str, Any] | None = None,
    like: Recording | None = None,
) -> Recording:
    """A run of a controller that is not built in, of given phases; its rows `like` another's."""
    said = ControllerDescription(phases=phases, counting=counting or Counting())
    entries = {
        "experiment": {
            "design": design_to_mapping(PROTOTYPE),
            "setup": setup or {"kind": "jump"},
            "controller": {"kind": "guest"},
        },
        "controller": controller_table("guest", said),
    }
    if like is None:
        return recording(clock(len(phase)), entries, phase=phase, **(signals or {}))
    columns = {**like.columns, "phase": phase.astype(np.int8)}
    return replace(remade(like, entries), columns=MappingProxyType(columns))


def truncated(run: Recording, rows: slice) -> Recording:
    """Some rows of a recording, as a crash leaves them."""
    columns = {name: column[rows] for name, column in run.columns.items()}
    return Recording(
        path=run.path,
        manifest={},
        described=run.described,
        time=run.time[rows],
        columns=MappingProxyType(columns),
        events=(),
    )


@dataclass(frozen=True, kw_only=True)
class Hop:
    """A periodic hop in closed form: ballistic flight, sinusoidal stance, begun in stance.

    In flight the hip follows gravity from `speed` up, the foot tip a parabola `tuck` times as
    high; in stance the hip dips half a sine whose slope meets the flight's.
    """

    speed: float = 0.8
    stance: float = 0.15
    tuck: float = 1.5
    height: float = 0.22
    travel: float = 0.03
    """Forward speed of the hip [m/s]."""
    offset: float = 0.0004
    """Of the first row from the middle of the first stance [s]."""
    hops: float = 5.1

    @property
    def flight(self) -> float:
        return 2.0 * self.speed / GRAVITY

    @property
    def cycle(self) -> float:
        return self.flight + self.stance

    @property
    def rise(self) -> float:
        """Of the hip in flight."""
        return self.speed**2 / (2.0 * GRAVITY)

    @property
    def dip(self) -> float:
        """Of the hip in stance."""
        return self.speed * self.stance / np.pi

    def liftoff(self, index: int) -> float:
        return 0.5 * self.stance + index * self.cycle

    def touchdown(self, index: int) -> float:
        return self.liftoff(index) + self.flight

    def lower_apex(self, index: int) -> float:
        """Of the stance that ends with lift-off `index`."""
        return index * self.cycle

    def upper_apex(self, index: int) -> float:
        return self.liftoff(index) + 0.5 * self.flight

    def signals(self) -> dict[str, Any]:
        time = self.offset + clock(int(self.hops * self.cycle / PERIOD))
        into = np.mod(time + 0.5 * self.stance, self.cycle)
        contact = into < self.stance
        flown = np.where(contact, 0.0, into - self.stance)
        arc = flown * (self.flight - flown) * 0.5 * GRAVITY
        foot = np.where(contact, 0.0, self.tuck * arc)
        sine = np.where(contact, np.sin(np.pi * into / self.stance), 0.0)
        hip = self.height + np.where(contact, -self.dip * sine, arc)
        half = np.arccos((hip - foot) / (2.0 * PROTOTYPE.shank.length))
        ahead = self.travel * time
        flat = np.zeros_like(time)
        compress = contact & (into < 0.5 * self.stance)
        phase = np.where(
            contact, JumpPhase.PUSH, np.where(flown < 0.02, JumpPhase.RELEASE, JumpPhase.FLIGHT)
        )
        return {
            "time": time,
            "phase": np.where(compress, JumpPhase.COMPRESS, phase),
            "joint_pos": np.stack([-half, half], axis=-1),
            "motor_pos": np.stack([0.1 - half, half - 0.1], axis=-1),
            "trunk_pos": np.stack([ahead, hip], axis=-1),
            "trunk_vel": np.zeros((len(time), 2)),
            "foot_pos": np.stack([ahead, foot], axis=-1),
            "contact": contact,
            "contact_force": np.stack([flat, 40.0 * sine], axis=-1),
            "energy": np.ones((len(time), 2)),
            "loop_gap": np.full((len(time), 2), 1e-7),
            "cycle_us": np.full(len(time), 250.0),
        }

    def recording(self, **changes: Any) -> Recording:
        signals = self.signals() | changes
        return recording(signals.pop("time"), signals.pop("entries", None), **signals)

    def real(self) -> Recording:
        """The same hop of a real leg: no truth."""
        known = {s.name for s in SIGNALS if "simulation only" not in s.doc}
        signals = self.signals()
        return recording(signals["time"], **{k: v for k, v in signals.items() if k in known})

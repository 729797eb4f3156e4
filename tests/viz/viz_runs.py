"""Plausible runs made by formulas: a hopping leg, and an oscillating one with a fixed trunk."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from legbench.control.bang_bang import BangBangPhase
from legbench.control.jump_rules import JumpPhase
from legbench.design.leg import LegDesign, Segment
from legbench.design.setup import Setup, SetupKind
from legbench.design.toml import design_to_mapping
from legbench.kinematics import leg_points, modal_to_joint
from legbench.mjcf import BuildOptions, build_spec, to_xml
from legbench.recording.columns import ONE_LEG
from legbench.recording.controller_table import controller_table
from legbench.recording.format_1 import built_in
from legbench.recording.layout import TIME
from legbench.recording.manifest import new_manifest, write_manifest
from legbench.recording.reader import Recording, described
from legbench.recording.stream import BatchEncoder, encode_schema, schema_for
from legbench.signals import SIGNALS, Floats

PROTOTYPE = LegDesign(
    name="prototype",
    trunk_mass=0.657,
    thigh=Segment(mass=0.192, length=0.064, com=0.010, inertia=455e-6),
    shank=Segment(mass=0.121, length=0.133, com=0.067, inertia=148e-6),
    foot=Segment(mass=0.030, length=0.069, com=0.010, inertia=71e-6),
    stiffness=(2.3, 2.3),
    damping=(0.0092, 0.0073),
)
SHANK = PROTOTYPE.shank.length
STANCE_TIME, STROKE, REST_LENGTH, GRAVITY = 0.22, 0.04, 0.215, 9.81
TAKEOFF = np.pi * STROKE / STANCE_TIME
FLIGHT_TIME = 2.0 * TAKEOFF / GRAVITY


def manifest_of(kind: SetupKind, **extra: Any) -> dict[str, Any]:
    """A manifest as the loop would write it."""
    controller = "jump" if kind is SetupKind.JUMP else "bang-bang"
    settings = {"z2": 1.0, "dz2": 0.15}
    given: Mapping[str, Any] = {
        "experiment": {
            "design": design_to_mapping(PROTOTYPE),
            "setup": {"kind": kind.value, "boom_radius": None},
            "linkage": {"kind": "bars", "bar_mass": 0.002, "crank_length": 0.02},
            "controller": {"kind": controller, "settings": settings},
            "conventions": {"modal": "orthonormal"},
            **extra,
        },
        "controller": controller_table(controller, built_in(controller, settings)),
    }
    return new_manifest(given, id=f"synthetic-{kind.value}", created="2024-01-01T00:00:00+00:00")


def hopping(rows: int) -> dict[str, Floats]:
    """Signals of a leg that hops in place and sways a little, 1 kHz."""
    time = np.arange(rows, dtype=np.float64) * 1e-3
    cycle = (time + 0.4 * STANCE_TIME) % (STANCE_TIME + FLIGHT_TIME)
    stance = cycle < STANCE_TIME
    share = np.clip(cycle / STANCE_TIME, 0.0, 1.0)
    flown = np.where(stance, 0.0, cycle - STANCE_TIME)
    swing = np.where(stance, 0.0, 0.018 * np.sin(np.pi * flown / FLIGHT_TIME) ** 2)
    length = REST_LENGTH - STROKE * np.sin(np.pi * share) * stance - swing
    height = np.where(stance, length, REST_LENGTH + TAKEOFF * flown - 0.5 * GRAVITY * flown**2)
    half = np.arccos(0.5 * length / SHANK)
    sway = 0.012 * np.sin(2 * np.pi * 1.7 * time) + 0.004 * np.sin(2 * np.pi * 7.1 * time)
    joint = np.stack([sway - half, sway + half], axis=-1)
    foot = leg_points(joint, PROTOTYPE.lengths)[:, 3]
    hip = np.stack([0.01 * np.sin(0.5 * time) - foot[:, 0], height], axis=-1)
    push = np.where(stance, 45.0 * np.sin(np.pi * share), 0.0)
    rising = stance & (share > 0.5)
    phase = np.where(rising, JumpPhase.PUSH, np.where(stance, JumpPhase.COMPRESS, JumpPhase.FLIGHT))
    target = modal_to_joint(np.stack([0 * time, np.where(rising, 0.85, 1.15)], axis=-1))
    force = np.stack([0.05 * push, push], axis=-1)
    return _signals(time, joint, target, hip, hip + foot, force, stance, phase)


def oscillating(rows: int, height: float) -> dict[str, Floats]:
    """Signals of a leg with a fixed trunk whose bang-bang oscillation builds up, 1 kHz."""
    time = np.arange(rows, dtype=np.float64) * 1e-3
    growth = 1.0 - np.exp(-time / 0.6)
    angle = 2 * np.pi * 3.1 * time
    modal = np.stack(
        [0.03 * growth * np.sin(angle + 0.6), 1.0 - 0.25 * growth * np.cos(angle)], axis=-1
    )
    joint = modal_to_joint(modal)
    rising = np.sin(angle) > 0
    phase = np.where(rising, BangBangPhase.FOLDED, BangBangPhase.STRETCHED)
    target = modal_to_joint(np.stack([0 * time, np.where(rising, 1.15, 0.85)], axis=-1))
    foot = leg_points(joint, PROTOTYPE.lengths)[:, 3]
    hip = np.tile([0.0, height], (rows, 1))
    contact = np.zeros(rows, dtype=bool)
    return _signals(time, joint, target, hip, hip + foot, 0 * foot, contact, phase)


def _signals(
    time: Floats,
    joint: Floats,
    target: Floats,
    hip: Floats,
    foot: Floats,
    force: Floats,
    contact: np.ndarray,
    phase: np.ndarray,
) -> dict[str, Floats]:
    noise = np.random.default_rng(7)
    rate = np.gradient(joint, time, axis=0)
    return {
        "t": time,
        "command_pos": target,
        "applied_pos": target,
        "motor_pos": target,
        "joint_pos": joint,
        "joint_vel": rate,
        "spring_torque": 2.3 * (target - joint),
        "phase": phase.astype(np.float64),
        "trunk_pos": hip,
        "trunk_vel": np.gradient(hip, time, axis=0),
        "foot_pos": foot,
        "contact_force": force,
        "contact": contact.astype(np.float64),
        "energy": np.stack([9.81 * hip[:, 1], 0.5 * (rate**2).sum(axis=1)], axis=-1),
        "loop_gap": 1e-5 * np.abs(noise.standard_normal(joint.shape)),
        "cycle_us": 60.0 + 10.0 * noise.standard_exponential(len(time)),
        "late_us": 0.0 * time,
    }


def columns_of(signals: Mapping[str, Floats]) -> dict[str, np.ndarray]:
    """The columns on disk of signals by name."""
    columns: dict[str, np.ndarray] = {TIME: np.rint(signals["t"] * 1e9).astype(np.int64)}
    for signal in SIGNALS:
        values = signals[signal.name].reshape(len(signals["t"]), -1)
        columns |= dict(zip(signal.columns, values.T, strict=True))
    return {name: columns[name] for name in (TIME, *ONE_LEG.names)}


def record(folder: Path, kind: SetupKind, rows: int, *, truth: bool = True) -> Recording:
    """A run as `load` would return it, with its model in `folder`."""
    spec = build_spec(PROTOTYPE, BuildOptions(setup=Setup(kind=kind)))
    height = float(spec.compile().body("trunk").pos[2])
    signals = hopping(rows) if kind is SetupKind.JUMP else oscillating(rows, height)
    if not truth:
        for name in ("trunk_pos", "trunk_vel", "foot_pos", "contact_force", "energy", "loop_gap"):
            signals[name] = np.full((rows, 2), np.nan)
        signals["contact"] = np.full(rows, -1.0)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "leg.xml").write_text(to_xml(spec), encoding="utf-8")
    manifest = manifest_of(kind)
    return Recording(
        path=folder,
        manifest=manifest,
        described=described(manifest, folder),
        time=signals["t"],
        columns=columns_of(signals),
        events=(),
    )


def part(recording: Recording, first: int, stop: int) -> Recording:
    """Rows [first, stop) of a run, as the writer would hand them over."""
    columns = {name: values[first:stop] for name, values in recording.columns.items()}
    return Recording(
        path=recording.path,
        manifest=recording.manifest,
        described=recording.described,
        time=recording.time[first:stop],
        columns=columns,
        events=(),
    )


def stream_of(recording: Recording, batch: int = 50) -> list[bytes]:
    """The messages of a run's stream without its end mark; `run.json` is written, too."""
    write_manifest(recording.path, recording.manifest)
    schema = schema_for(recording.manifest)
    values = [recording.time, *(recording.columns[name].astype(float) for name in ONE_LEG.names)]
    table = np.stack(values)
    contact = 1 + ONE_LEG.names.index("contact")
    table[contact] = np.where(table[contact] < 0.0, np.nan, table[contact])
    firsts = range(0, len(recording.time), batch)
    parts = [np.ascontiguousarray(table[:, first : first + batch]) for first in firsts]
    return [
        bytes(encode_schema(schema)),
        *(bytes(BatchEncoder(part, schema).encode(part)) for part in parts),
    ]

"""Phases of the jump controller and what ends each of them: the one table of its transitions.

The phases come from the springs alone, so nothing needs to know about the ground. They form a
ring, each with one way out:

    REST      after a while                               -> PUSH
    PUSH      unloaded, or at an upper apex on the ground -> RELEASE
    RELEASE   after a while                               -> FLIGHT
    FLIGHT    loaded for a while: touchdown               -> COMPRESS
    COMPRESS  at the lower apex                           -> PUSH

The springs' torque is the load, `-tau_z`; motor position less torque over stiffness is how far
the leg is folded, whose maximum is the lower apex and whose minimum is the upper one.

A leg in the air vibrates, and each swing may load the springs more than standing does. But it
changes sign twice a period: only the ground loads them for longer than half of one.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

from legbench.phases import PhaseInfo, Role


class JumpPhase(IntEnum):
    """Phases of the jump controller, as recorded."""

    REST = 0
    """The leg stands; its load is read."""
    FLIGHT = 5
    """Unloaded, waiting for the load of touchdown."""
    COMPRESS = 6
    """Loaded, the leg shortens towards the lower apex."""
    PUSH = 7
    """The equilibrium is at the longer leg, past the lower apex."""
    RELEASE = 8
    """Unloaded after the push, the equilibrium goes back to the shorter leg."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseExit:
    """The end of a phase: an apex, or a load that has lasted on one side of a level."""

    to: JumpPhase
    """Phase that follows."""
    apex: float = 0.0
    """1: largest fold (lower apex), -1: smallest fold (upper apex), 0: no apex ends it [-]."""
    sense: float = 1.0
    """1: a load above the level, -1: a load below it, 0: no load ends it [-]."""
    load: float = -math.inf
    """The level, as a share of the load of standing [-]."""
    dwell: float = 0.0
    """Time that the load must last on its side of the level [s]."""


class JumpThresholds(Protocol):
    """Loads and times at which phases of the jump controller end; `JumpConfig` holds them."""

    @property
    def delay(self) -> float:
        """Time at rest before the first push [s]."""
        ...

    @property
    def touchdown_load(self) -> float:
        """Load that means ground, as a share of the load of standing [-]."""
        ...

    @property
    def touchdown_time(self) -> float:
        """Time that this load must last [s]."""
        ...

    @property
    def release_load(self) -> float:
        """Load at which a push has lifted the leg, as a share of the load of standing [-]."""
        ...

    @property
    def release_time(self) -> float:
        """Shortest time from release to the next flight [s]."""
        ...


def phase_exits(config: JumpThresholds) -> dict[JumpPhase, PhaseExit]:
    """Return the end of each phase with these settings."""
    return {
        JumpPhase.REST: PhaseExit(to=JumpPhase.PUSH, dwell=config.delay),
        JumpPhase.PUSH: PhaseExit(
            to=JumpPhase.RELEASE, apex=-1.0, sense=-1.0, load=config.release_load
        ),
        JumpPhase.RELEASE: PhaseExit(to=JumpPhase.FLIGHT, dwell=config.release_time),
        JumpPhase.FLIGHT: PhaseExit(
            to=JumpPhase.COMPRESS, load=config.touchdown_load, dwell=config.touchdown_time
        ),
        JumpPhase.COMPRESS: PhaseExit(to=JumpPhase.PUSH, apex=1.0, sense=0.0, load=0.0),
    }


def phase_infos(config: JumpThresholds) -> tuple[PhaseInfo, ...]:
    """The phases for readers of a run; a touchdown is told once its load has lasted."""
    return (
        PhaseInfo(code=JumpPhase.REST, name="rest", role=Role.REST, doc="the leg stands"),
        PhaseInfo(
            code=JumpPhase.FLIGHT,
            name="flight",
            role=Role.FLIGHT,
            doc="unloaded, waiting for the load of touchdown",
        ),
        PhaseInfo(
            code=JumpPhase.COMPRESS,
            name="compress",
            role=Role.STANCE,
            doc="loaded, the leg shortens towards the lower apex",
            late=config.touchdown_time,
        ),
        PhaseInfo(
            code=JumpPhase.PUSH,
            name="push",
            role=Role.STANCE,
            doc="the equilibrium is at the longer leg, past the lower apex",
        ),
        PhaseInfo(
            code=JumpPhase.RELEASE,
            name="release",
            role=Role.FLIGHT,
            doc="unloaded after the push, the equilibrium goes back to the shorter leg",
        ),
    )

"""Bang-bang on a torque threshold (section IV-B): feeds the mode what damping takes."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from typing import ClassVar, final

import numpy as np

from legbench.control.abstract import AbstractController
from legbench.control.per_leg import each_config, setting
from legbench.control.setpoint import LegTargets, check_delay
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError
from legbench.phases import ControllerDescription, Counting, PhaseInfo, Role
from legbench.signals import Bools, Command, Floats, Ints, Observation

RATED_PERIODS = 20
"""Number of periods of a sustained oscillation that the paper rates (Fig. 5)."""


class BangBangPhase(IntEnum):
    """Levels of bang-bang, as recorded."""

    REST = 0
    """Equilibrium at z2, before the first switch."""
    MIDDLE = 2
    """Equilibrium at z2, between the thresholds of three levels."""
    FOLDED = 3
    """Equilibrium at z2 + dz2 (shorter leg)."""
    STRETCHED = 4
    """Equilibrium at z2 - dz2 (longer leg)."""


PHASES = (
    PhaseInfo(code=BangBangPhase.REST, name="rest", role=Role.REST, doc="before the first switch"),
    PhaseInfo(
        code=BangBangPhase.MIDDLE,
        name="middle",
        role=Role.ACTING,
        doc="three levels: the equilibrium at the rest posture",
    ),
    PhaseInfo(
        code=BangBangPhase.FOLDED,
        name="folded",
        role=Role.ACTING,
        doc="the equilibrium at z2 + dz2 (shorter leg)",
    ),
    PhaseInfo(
        code=BangBangPhase.STRETCHED,
        name="stretched",
        role=Role.ACTING,
        doc="the equilibrium at z2 - dz2 (longer leg)",
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class BangBangConfig:
    """The equilibrium switches between z2 + dz2 and z2 - dz2 as the spring torque tells."""

    kind: ClassVar[str] = "bang-bang"
    usual_setup: ClassVar[SetupKind] = SetupKind.FFS
    batched: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("motor_pos", "spring_torque")
    z2: float = 1.0
    """Set point in the middle, where the leg rests at first [rad]."""
    dz2: float = 0.08
    """Amplitude of the switching [rad]."""
    threshold: float = 0.05
    """Modal spring torque, zero at rest, that switches; the paper's epsilon [N m]."""
    three_levels: bool = False
    """Return to z2 while the torque is below the threshold, instead of holding."""
    delay: float = 0.1
    """Time at rest, to read the rest torque, before the first switch [s]."""
    sign: int = 1
    """Sign of the law: -1 inverts it, so that it brakes the mode, for demonstrations."""

    def build(self, targets: LegTargets) -> AbstractController:
        """Make the controller for these legs; raises ConfigError where they refuse the settings."""
        return BangBang(self, targets)

    @classmethod
    def build_each(
        cls, settings: "Sequence[BangBangConfig]", targets: LegTargets
    ) -> AbstractController:
        """Make the controller of a batch whose legs have settings of their own."""
        return BangBang(settings, targets)

    def describe(self) -> ControllerDescription:
        """Return its description: its phases, and that the first 20 periods count."""
        return ControllerDescription(phases=PHASES, counting=Counting(most=RATED_PERIODS))


@final
class BangBang(AbstractController):
    """`tau_z > eps` moves the equilibrium to z2 + dz2, `tau_z < -eps` to z2 - dz2.

    `tau_z` is the spring torque along z2 less its value at rest, so that gravity does not hold
    the switch. The first switch, to the longer leg, starts the motion; it is held until the
    torque has passed the threshold once, however slowly the motors follow.

    Raises:
        ConfigError: a set point that the leg cannot reach, a threshold that its own deflection
            cannot pass, or a delay or sign that makes no sense.
    """

    def __init__(
        self, config: BangBangConfig | Sequence[BangBangConfig], targets: LegTargets
    ) -> None:
        """Prepare for the legs of `targets`, all with the same settings or each with its own."""
        stiffness = np.atleast_1d(targets.modal_stiffness())
        configs = each_config(config)
        softest = stiffness if len(configs) > 1 else [float(np.min(stiffness))]
        for each, stiff in zip(configs, softest, strict=True):
            _check(each, float(stiff))
        of = partial(setting, config)
        self._sign, self._threshold = of("sign"), of("threshold")
        self._three_levels, self._delay = of("three_levels"), of("delay")
        self._last = float(np.max(self._delay))
        self._targets = targets
        self._middle = targets.motor_at(of("z2"), "z2")
        self._folded = targets.motor_at(of("z2") + of("dz2"), "z2 + dz2")
        self._stretched = targets.motor_at(of("z2") - of("dz2"), "z2 - dz2")
        self._rest_torque = np.zeros(self._middle.shape[:-1])
        self._level = np.full(self._middle.shape[:-1], BangBangPhase.STRETCHED, dtype=np.int64)
        self._going = np.zeros(self._middle.shape[:-1], dtype=np.bool_)

    @property
    def start_motor_pos(self) -> Floats:
        """Motor positions for the set point z2 [rad]."""
        return self._middle

    def reset(self, observation: Observation) -> None:
        """Begin anew with the spring torque of the leg at rest as zero."""
        self._rest_torque = self._targets.radial(observation.spring_torque)
        self._level = np.full(self._rest_torque.shape, BangBangPhase.STRETCHED, dtype=np.int64)
        self._going = np.zeros(self._rest_torque.shape, dtype=np.bool_)

    def step(self, observation: Observation) -> Command:
        """Switch on the zero-based modal torque."""
        if observation.time < self._last:
            waits = np.asarray(observation.time < self._delay)
            if waits.all():
                return Command.holding(self._middle)
            acting = self._act(observation, waits)
            return Command(
                motor_pos=np.where(waits[..., np.newaxis], self._middle, acting.motor_pos),
                phase=np.where(waits, np.int64(BangBangPhase.REST), acting.phase),
            )
        return self._act(observation, None)

    def _act(self, observation: Observation, waits: Bools | None) -> Command:
        """Switch the legs that do not wait any more."""
        torque = self._targets.radial(observation.spring_torque) - self._rest_torque
        torque = self._sign * torque
        threshold = self._threshold
        going = self._going | (np.abs(torque) > threshold)
        back = going & self._three_levels
        between = np.where(back, BangBangPhase.MIDDLE, self._level)
        level = np.where(
            torque > threshold,
            BangBangPhase.FOLDED,
            np.where(torque < -threshold, BangBangPhase.STRETCHED, between),
        ).astype(np.int64)
        if waits is not None:
            going, level = np.where(waits, self._going, going), np.where(waits, self._level, level)
        self._going, self._level = going, level
        return Command(motor_pos=self._motor(level), phase=level)

    def _motor(self, level: Ints) -> Floats:
        chosen = level[..., np.newaxis]
        return np.where(
            chosen == BangBangPhase.FOLDED,
            self._folded,
            np.where(chosen == BangBangPhase.STRETCHED, self._stretched, self._middle),
        )


def _check(config: BangBangConfig, stiffness: float) -> None:
    """Refuse settings that make no sense on springs of a stiffness along z2 [N m/rad]."""
    if config.sign not in (-1, 1):
        raise ConfigError(f"sign is {config.sign}; it must be 1 or -1")
    if not config.dz2 > 0.0:
        raise ConfigError(f"dz2 is {config.dz2:g} rad; bang-bang needs a positive amplitude")
    limit = stiffness * config.dz2
    if not 0.0 < config.threshold < limit:
        raise ConfigError(
            f"threshold is {config.threshold:g} N m; it must be positive and stay below "
            f"k dz2 = {limit:.3g} N m, or the oscillation dies: lower it or raise dz2"
        )
    check_delay(config.delay)

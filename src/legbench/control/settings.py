"""Settings of a controller, by which it is found, built and measured, for one leg or many."""

from collections.abc import Sequence
from typing import ClassVar, Protocol, runtime_checkable

from legbench.control.abstract import AbstractController
from legbench.control.checked import Checked
from legbench.control.each_leg import EachLeg
from legbench.control.setpoint import LegTargets
from legbench.design import LegDesign
from legbench.design.setup import SetupKind
from legbench.phases import ControllerDescription


@runtime_checkable
class ControllerSettings(Protocol):
    """Settings of a controller: a frozen dataclass whose fields become TOML keys and flags."""

    kind: ClassVar[str]
    """Name of the controller in files and on the command line."""
    usual_setup: ClassVar[SetupKind]
    """Setup in which the controller is usually run."""

    def build(self, targets: LegTargets) -> AbstractController:
        """Make the controller for the legs of `targets`; raises ConfigError if they refuse it."""
        ...

    def describe(self) -> ControllerDescription:
        """Return its phases, its own signals, and which periods count."""
        ...


def make_controller(settings: ControllerSettings, targets: LegTargets) -> AbstractController:
    """Make the controller of some settings, for the legs of `targets`.

    Settings whose class says `batched` get all legs at once and are trusted, as the built-in ones
    are. Any other law is built once a leg, sees one leg alone, and has its commands checked.

    Raises:
        ConfigError: settings that a leg refuses.
    """
    if getattr(type(settings), "batched", False):
        return settings.build(targets)
    description = settings.describe()
    if isinstance(targets.designs, LegDesign):
        return Checked(settings.build(targets), description)
    return EachLeg([Checked(settings.build(one), description) for one in targets.each()])


def make_controllers(
    settings: Sequence[ControllerSettings], targets: LegTargets
) -> AbstractController:
    """Make the controller of a batch whose legs have settings of their own.

    Settings of one class that says `batched` make one law in arrays; laws of several classes, or of
    a class that knows one leg alone, are stepped leg by leg.

    Args:
        settings: one for each leg.
        targets: the legs, a batch.

    Raises:
        ConfigError: settings that a leg refuses.
    """
    kinds = {type(each) for each in settings}
    if len(kinds) == 1:
        kind = next(iter(kinds))
        build = getattr(kind, "build_each", None) if getattr(kind, "batched", False) else None
        if build is not None:
            return build(settings, targets)
    pairs = zip(settings, targets.each(), strict=True)
    return EachLeg([make_controller(each, one) for each, one in pairs])

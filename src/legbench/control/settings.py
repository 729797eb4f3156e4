"""Settings of a controller, by which it is found, built and measured, for one leg or many."""

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

"""Temperature of an emulated drive, in whatever object it shows one."""

from legbench.drives.emulated.dictionary import Dictionary
from legbench.drives.emulated.store import ObjectStore
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.objects import TEMPERATURE
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.config import NodeConfig

WARM, HOT = 25.0, 90.0
"""Temperatures of a drive that is well, and of one that is not [deg C]."""
TENTHS = Mapped(TEMPERATURE, 0, DataType.INTEGER16)
"""The usual object, in tenths of a degree, whatever a bus file takes them for."""


def show_temperature(
    store: ObjectStore, dictionary: Dictionary, node: NodeConfig, celsius: float
) -> None:
    """Show a temperature [deg C]; a drive without an object for it shows none."""
    key = dictionary.temperature
    if key is None or store.entry(key) is None:
        return
    usual = node.temperature_object in (None, TENTHS)
    store.show(key, celsius / (0.1 if usual else node.temperature_scale))

"""Rewrite the object dictionaries of `hardware/` from the bus file and the object table."""

from pathlib import Path

from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.eds import dcf_text, eds_text

HARDWARE = Path(__file__).parents[1] / "hardware"


def files() -> dict[Path, str]:
    """What has to be in which file."""
    bus = load_bus(HARDWARE / "leg.toml")
    wanted = {HARDWARE / f"{node.name}.dcf": dcf_text(bus, node) for node in bus.nodes}
    return {HARDWARE / "legbench-drive.eds": eds_text(), **wanted}


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="ascii")
        print(f"wrote {path.name}")

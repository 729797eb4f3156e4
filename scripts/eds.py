"""Rewrite the object dictionaries of `hardware/` from the bus file and the object table."""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path

from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.eds import EDS_NAME, Stamps, dcf_text, eds_text, stamps_of

HARDWARE = Path(__file__).parents[1] / "hardware"


def files() -> dict[Path, Callable[[Stamps], str]]:
    """What writes which file, given the times in its head."""
    bus = load_bus(HARDWARE / "leg.toml")
    wanted = {HARDWARE / f"{node.name}.dcf": partial(dcf_text, bus, node) for node in bus.nodes}
    return {HARDWARE / EDS_NAME: eds_text, **wanted}


def renewed(path: Path, text_of: Callable[[Stamps], str], now: datetime) -> str | None:
    """Text of a file whose content has changed, modified now; none if it is up to date."""
    present = path.read_text(encoding="ascii") if path.exists() else ""
    stamps = stamps_of(present) or Stamps()
    if text_of(stamps) == present:
        return None
    return text_of(replace(stamps, modified=now))


if __name__ == "__main__":
    for path, text_of in files().items():
        text = renewed(path, text_of, datetime.now())
        if text is not None:
            path.write_text(text, encoding="ascii")
        print(f"{path.name} is up to date" if text is None else f"wrote {path.name}")

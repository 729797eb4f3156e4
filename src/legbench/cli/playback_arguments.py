"""Flags that say which part of a run is played, and how."""

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import arg

from legbench.viz.playback import Playback


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaybackArguments:
    """Part of a run that is shown, its speed, and whether it begins again."""

    begin: Annotated[float | None, arg(name="from")] = None
    """Plant time at which pictures begin; by default at the first row [s]."""
    end: Annotated[float | None, arg(name="to")] = None
    """Plant time at which pictures end; by default at the last row [s]."""
    speed: float = 1.0
    """Plant time over wall time [-]; 0.25 is four times slower than the leg was."""
    loop: bool = False
    """Whether to begin again at the end."""

    @property
    def playback(self) -> Playback:
        """What these flags ask for; raises ConfigError where that makes no sense."""
        return Playback(begin=self.begin, end=self.end, speed=self.speed, loop=self.loop)

"""Flags of `legbench replay`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg

from legbench.cli.playback_arguments import PlaybackArguments
from legbench.design.setup import SetupKind
from legbench.errors import ConfigError
from legbench.replay.moved import MotionSource


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayArguments:
    """Rate a recorded run again, from its file alone; show it, or let it happen again."""

    run: Annotated[Path, Positional]
    """Run folder, which may be torn; with --bus a log of raw frames: .log, .asc, .blf, .trc
    or .csv, each also packed (.gz)."""
    against: UseAppendAction[tuple[Path, ...]] = ()
    """Another run to compare with and to draw over this one; may be repeated."""
    controller: bool = False
    """Whether to show its controller what was recorded, and to compare the commands to the bit; the
    exit status is 1 if those of the recorded controller differ. A controller's own file is run."""
    resimulate: MotionSource | None = None
    """Let the leg move again: commands drives its servos as recorded, motors puts the motors where
    they were measured, which is what a run on drives is for."""
    settings: Annotated[UseAppendAction[tuple[str, ...]], arg(name="set")] = ()
    """Replace an entry of the experiment in what is replayed, such as
    controller.settings.dz2=0.07; may be repeated."""
    design: Path | None = None
    """Design file of another leg to be moved instead; of a log, the leg that was on the drives
    (models/optimal.toml if it is not said, or that of the run folder that it lies in)."""
    plant: str | None = None
    """Plant to resimulate on: sim, analytic, or path/to/mine.py:Class; by default that of the run,
    and sim for a run on drives."""
    beyond: float = 0.0
    """Difference that counts in "first beyond" [each signal's unit]."""
    bus: Path | None = None
    """Bus file that describes the drives of a log, such as hardware/leg.toml."""
    setup: SetupKind | None = None
    """Setup of the leg in a log; by default that of the run folder that it lies in, else jump."""
    view: bool = False
    """Whether to open the run in rerun."""
    serve: bool = False
    """Whether to show the run in a browser on this machine, until ^C."""
    mujoco: bool = False
    """Whether to play the run in MuJoCo's viewer, until its window is closed."""
    playback: PlaybackArguments = field(default_factory=PlaybackArguments)
    rrd: Path | None = None
    """Write a rerun file that anyone can open."""
    figure: Path | None = None
    """Write the phase plots of Fig. 4 or 6; of a replay, what was recorded and replayed over time:
    .png, .svg or .pdf."""
    json: bool = False
    """Print one JSON object on stdout."""

    def check_pictures(self) -> None:
        """Refuse a part of a run, a speed or a loop where nothing is played; raises ConfigError."""
        plays = self.view or self.serve or self.mujoco or self.rrd is not None
        if not plays and self.playback != PlaybackArguments():
            raise ConfigError(
                "--from, --to, --speed and --loop say how a run is played; add --view, --serve, "
                "--rrd FILE or --mujoco, or give them to `legbench render`"
            )

    def check(self) -> None:
        """Refuse flags that mean nothing together; raises ConfigError."""
        _ = self.playback.playback
        if self.figure is not None:
            from legbench.viz.print.save import check_suffix

            check_suffix(self.figure)
        again = self.controller or self.resimulate is not None
        if self.controller and self.resimulate is not None:
            raise ConfigError("--controller and --resimulate are two replays; ask for one")
        if self.settings and not again:
            raise ConfigError("--set changes what is replayed; add --controller or --resimulate")
        if self.design is not None and not again and self.bus is None:
            raise ConfigError(
                "--design is another leg to move; add --resimulate, or --bus of a log's drives"
            )
        if self.plant is not None and self.resimulate is None:
            raise ConfigError("--plant is what moves the leg; add --resimulate commands or motors")
        if not self.beyond >= 0.0:
            raise ConfigError(f"beyond is {self.beyond:g}; it must be 0 or more")
        if self.setup is not None and self.bus is None:
            raise ConfigError("a run knows its setup; --setup belongs to a log and its --bus")

"""`legbench drives`: commission the servo drives, or emulate them."""

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import subcommand

from legbench.cli import (
    drives_moving,
    drives_reading,
    drives_service,
    drives_serving,
    drives_sheets,
    drives_timing,
)
from legbench.cli.drives_reading import BenchFlags
from legbench.cli.parse import parse
from legbench.interrupts import stop_on_interrupt


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivesArguments:
    """Commission the servo drives, or emulate them."""

    action: (
        Annotated[
            drives_reading.Scan, subcommand("scan", description="who is on the bus; writes nothing")
        ]
        | Annotated[
            drives_reading.Status,
            subcommand("status", description="what the drives say of themselves, in words"),
        ]
        | Annotated[
            drives_moving.Configure,
            subcommand("configure", description="compare the drives with the bus file, or write"),
        ]
        | Annotated[
            drives_moving.Zero,
            subcommand("zero", description="measure the encoders' offsets in a known posture"),
        ]
        | Annotated[
            drives_moving.Home,
            subcommand("home", description="home one drive by its own procedure; IT MAY MOVE"),
        ]
        | Annotated[
            drives_moving.Jog,
            subcommand("jog", description="move one motor a little, under all limits; IT MOVES"),
        ]
        | Annotated[
            drives_service.Reset,
            subcommand("reset", description="leave faults whose cause is gone; enables nothing"),
        ]
        | Annotated[
            drives_service.Store,
            subcommand("store", description="make the drives store what they hold (1010h)"),
        ]
        | Annotated[
            drives_service.NodeId,
            subcommand("node-id", description="give the only drive on the bus another node id"),
        ]
        | Annotated[
            drives_timing.Jitter,
            subcommand("jitter", description="how punctual the cycle is; enables nothing"),
        ]
        | Annotated[
            drives_reading.Budget,
            subcommand("budget", description="what the schedule takes of the wire at worst"),
        ]
        | Annotated[
            drives_sheets.Learn,
            subcommand("learn", description="a vendor's data sheet to a bus file to begin with"),
        ]
        | Annotated[
            drives_sheets.Check,
            subcommand("check", description="a bus file against its drives' data sheets"),
        ]
        | Annotated[
            drives_serving.Emulate,
            subcommand("emulate", description="an emulated leg for other processes"),
        ]
        | Annotated[
            drives_serving.Monitor,
            subcommand("monitor", description="listen, and tell what the drives say"),
        ]
    )
    bench: BenchFlags


def main(arguments: list[str]) -> int:
    """Run one action; its exit status is 1 if something is not as it should be, else 0.

    ^C, SIGTERM and SIGHUP raise one KeyboardInterrupt, whatever the action is: drives that have
    power lose it on the way out, and later signals change nothing about that.
    """
    chosen = parse(DrivesArguments, "drives", arguments)
    with stop_on_interrupt(raises=True):
        return chosen.action.run(chosen.bench)

"""Preparation of the drives by SDO, before process data begins and before anything moves."""

from legbench.drives.errors import DriveError
from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.cycle import Cycle
from legbench.drives.protocol.nmt import NmtState
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.outcome import Outcome
from legbench.drives.setup.taken import check_taken


def prepare_to_move(
    bring_up: BringUp, config: BusConfig, *, speed: float
) -> dict[str, tuple[Outcome, ...]]:
    """Take the power from all drives, configure them, and set each target to its motor position.

    Args:
        bring_up: access to the drives.
        config: the bus.
        speed: highest speed of the motors [rad/s].

    Returns:
        What became of every object of each drive's configuration, by the name of its node.

    Raises:
        BusError: nobody can be talked to.
        DriveError: a drive is missing, is another one, refuses what is required, or is not
            protected by what it took.
        PlantFault: somebody else leads the drives.
    """
    bring_up.listen()
    bring_up.identify()
    bring_up.unpower()
    bring_up.glance()
    bring_up.pre_operational()
    outcomes = {node.name: bring_up.configure(node) for node in config.nodes}
    check_taken(config, outcomes, speed=speed)
    for node in config.nodes:
        bring_up.check_soft_limits(node)
        bring_up.preload(node)
    return outcomes


def refuse_led(bring_up: BringUp, cycle: Cycle, config: BusConfig) -> None:
    """Raise DriveError for a drive that somebody leads, though nobody sends SYNC."""
    for node, watch in zip(config.nodes, cycle.watches, strict=True):
        powered = bring_up.powered(node)
        if powered or watch.state is NmtState.OPERATIONAL:
            raise DriveError(
                f"drive '{node.name}' (node {node.node_id}) "
                f"{'has power' if powered else 'is operational'}, though nobody sends SYNC: "
                "somebody else leads it, and read-only does not interfere; end that program"
            )


def read_temperatures(bring_up: BringUp, cycle: Cycle, config: BusConfig) -> None:
    """Give every temperature poll the first reading of its drive; raises as `SdoPort.read` does."""
    for node, poll in zip(config.nodes, cycle.polls, strict=True):
        reading = bring_up.temperature(node)
        if reading is not None:
            poll.take(reading)

"""Preparation of the drives by SDO, before process data begins and before anything moves."""

from collections.abc import Sequence

from legbench.drives.errors import DriveError
from legbench.drives.master.bring_up import BringUp
from legbench.drives.master.cycle import Cycle
from legbench.drives.protocol.nmt import NmtState
from legbench.drives.setup.config import BusConfig, NodeConfig
from legbench.drives.setup.outcome import ObjectOutcome
from legbench.drives.setup.taken import check_taken


def prepare_to_move(
    bring_up: BringUp, config: BusConfig, *, speed: float
) -> dict[str, tuple[ObjectOutcome, ...]]:
    """Take the power from all drives, configure them, and set each target to its motor position.

    Args:
        bring_up: access to the drives.
        config: the bus.
        speed: highest speed of the motors [rad/s].

    Returns:
        What became of every object of each drive's configuration, by the name of its node.

    Raises:
        BusError: nobody can be talked to.
        DriveError: a drive is missing, is another one, is not homed, refuses what is required, or
            is not protected by what it took.
        PlantFault: somebody else leads the drives.
    """
    take_power(bring_up, config.nodes)
    bring_up.pre_operational()
    outcomes = {node.name: bring_up.configure(node) for node in config.nodes}
    check_taken(config, outcomes, speed=speed)
    for node in config.nodes:
        bring_up.check_soft_limits(node)
        bring_up.preload(node)
    return outcomes


def take_power(bring_up: BringUp, homed: Sequence[NodeConfig] = ()) -> None:
    """Make sure that nobody else leads the drives and that they are the right ones; then stop them.

    Args:
        bring_up: access to the drives.
        homed: drives that must be homed, if the bus file says how they show it.

    Raises:
        BusError: nobody can be talked to.
        DriveError: a drive is missing, is another one, is not homed, or keeps its power.
        PlantFault: somebody else leads the drives.
    """
    bring_up.listen()
    bring_up.identify()
    check_homed(bring_up, homed)
    bring_up.unpower()
    bring_up.poll_frames()


def is_homed(bring_up: BringUp, node: NodeConfig) -> bool | None:
    """Whether a drive says that its position refers to its home; none if it need not be homed."""
    wanted = node.homed
    if wanted is None:
        return None
    entry = wanted.object
    return wanted.met(bring_up.sdo(node).get_int(entry.index, entry.sub, entry.kind))


def check_homed(bring_up: BringUp, nodes: Sequence[NodeConfig]) -> None:
    """Refuse drives whose positions mean nothing yet; nothing has been written by then.

    Raises:
        DriveError: the bus file says how a drive shows that it is homed, and it does not.
    """
    for node in nodes:
        if is_homed(bring_up, node) is False:
            raise DriveError(
                f"drive '{node.name}' (node {node.node_id}) is not homed ({node.homed}): its "
                f"position means nothing yet; run `legbench drives home --node {node.name}`"
            )


def refuse_powered(bring_up: BringUp, nodes: Sequence[NodeConfig]) -> None:
    """Refuse drives that are found with power, for those who change what drives keep.

    Raises:
        DriveError: the motor of one may have torque.
    """
    for node in nodes:
        if bring_up.powered(node):
            raise DriveError(
                f"drive '{node.name}' (node {node.node_id}) has power; end the program that leads "
                "it, or press the stop button: nothing has been written"
            )


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

"""What the drives hold against what the bus file says."""

from dataclasses import dataclass

from legbench.drives.master.session import Session
from legbench.drives.protocol.objects import name_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """One object that a drive holds otherwise."""

    node: str
    object: str
    holds: int
    wanted: int


def differences(session: Session) -> list[Difference]:
    """Objects that differ, after the identities have been checked; raises DriveError."""
    up = session.bring_up()
    up.identify()
    return [
        Difference(
            node=node.name,
            object=name_of(parameter.index, parameter.sub),
            holds=there,
            wanted=parameter.value,
        )
        for node in session.config.nodes
        for parameter, there in up.differences(node)
    ]


def write(session: Session) -> int:
    """Write the configuration and read every object back; how many. No drive is enabled.

    Raises:
        BusError: the channel has a master.
        PlantFault: somebody else leads these drives; nothing has been written since it was heard.
        DriveError: a drive is another one, or does not take a value.
    """
    session.hold()
    up = session.bring_up()
    up.listen()
    up.identify()
    up.glance()
    up.pre_operational()
    return sum(up.configure(node) for node in session.config.nodes)

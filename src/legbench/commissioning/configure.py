"""Comparison of the drives' objects with the bus file, and writing of the configuration."""

from dataclasses import dataclass

from legbench.drives.master.session import Session
from legbench.drives.setup.taken import check_taken, unprotected


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectDifference:
    """Object whose value in a drive differs from the bus file's."""

    node: str
    object: str
    holds: int | None
    """Value in the drive; None if the drive has no such object."""
    wanted: int


def differences(session: Session) -> list[ObjectDifference]:
    """Objects that differ, after the identities have been checked; raises DriveError."""
    up = session.bring_up()
    up.identify()
    return [
        ObjectDifference(
            node=node.name,
            object=entry.name,
            holds=entry.there,
            wanted=entry.parameter.value,
        )
        for node in session.config.nodes
        for entry in up.differences(node)
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenConfiguration:
    """Result of writing a configuration."""

    objects: int
    """Number of objects that hold what was wanted, or what does the same."""
    lines: tuple[str, ...]
    """Lines that tell what the drives lack or hold otherwise, and what takes its place."""
    held: frozenset[tuple[str, str]]
    """Node and object of every value that a drive holds otherwise and cannot change."""


def write(session: Session) -> WrittenConfiguration:
    """Write the configuration and read every object back. No drive is enabled.

    Raises:
        BusError: the channel has a master.
        PlantFault: somebody else leads these drives; nothing has been written since it was heard.
        DriveError: a drive is another one, does not take what is required, or would not be
            protected.
    """
    session.hold()
    up = session.bring_up()
    up.listen()
    up.identify()
    up.poll_frames()
    up.pre_operational()
    outcomes = {node.name: up.configure(node) for node in session.config.nodes}
    check_taken(session.config, outcomes)
    entries = [(name, entry) for name, found in outcomes.items() for entry in found]
    return WrittenConfiguration(
        objects=sum(entry.agrees for _, entry in entries),
        lines=unprotected(outcomes),
        held=frozenset((name, entry.name) for name, entry in entries if not entry.agrees),
    )

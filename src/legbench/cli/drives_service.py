"""`legbench drives reset|store|node-id`: service of drives; nothing is enabled."""

from dataclasses import asdict, dataclass

from legbench.cli.drives_moving import nodes_named
from legbench.cli.drives_reading import BenchFlags
from legbench.cli.output import note, print_json


@dataclass(frozen=True, slots=True, kw_only=True)
class Reset:
    """Reset the faults of the drives, once, where the cause is gone; nothing is enabled."""

    node: str | None = None
    """Name in the bus file of the only drive to reset; by default all that are in fault."""

    def run(self, bench: BenchFlags) -> int:
        """Print how every drive is; 1 if one is still in fault."""
        from legbench.commissioning.reset import reset

        with bench.session(leads=True) as session:
            done = reset(session, nodes_named(session, self.node))
        if bench.json:
            print_json({"nodes": [asdict(one) for one in done]})
        else:
            for one in done:
                was = f"was in fault: {one.error}" if one.error else "was in no fault"
                print(f"{one.node} {was}; now {one.after}")
        for one in done:
            if one.in_fault:
                note(f"{one.node} is still in fault: its cause is there; remove it, then try again")
        return 1 if any(one.in_fault for one in done) else 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Store:
    """Make the drives store what they hold now in their memory (1010h); nothing is enabled.

    No run needs this: every one writes the bus file anew. It bears some 10 000 writes.
    """

    node: str | None = None
    """Name in the bus file of the only drive to store; by default all."""
    part: int = 1
    """Sub-index of 1010h: 1 all, 2 communication, 3 application parameters, from 4 on the maker's,
    127 at most."""
    timeout: float = 10.0
    """Longest wait for a drive that writes its memory [s]."""

    def run(self, bench: BenchFlags) -> int:
        """Print which drives have stored."""
        from legbench.commissioning.store import store

        with bench.session(leads=True) as session:
            nodes = nodes_named(session, self.node)
            done = store(session, nodes, part=self.part, timeout=self.timeout)
        if bench.json:
            print_json({"stored": [asdict(one) for one in done]})
            return 0
        for one in done:
            also = "; it says that it stores by itself, too" if one.by_itself else ""
            print(f"{one.node} has stored its parameters (1010h:{one.part:02X}){also}")
        return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeId:
    """Give the only drive on the bus another node id, over LSS; nothing is enabled."""

    to: int
    """New node id, 1 to 127."""

    def run(self, bench: BenchFlags) -> int:
        """Print the drive and its node ids; 1 if it could not store the new one."""
        from legbench.commissioning.node_id import set_node_id

        with bench.session(leads=True) as session:
            done = set_node_id(session, self.to)
            nodes = session.config.nodes
        if bench.json:
            print_json(asdict(done))
        else:
            was = "had no node id" if done.before is None else f"was node {done.before}"
            print(
                f"vendor {done.vendor:#010x}  product {done.product:#010x}  serial {done.serial}  "
                f"revision {done.revision}  {was}, is node {done.after}"
            )
        for node in nodes:
            if node.identity.serial == done.serial and node.node_id != done.after:
                note(f"give '{node.name}' the line id = {done.after} in {bench.bus}")
        if not done.stored:
            note(
                f"the drive does not store its node id: it is node {done.after} until its power is "
                "switched off"
            )
        return 0 if done.stored else 1

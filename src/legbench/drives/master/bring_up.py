"""Bring-up of drives by SDO: identity, configuration, checks; nothing here enables a drive."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import final

import can

from legbench.drives.errors import BusError, DriveError, SdoAbortError
from legbench.drives.master.first_contact import first_contact
from legbench.drives.master.identification import identify, read_identity
from legbench.drives.master.master_detector import MasterDetector
from legbench.drives.master.parking import is_parked
from legbench.drives.master.port import Port
from legbench.drives.master.sdo_port import SdoPort
from legbench.drives.master.sdo_stop import SdoStop
from legbench.drives.master.writing import read_configuration, write_configuration
from legbench.drives.protocol.cia402 import POWERED, Mode, decode_state
from legbench.drives.protocol.datatypes import DataType
from legbench.drives.protocol.emcy import MEANINGS
from legbench.drives.protocol.nmt import NmtCommand, nmt_frame
from legbench.drives.protocol.sdo import ABSENT, Abort
from legbench.drives.setup.config import BusConfig, Identity, NodeConfig
from legbench.drives.setup.configuration import configuration
from legbench.drives.setup.outcome import ObjectOutcome
from legbench.drives.setup.quirks import ModeShown
from legbench.interrupts import shielded

MODE_LOOK_NS = 10_000_000
"""Time between two reads of 6061h [ns]."""
U32, I32, I8, U16 = (
    DataType.UNSIGNED32,
    DataType.INTEGER32,
    DataType.INTEGER8,
    DataType.UNSIGNED16,
)


@final
class BringUp:
    """Talks to the drives by SDO, before and between cyclic operation."""

    def __init__(self, port: Port, bus: BusConfig, on_other: Callable[[can.Message], None]) -> None:
        self._port, self._bus, self._on_other = port, bus, on_other
        self.detector = MasterDetector(port, bus)
        self._sdo = {
            node.node_id: SdoPort(
                port,
                node.node_id,
                timeout_ms=bus.sdo_timeout_ms,
                retries=bus.sdo_retries,
                on_other=self._hear,
                before_write=self.poll_frames,
            )
            for node in bus.nodes
        }

    def listen(self) -> None:
        """Listen before anything but questions is sent, then ask the drives whom they watch.

        Until `detector.disarm` another master ends the bring-up with the next frame that is
        heard of it, before the next object is written.

        Raises:
            PlantFault: somebody else leads these drives, or asks them.
            BusError: the bus has failed, or nobody can be talked to.
        """
        with self.contact():
            self.detector.listen()
            if not self.detector.heard_nodes:
                return
            for node in self._bus.nodes:
                if node.heartbeat_consumer:
                    self.detector.check_consumer(node, self.sdo(node).find_int(0x1016, 1, U32) or 0)

    def poll_frames(self) -> None:
        """Hear what has come by now; raises PlantFault if another master has spoken."""
        for message in self.detector.poll_frames():
            self._on_other(message)

    def _hear(self, message: can.Message) -> None:
        self._on_other(message)
        self.detector.check_frame(message)

    def sdo(self, node: NodeConfig) -> SdoPort:
        """Access to the objects of a node."""
        return self._sdo[node.node_id]

    def contact(self) -> AbstractContextManager[None]:
        """Context of the first request, whose errors say what is wrong with the bus."""
        return first_contact(self._port, self._bus)

    def identify(self, nodes: Sequence[NodeConfig] | None = None) -> None:
        """Check that every node is the one that the bus file means (1000h, 1018h, 6502h).

        Raises:
            BusError: nobody can be talked to, such as at a wrong bitrate.
            DriveError: a node is missing, is another one, or two are swapped.
        """
        with self.contact():
            identify(self._bus.nodes if nodes is None else nodes, self._bus, self.sdo)

    def identity(self, node: NodeConfig) -> Identity:
        """Read the identity object of a node (1018h); raises as `SdoPort.read` does."""
        return read_identity(self.sdo(node))

    def pre_operational(self) -> None:
        """Order all nodes into pre-operational; a drive that still moves stops (6007h).

        Raises:
            BusError: one could not be told; all others have been.
        """
        failed: BusError | None = None
        for node in self._bus.nodes:
            try:
                self._port.send_frame(nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL, node.node_id))
            except BusError as error:
                failed = error
        if failed is not None:
            raise failed

    def compare(self, node: NodeConfig) -> tuple[ObjectOutcome, ...]:
        """Compare what a drive holds with its configuration, object by object; writes nothing."""
        return read_configuration(self.sdo(node), tuple(configuration(self._bus, node)))

    def differences(self, node: NodeConfig) -> list[ObjectOutcome]:
        """Objects that a drive holds otherwise, or lacks and must not; writes nothing."""
        return [
            entry
            for entry in self.compare(node)
            if not entry.agrees and (entry.there is not None or not entry.passes)
        ]

    def refuse_differences(self) -> dict[str, tuple[ObjectOutcome, ...]]:
        """Raise DriveError for the first drive that differs, for a master that may not configure.

        Process data that is mapped otherwise would be read as what it is not. Command frames
        that are switched off, as after every run, change nothing for those who only look, and
        neither does a protection that the drive lacks or holds otherwise. Returns what every drive
        holds, by the name of its node.
        """
        found: dict[str, tuple[ObjectOutcome, ...]] = {}
        for node in self._bus.nodes:
            found[node.name] = self.compare(node)
            different = [
                entry
                for entry in found[node.name]
                if not entry.passes
                and not (entry.there and is_parked(node, entry.parameter, entry.there))
            ]
            if different:
                first = different[0]
                raise DriveError(
                    f"node {node.node_id} ('{node.name}') holds {len(different)} objects otherwise "
                    f"than the bus file, first {first.name}: {first.there}, wanted "
                    f"{first.parameter.value}; read-only changes no drive: run `legbench drives "
                    "configure --write` first"
                )
        return found

    def configure(self, node: NodeConfig) -> tuple[ObjectOutcome, ...]:
        """Write the configuration and read every object back; returns what became of each.

        Raises:
            DriveError: the drive refuses what is required, or holds another value afterwards.
        """
        try:
            sdo, plan = self.sdo(node), tuple(configuration(self._bus, node))
            outcomes = write_configuration(sdo, node, plan)
        except KeyboardInterrupt as error:
            error.add_note(
                f"drive '{node.name}' (node {node.node_id}) has no power, and holds its "
                "configuration in part: every run writes it anew, `legbench drives configure "
                "--write` does, too"
            )
            raise
        self._await_mode(node)
        return outcomes

    def _await_mode(self, node: NodeConfig) -> None:
        """Read 6061h until it shows the mode written to 6060h, behind which it lags.

        A drive that shows its mode only once it is enabled is asked then, see `ModePoll`.
        """
        quirks, timebase = node.quirks, self._port.timebase
        if quirks.mode_shown is ModeShown.ENABLED:
            return
        until_ns = timebase.now_ns() + 1_000_000 * quirks.mode_patience_ms
        while True:
            mode = self.sdo(node).get_int(0x6061, 0, I8)
            if mode == Mode.CYCLIC_SYNCHRONOUS_POSITION:
                return
            if timebase.now_ns() >= until_ns:
                break
            timebase.wait_until(timebase.now_ns() + MODE_LOOK_NS)
        raise DriveError(
            f"node {node.node_id} ('{node.name}') stays in mode {mode} (6061h) for "
            f"{quirks.mode_patience_ms} ms, asked for was 8: is its halt bit set? If the drive is "
            "slow, raise mode_patience_ms in [node.quirks]; if it shows its mode only once it is "
            f'enabled, give mode_shown = "{ModeShown.ENABLED}"'
        )

    def preload(self, node: NodeConfig) -> int:
        """Set the target to the motor position (607Ah from 6064h); returns it [counts]."""
        sdo, target = self.sdo(node), node.target_object
        actual = self.position(node)
        sdo.put(target.index, target.sub, target.kind, actual)
        try:
            there = sdo.get_int(target.index, target.sub, target.kind)
        except SdoAbortError as error:
            if error.code != Abort.WRITE_ONLY:
                raise
            there = actual  # It was taken, and nobody can say more.
        if there != actual:
            raise DriveError(
                f"node {node.node_id} ('{node.name}') does not take a target position by SDO"
            )
        return actual

    def position(self, node: NodeConfig) -> int:
        """Position of a drive as its object shows it (6064h) [counts]; raises as `SdoPort.get`."""
        entry = node.motor_object
        return self.sdo(node).get_int(entry.index, entry.sub, entry.kind)

    def soft_limits(self, node: NodeConfig) -> tuple[int, int] | None:
        """Range to which the drive clamps targets (607Dh) [counts]; none where it does not."""
        sdo = self.sdo(node)
        try:
            low, high = sdo.get_int(0x607D, 1, I32), sdo.get_int(0x607D, 2, I32)
        except SdoAbortError as error:
            if error.code == Abort.WRITE_ONLY:
                return node.soft_limits_counts
            if error.code in ABSENT:
                return None
            raise
        return (low, high) if low < high else None

    def check_soft_limits(self, node: NodeConfig) -> None:
        """Refuse a motor that the drive itself would pull into its range when enabled.

        Raises:
            DriveError: 6064h lies outside 607Dh, as both are read back.
        """
        limits = self.soft_limits(node)
        if limits is None:
            return
        actual = self.position(node)
        if not limits[0] <= actual <= limits[1]:
            ends = sorted(map(node.motor.to_rad, limits))
            raise DriveError(
                f"node {node.node_id} ('{node.name}') stands at {node.motor.to_rad(actual):.3f} "
                f"rad ({actual} counts), outside its software limits 607Dh of [{ends[0]:.3f}, "
                f"{ends[1]:.3f}] rad ({limits[0]} to {limits[1]} counts), to which it would jump "
                "when enabled: move it back by hand, or correct soft_limits and offset_counts"
            )

    def temperature(self, node: NodeConfig) -> float | None:
        """Reading of the drive's temperature [counts]; none if the bus file names no object."""
        entry = node.temperature_object
        if entry is None:
            return None
        return self.sdo(node).get_number(entry.index, entry.sub, entry.kind)

    def unpower(self) -> None:
        """Stop drives that are found with power, by quick stop, before anything is written.

        Raises:
            DriveError: one keeps its power.
        """
        powered = [node for node in self._bus.nodes if self.powered(node)]
        if not powered:
            return
        with shielded() as shield:
            report = SdoStop(self._port, powered, shield.hold).run()
        if report.trouble is not None:
            raise DriveError(
                f"found with power: {report.trouble}; or end the program that leads it"
            )

    def powered(self, node: NodeConfig) -> bool:
        """Whether the motor of a drive may have torque (6041h)."""
        return decode_state(self.sdo(node).get_int(0x6041, 0, U16)) in POWERED

    def error_text(self, node: NodeConfig) -> str:
        """Error code 603Fh in words; a drive may have none."""
        code = self.sdo(node).find_int(0x603F, 0, U16)
        if code is None:
            return "it has no error code (603Fh)"
        return f"{code:04X}h {MEANINGS.get(code, 'see the drive manual')}"

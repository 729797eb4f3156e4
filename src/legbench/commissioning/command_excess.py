"""Excess of commands on the bus over the limits, from raw frames."""

from pathlib import Path

from legbench.drives.setup.config import BusConfig
from legbench.limits.safety import SafetyLimits


def excess_of(log: Path, config: BusConfig, limits: SafetyLimits) -> float:
    """Largest excess of a command to an enabled drive over the limits, from raw frames [rad]."""
    worst = -1.0
    step_max = limits.command_speed * config.period
    lines = log.read_text(encoding="ascii").split()
    frames = [line.partition("#") for line in lines if "#" in line]
    for node, (low, high) in zip(config.nodes, limits.motor_range, strict=True):
        name = f"{node.rpdo_id(node.rpdos[0]):03X}"
        slack, last = node.motor.resolution, None
        for cob_id, _, data in frames:
            if cob_id != name or data[:4] != "0F00":
                continue
            counts = int.from_bytes(bytes.fromhex(data[4:12]), "little", signed=True)
            angle = node.motor.to_rad(counts)
            beyond = max(low - angle, angle - high)
            if last is not None:
                beyond = max(beyond, abs(angle - last) - step_max)
            worst, last = max(worst, beyond - slack), angle
    return worst

"""Rows to record, each from its number alone; as a program, a process to kill or to starve."""

import os
import resource
import sys
import time
from pathlib import Path

import numpy as np

from legbench.errors import RecordingError
from legbench.recording.writer import RunWriter
from legbench.signals import Command, Observation, Truth

RATE = 1000.0
Cycle = tuple[Command, Observation, float, float]


def cycle(row: int, *, truth: bool = True) -> Cycle:
    """Return what is recorded of cycle `row`."""
    pairs = [np.array([row + 0.1 * place, -row / (1.0 + place)]) for place in range(12)]
    seen = Truth(
        trunk_pos=pairs[6],
        trunk_vel=pairs[7],
        foot_pos=pairs[8],
        contact_force=pairs[9],
        energy=pairs[10],
        loop_gap=pairs[11],
        contact=np.bool_(row % 3 == 0),  # pyrefly: ignore[bad-argument-type]
    )
    observation = Observation(
        time=row / RATE,
        applied_pos=pairs[1],
        motor_pos=pairs[2],
        joint_pos=pairs[3],
        joint_vel=pairs[4],
        spring_torque=pairs[5],
        truth=seen if truth else None,
    )
    command = Command(motor_pos=pairs[0], phase=np.array(row % 9))
    return command, observation, 100.0 + row, 0.5 * row


def append_rows(writer: RunWriter, count: int, *, start: int = 0, truth: bool = True) -> None:
    for row in range(start, start + count):
        writer.append(*cycle(row, truth=truth))


def paced(parent: Path, *, realtime: bool) -> None:
    """Append at 1 kHz for ever, telling each row after it was appended."""
    writer = RunWriter.create(parent, {}, realtime=realtime)
    begin = time.monotonic()
    for row in range(1_000_000):
        writer.append(*cycle(row))
        os.write(1, b"%d\n" % row)
        if row == 100:
            writer.event(row / RATE, "touchdown")
        time.sleep(max(0.0, begin + row / RATE - time.monotonic()))


def logged(parent: Path, *, realtime: bool) -> None:
    """Write lines for ever, telling each after it was written, and no row."""
    log = RunWriter.create(parent, {}, realtime=realtime).log("lines.log")
    for number in range(10_000_000):
        log.write(b"%d\n" % number)
        os.write(1, b"%d\n" % number)
        time.sleep(1e-4)


def starved(parent: Path, *, realtime: bool) -> None:
    """Append until no file may grow any more, then close as a control loop would."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, resource.RLIM_INFINITY))
    until_full(RunWriter.create(parent, {}, realtime=realtime))


def until_full(writer: RunWriter) -> None:
    row = 0
    try:
        while row < 100_000:
            writer.append(*cycle(row))
            row += 1
            time.sleep(0.0)
    except RecordingError as error:
        os.write(1, f"{row}\n{error}\n".encode())
        writer.close("fault", "recording")


if __name__ == "__main__":
    program = {"paced": paced, "starved": starved, "logged": logged}[sys.argv[1]]
    program(Path(sys.argv[2]), realtime=sys.argv[3] == "process")

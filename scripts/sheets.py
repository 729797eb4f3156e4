"""Try the data sheets of a folder: learn, check, configure, three runs, ^C, a master that dies.

python scripts/sheets.py FOLDER

Drives that wear the sheet are emulated, in virtual time; the bus file is the proposed one, as it
is. Vendors' data sheets belong to their makers and are no part of this project.
"""

import argparse
import json
import math
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from legbench.commissioning.configure import write
from legbench.commissioning.learn import check, learn, write_bus
from legbench.drives.emulated.behaviour import Behaviour
from legbench.drives.emulated.build import emulate
from legbench.drives.emulated.bus import LockstepBus
from legbench.drives.emulated.network import Network
from legbench.drives.master.session import Session
from legbench.drives.protocol.cia402 import DriveState
from legbench.drives.setup.bus_file import load_bus
from legbench.drives.setup.config import BusConfig
from legbench.errors import LegbenchError
from legbench.limits.safety import SafetyLimits

ROOT = Path(__file__).parents[1]
START = (-0.3, 0.3)
SPEED = 5.0
"""Speed of both motors when their master dies [rad/s]."""
MS, ENABLED = 1_000_000, DriveState.OPERATION_ENABLED
FOREVER = 1 << 40
"""Cycles without SYNC or target that a drive bears here, so that only its watches stop it."""


def run(bus: Path, controller: str, *, interrupt: bool = False) -> str:
    """Run three seconds of a controller, or an hour up to ^C; how it ended."""
    runs = bus.parent / f"{controller}-{interrupt}"
    command = [sys.executable, "-m", "legbench", "run", controller, "--plant", "can", "--bus"]
    command += [str(bus), "--interface", "legbench", "--out", str(runs)]
    command += ["--duration", "3600" if interrupt else "3"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    if interrupt:
        _await_rows(runs, process)
        process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=600)
    if not runs.exists():
        # The controller needs what these drives do not tell.
        return f"refused (exit {process.returncode}): {errors.decode().splitlines()[-1]}"
    (folder,) = runs.iterdir()
    ending = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    status = ending.get("status") or ending.get("ending", {}).get("status")
    told = sum(b"not protected" in line or b"without " in line for line in errors.splitlines())
    return f"{status} (exit {process.returncode}, {told} lines of what does not protect)"


def _await_rows(runs: Path, process: subprocess.Popen[bytes]) -> None:
    """Wait until a run has begun."""
    for _ in range(3000):
        if process.poll() is not None or list(runs.glob("*/samples*")):
            break
        time.sleep(0.1)
    time.sleep(2.0)


def death(config: BusConfig) -> str:
    """Let the master die while both motors move; how long the drives need to stand."""
    behaviours = [
        Behaviour(start_pos=pos, missing_limit=FOREVER, sync_loss_periods=FOREVER) for pos in START
    ]
    network = emulate(config, behaviours)
    limits = SafetyLimits(command_speed=SPEED, following_error=0.3, lost_frames=20)
    with Session(LockstepBus("death", network=network), config) as session:
        link = session.link(limits, (4.0, 5.0))
        link.open()
        link.start()
        hip, knee = START
        for _ in range(40):
            hip, knee = hip + 1e-3 * SPEED, knee - 1e-3 * SPEED
            link.command((hip, knee))
            link.exchange()
        stood_ms = _stood_ms(network)
    if math.isinf(stood_ms):
        return "a drive is enabled or moves for a second and longer: it lacks what stops it"
    return f"no drive is enabled and none moves after {stood_ms:.0f} ms"


def _stood_ms(network: Network) -> float:
    began, before = network.now_ns, [drive.axis.motion.angle for drive in network.drives]
    for _ in range(1000):
        network.advance(network.now_ns + MS)
        now = [drive.axis.motion.angle for drive in network.drives]
        enabled = any(drive.axis.power.state is ENABLED for drive in network.drives)
        if now == before and not enabled:
            return (network.now_ns - began) / MS
        before = now
    return math.inf


def trial(eds: Path, folder: Path) -> dict[str, str]:
    """Try one data sheet; what came of each step."""
    bus = folder / "leg.toml"
    shutil.copy(ROOT / "hardware" / "limits.toml", folder / "limits.toml")
    learned = learn(eds, bus)
    if learned.problems:
        return {"learn": learned.problems[0]}
    write_bus(learned, bus)
    config = load_bus(bus)
    with Session(LockstepBus("it", network=emulate(config)), config) as session:
        written = write(session)
    return {
        "learn": f"{len(learned.to_measure)} lines to measure, waives {list(config.waive)}",
        "check": f"{len(check(bus).problems)} problems",
        "configure": f"{written.objects} objects hold",
        "not protected": "".join(f"\n    {line}" for line in written.lines),
        "jump": run(bus, "jump"),
        "bang-bang": run(bus, "bang-bang"),
        "position-jump": run(bus, "position-jump"),
        "^C": run(bus, "position-jump", interrupt=True),
        "master dies": death(config),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Try all; 1 if one cannot be used."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    chosen = parser.parse_args(arguments)
    failed = 0
    for eds in sorted(path for path in chosen.folder.iterdir() if path.suffix in (".eds", ".dcf")):
        print(eds.name, flush=True)
        with tempfile.TemporaryDirectory() as folder:
            try:
                found = trial(eds, Path(folder))
            except LegbenchError as error:
                found = {"refused": str(error)}
        failed += "jump" not in found
        for step, text in found.items():
            print(f"  {step:<14}{text}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

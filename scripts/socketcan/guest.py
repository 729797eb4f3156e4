"""A Linux guest with SocketCAN, for machines whose own kernel has none.

    python scripts/socketcan/guest.py 'ip link add dev vcan0 type vcan && ip link'

boots Debian's kernel in QEMU and runs a shell command among this machine's files, which stay as
they are; what it writes is gone in the end. Its exit status is passed on, 3 says that there was no
guest. Time in the guest is virtual: instructions make it pass, and whoever waits skips ahead. How
busy this machine is makes no difference to what happens inside.
"""

import argparse
import gzip
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from threading import Timer

ROOT = Path(__file__).parents[2]
CACHE = ROOT / ".cache" / "socketcan"
PACKAGES = {
    "qemu-system-x86_64": "qemu-system-x86",
    "cpio": "cpio",
    "ip": "iproute2",
    "apt-get": "apt",
    "dpkg-deb": "dpkg",
}
"""Programs, and Debian's packages that bring them."""
KERNEL = "linux-image-amd64"
MODULES = ("virtio_mmio", "9pnet_virtio", "9p", "overlay", "can-raw", "vcan", "sch_netem")
INSTRUCTIONS = 8
"""Of the guest's processor in a nanosecond of its time; Python on a fast machine does 10 to 15."""
END = "guest ended with "
"""What `init` prints before the exit status."""


class GuestError(Exception):
    """The guest cannot be made or does not come up."""


def check_programs() -> None:
    """Raise GuestError with what to install."""
    missing = sorted({package for name, package in PACKAGES.items() if shutil.which(name) is None})
    if missing:
        raise GuestError(
            f"needs {', '.join(missing)}, on Debian: apt-get update && apt-get install "
            f"{' '.join(missing)}"
        )


def run(*command: str, cwd: Path) -> str:
    """What a program prints; raises GuestError with what it complains of."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        raise GuestError(f"{' '.join(command)}: {done.stderr.strip()}")
    return done.stdout


def fetch() -> Path:
    """Kernel and busybox, unpacked in the cache, never installed."""
    files = CACHE / "files"
    if files.exists():
        return files
    CACHE.mkdir(parents=True, exist_ok=True)
    depends = run("apt-cache", "depends", KERNEL, cwd=CACHE)
    images = [line.split()[-1] for line in depends.splitlines() if "Depends: linux-image" in line]
    if not images:
        raise GuestError(f"apt knows no {KERNEL}; say apt-get update")
    with tempfile.TemporaryDirectory(dir=CACHE) as folder:
        print(f"fetching {images[0]}", flush=True)
        run("apt-get", "download", images[0], "busybox-static", cwd=Path(folder))
        for package in Path(folder).glob("*.deb"):
            run("dpkg-deb", "--extract", str(package), "unpacked", cwd=Path(folder))
        (Path(folder) / "unpacked").rename(files)
    return files


def module_order(folder: Path) -> list[Path]:
    """Modules in the order in which they can be loaded."""
    files = {path.stem.replace("-", "_"): path for path in folder.rglob("*.ko")}
    order: list[Path] = []

    def add(name: str) -> None:
        path = files.get(name.replace("-", "_"))
        if path is None or path in order:
            return
        words = path.read_bytes().split(b"\0depends=", 1)[1].split(b"\0", 1)[0].decode()
        for needed in filter(None, words.split(",")):
            add(needed)
        order.append(path)

    for name in MODULES:
        if name.replace("-", "_") not in files:
            raise GuestError(f"{KERNEL} has no module {name}")
        add(name)
    return order


def pack(files: Path, folder: Path, command: str) -> Path:
    """The first file system: busybox, modules, what to do."""
    root = folder / "root"
    for name in ("bin", "proc", "sys", "dev", "modules"):
        (root / name).mkdir(parents=True)
    shutil.copy(files / "bin" / "busybox", root / "bin")
    order = module_order(files / "lib" / "modules")
    for path in order:
        shutil.copy(path, root / "modules")
    (root / "modules" / "order").write_text("".join(f"{path.name}\n" for path in order))
    (root / "command").write_text(command)
    shutil.copy(Path(__file__).with_name("init"), root)
    (root / "init").chmod(0o755)
    names = "\n".join(str(path.relative_to(root)) for path in root.rglob("*"))
    packed = subprocess.run(
        ["cpio", "--create", "--format=newc", "--quiet"],
        input=names.encode(),
        cwd=root,
        capture_output=True,
        check=True,
    )
    image = folder / "initramfs.gz"
    image.write_bytes(gzip.compress(packed.stdout, 1))
    return image


def machine(kernel: Path, image: Path, instructions: int) -> list[str]:
    """QEMU's command line.

    A processor that QEMU counts for makes one instruction a nanosecond, which Python finds slow.
    So the guest is told that its time stamp counter, which counts instructions, has a higher rate.
    With no other timer and no PM timer on the machine it believes that, and calibrates the
    processor's own timer by it: clock and timers agree, and there is time for more instructions.
    """
    kernel_line = (
        "console=ttyS0 quiet panic=-1 pci=off mitigations=off "
        f"tsc=reliable tsc_early_khz={1_000_000 * instructions}"
    )
    return [
        *("qemu-system-x86_64", "-machine", "microvm,pit=off,pic=off,rtc=on"),
        *("-accel", "tcg,thread=single", "-icount", "shift=0,sleep=off"),
        *("-cpu", "max,erms=off,fsrm=off", "-smp", "1", "-m", "3072"),
        *("-nodefaults", "-no-user-config", "-no-reboot", "-display", "none"),
        *("-serial", "stdio", "-monitor", "none"),
        *("-kernel", str(kernel), "-initrd", str(image), "-append", kernel_line),
        *("-fsdev", "local,id=host,path=/,security_model=none,readonly=on,multidevs=remap"),
        *("-device", "virtio-9p-device,fsdev=host,mount_tag=host"),
    ]


def boot(command: str, timeout: float, instructions: int) -> int:
    """Run a command in the guest; its exit status.

    Raises:
        GuestError: it cannot be made, or has not come to its end.
    """
    check_programs()
    files = fetch()
    kernel = next((files / "boot").glob("vmlinuz-*"))
    with tempfile.TemporaryDirectory(dir=CACHE) as folder:
        image = pack(files, Path(folder), command)
        status = watched(machine(kernel, image, instructions), timeout)
    if status is None:
        raise GuestError(
            f"the guest has not come to its end, for which it has {timeout:g} s; see --timeout"
        )
    return status


def watched(arguments: list[str], timeout: float) -> int | None:
    """Show what the guest prints; what it says that its command ended with."""
    status = None
    with subprocess.Popen(
        arguments,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    ) as guest:
        assert guest.stdout is not None
        patience = Timer(timeout, guest.kill)
        patience.start()
        try:
            for line in guest.stdout:
                before, mark, code = line.rstrip().partition(END)
                if mark:
                    status = int(code)
                elif before:
                    print(before, flush=True)
        finally:
            patience.cancel()
            guest.kill()
    return status


def main() -> int:
    """Boot and run."""
    parser = argparse.ArgumentParser(description="A Linux guest with SocketCAN.")
    parser.add_argument("command", help="for the guest's shell")
    parser.add_argument("--timeout", type=float, default=7200.0, help="of this machine [s]")
    parser.add_argument("--instructions", type=int, default=INSTRUCTIONS, help="in a ns")
    chosen = parser.parse_args()
    try:
        return boot(chosen.command, chosen.timeout, chosen.instructions)
    except GuestError as error:
        print(f"socketcan: {error}", file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())

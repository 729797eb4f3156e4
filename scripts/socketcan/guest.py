"""A Linux guest with SocketCAN, for machines whose own kernel has none.

    python scripts/socketcan/guest.py 'ip link show'

boots Debian's kernel in QEMU, runs a shell command among this machine's files, which stay as they
are, and ends with its exit status. Time in the guest is virtual: its processor takes 1 ns for a
fixed number of instructions, and a guest that waits skips ahead. How busy this machine is makes no
difference to anything that happens inside.
"""

import argparse
import gzip
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

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
MODULES = ("virtio_mmio", "9pnet_virtio", "9p", "overlay", "can-raw", "vcan")
INSTRUCTIONS = 8
"""Of the guest's processor in a nanosecond of its time."""


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
        add(name)
    return order


def pack(files: Path, command: str) -> Path:
    """The first file system: busybox, modules, what to do."""
    image = CACHE / "initramfs.gz"
    with tempfile.TemporaryDirectory(dir=CACHE) as folder:
        root = Path(folder)
        for name in ("bin", "proc", "sys", "dev", "modules"):
            (root / name).mkdir()
        shutil.copy(files / "bin" / "busybox", root / "bin" / "busybox")
        order = module_order(files / "lib" / "modules")
        for path in order:
            shutil.copy(path, root / "modules" / path.name)
        (root / "modules" / "order").write_text("".join(f"{path.name}\n" for path in order))
        (root / "command").write_text(command)
        shutil.copy(Path(__file__).with_name("init"), root / "init")
        (root / "init").chmod(0o755)
        names = "\n".join(str(path.relative_to(root)) for path in [root, *root.rglob("*")])
        packed = subprocess.run(
            ["cpio", "--create", "--format=newc", "--quiet"],
            input=names.encode(),
            cwd=root,
            capture_output=True,
            check=True,
        )
    image.write_bytes(gzip.compress(packed.stdout, 1))
    return image


def boot(command: str, timeout: float, instructions: int) -> int:
    """Run a command in the guest; its exit status."""
    check_programs()
    files = fetch()
    kernel = next((files / "boot").glob("vmlinuz-*"))
    # No timer but the processor's own: both it and the clock are told by tsc_early_khz how many
    # instructions, which QEMU counts, make a second.
    arguments = [
        *("qemu-system-x86_64", "-machine", "microvm,pit=off,pic=off,rtc=on"),
        *("-accel", "tcg,thread=single", "-icount", "shift=0,sleep=off", "-cpu", "max"),
        *("-smp", "1", "-m", "2048", "-nodefaults", "-no-user-config", "-no-reboot"),
        *("-display", "none", "-serial", "stdio", "-monitor", "none"),
        *("-kernel", str(kernel), "-initrd", str(pack(files, command))),
        *("-append", f"console=ttyS0 quiet mitigations=off panic=-1 tsc=reliable tsc_early_khz={1_000_000 * instructions}"),
        *("-fsdev", "local,id=host,path=/,security_model=none,readonly=on,multidevs=remap"),
        *("-device", "virtio-9p-device,fsdev=host,mount_tag=host"),
    ]
    status = None
    with subprocess.Popen(
        ["timeout", f"{timeout:g}", *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as guest:
        assert guest.stdout is not None
        for line in guest.stdout:
            words = line.rstrip().split("guest ended with ")
            if len(words) == 2:
                status = int(words[1])
            else:
                print(line.rstrip(), flush=True)
    if status is None:
        raise GuestError(f"the guest has not come to its end within {timeout:g} s")
    return status


def main() -> int:
    """Boot and run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("command")
    parser.add_argument("--timeout", type=float, default=900.0, help="[s]")
    parser.add_argument("--instructions", type=int, default=INSTRUCTIONS)
    chosen = parser.parse_args()
    try:
        return boot(chosen.command, chosen.timeout, chosen.instructions)
    except GuestError as error:
        print(f"socketcan: {error}", file=sys.stderr)
        return 3


if __name__ == "__main__":
    sys.exit(main())

"""Run the tests in as many processes as there are processors, a share of the files in each.

python scripts/run_tests.py -m 'not long'

Each process imports and collects its own files only, which costs less processor time than workers
that all collect everything. What it says is printed in one piece when it ends; meanwhile its
progress is shown line by line.
"""

import os
import subprocess
import sys
import threading
from collections.abc import Sequence

PROGRESS = "%]\n"
"""End of a line of pytest that shows progress."""
NO_TESTS = 5
"""Status of pytest for a share without a test, which is none of the whole."""


def main(words: Sequence[str]) -> int:
    """Run all shares with these words for pytest; returns the first status that is not zero."""
    count = len(os.sched_getaffinity(0))
    color = "yes" if sys.stdout.isatty() else "auto"
    command = [sys.executable, "-m", "pytest", f"--color={color}", *words]
    processes = [
        subprocess.Popen([*command, f"--part={number}/{count}"], stdout=subprocess.PIPE, text=True)
        for number in range(1, count + 1)
    ]
    printing = threading.Lock()
    readers = [threading.Thread(target=show, args=(each, printing)) for each in processes]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()
    statuses = [process.wait() for process in processes]
    if all(status == NO_TESTS for status in statuses):
        return NO_TESTS
    return next((status for status in statuses if status not in (0, NO_TESTS)), 0)


def show(process: "subprocess.Popen[str]", printing: threading.Lock) -> None:
    """Print progress as it comes, and all else once the process has ended."""
    assert process.stdout is not None
    held = []
    for line in process.stdout:
        if line.endswith(PROGRESS):
            with printing:
                print(line, end="", flush=True)
        else:
            held.append(line)
    with printing:
        print("".join(held), end="", flush=True)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)

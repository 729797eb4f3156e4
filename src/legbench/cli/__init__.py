"""The command line: wiring only. A command's module is imported when it is called."""

import errno
import os
import select
import sys
from importlib import import_module

from legbench import __version__
from legbench.cli.output import WRONG_USAGE, report_error
from legbench.errors import ConfigError, DesignError, LegbenchError, UnwritableError

COMMANDS = {
    "run": "run a controller on a leg and record it",
    "replay": "rate and show a recorded run again",
    "recover": "repair a run that was cut off",
    "compare": "put recorded runs side by side, aligned by event",
    "runs": "list, filter and sort recorded runs",
    "export": "write a recorded run as CSV, Parquet, MAT or MCAP",
    "model": "write or view the MuJoCo model of a design",
    "render": "make a video or a picture of a recorded run",
    "design": "find a leg that meets requirements and modal matching",
    "check": "check a leg against the conditions of modal matching",
    "modes": "linear and nonlinear modes of a leg",
    "explain": "find which imperfections explain measured ratings",
    "hop": "apex return map, periodic hops and basin of a leg",
    "campaign": "run a grid of experiments, and make one table of it",
    "report": "a campaign beside the paper, on one page and in figures",
    "identify": "parameters of a leg from recorded runs",
    "drives": "commission the servo drives, or emulate them",
}
"""Command -> one line of help; the module is `legbench.cli.<command>` with `main(arguments)`."""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of a standard output that takes nothing more; those of files name their file."""

USAGE = """usage: legbench COMMAND [options]

A testbed for segmented legs whose natural motion is a pure radial oscillation.

{commands}

`legbench COMMAND --help` tells the options of a command, with units.
"""


def usage() -> str:
    """Text of `legbench --help`."""
    lines = [f"  {name:<10} {text}" for name, text in COMMANDS.items()]
    return USAGE.format(commands="\n".join(lines))


def main(arguments: list[str] | None = None) -> int:
    """Run a command; 0 when all went well, 2 when it was refused as it was asked, 1 otherwise.

    Words, values and files that a command cannot take are refused before anything is done. What
    fails later, or is answered by no, ends with 1: a fault, a full disk, a leg that violates.

    Every `LegbenchError` becomes one line on stderr, never a traceback; so does ^C outside of a
    run, with 130. Nobody reading any more, as under `head`, ends it with 141 and no word.
    """
    _occupy_standard_streams()
    try:
        status = _run(arguments)
        if sys.stdout is not None:  # as under a service manager that gives none
            sys.stdout.flush()
        return status
    except BrokenPipeError:
        if not _reader_left():
            raise
        return 141
    except OSError as error:
        if error.errno not in FULL or error.filename is not None:
            raise
        _drop_output()
        report_error(f"the output cannot be written: {error.strerror}; make room, or send it on")
        return 1


def _occupy_standard_streams() -> None:
    """Open /dev/null for standard streams that are closed, as after `2>&-`.

    Otherwise the next file that is opened, such as a recording, would take the number of stderr,
    and libraries would write their warnings into it.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(descriptor)


def _reader_left() -> bool:
    """Whether the reader of our output has gone; what is still to be flushed is dropped then."""
    output = sys.stdout.fileno()
    if "poll" in vars(select):  # elsewhere nothing but stdout is a pipe
        watch = select.poll()
        watch.register(output, 0)
        if not any(happened & select.POLLERR for _, happened in watch.poll(0)):
            return False
    _drop_output()
    return True


def _drop_output() -> None:
    """Let /dev/null take what is still to be flushed."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(arguments: list[str] | None) -> int:
    arguments = sys.argv[1:] if arguments is None else arguments
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(usage(), end="")
        return 0 if arguments else WRONG_USAGE
    name, rest = arguments[0], arguments[1:]
    if name == "--version":
        print(f"legbench {__version__}")
        return 0
    if name not in COMMANDS:
        report_error(f"no command '{name}'; there are {', '.join(COMMANDS)}")
        return WRONG_USAGE
    try:
        return import_module(f"legbench.cli.{name}").main(rest)
    except LegbenchError as error:
        report_error("; ".join([str(error), *_notes(error)]))
        refused = isinstance(error, ConfigError | DesignError)
        return WRONG_USAGE if refused and not isinstance(error, UnwritableError) else 1
    except KeyboardInterrupt as error:
        report_error("; ".join(["interrupted", *_notes(error)]))
        return 130


def _notes(error: BaseException) -> list[str]:
    """Notes that were added to an exception, such as drives that keep their power."""
    return getattr(error, "__notes__", [])

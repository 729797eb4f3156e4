"""Random disturbed hops of random legs on the compiled leg against a batched DOP853.

    python scripts/check_hops.py [--count 100000] [--seed 0] [--tolerance 1e-9] [--out FILE]

Every four hops are of a random leg with random settings, and every hop has a random start; leg and
start depend on the number of the hop alone. Results are appended to a file block by block, and the
same command continues where an earlier one was stopped. Exit status 1 if an event is missed,
doubled or false, or an error is above 1e-5 of the map's units, unless hops beside that one, by the
reference alone, differ as much: that hop grazes a condition, which is named.
"""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "tests" / "modes"))

from random_hops import (  # pyright: ignore[reportMissingImports]
    random_case,
    thrown,
    told,
    tools_of,
)
from reference.verdicts import judge

BOUND, MEDIAN = 1e-5, 1e-7
"""Largest error, and its median, in units of the map [-]."""
BLOCK = 4000
"""Hops that are integrated together, and written together [-]."""
STARTS = 4
"""Hops of each random leg [-]."""


def block_of(first: int, count: int, tolerance: float) -> dict[str, Any]:
    """Results of consecutive seeds, as they are written."""
    seeds, cases, stories = [], [], []
    case = tools = None
    for seed in range(first, first + count):
        if case is None or seed % STARTS == 0:
            case = random_case(np.random.default_rng(seed - seed % STARTS))
            tools = tools_of(case, tolerance)
        case = thrown(case, np.random.default_rng((1, seed)))
        story = told(tools, case, mapped=seed % STARTS == 0)
        if story is not None:
            seeds.append(seed)
            cases.append(case)
            stories.append(story)
    errors, remarks = [], []
    for seed, verdict in zip(seeds, judge(cases, stories), strict=True):
        if not verdict.fault:
            errors.append(float(f"{verdict.error:.3e}"))
        if verdict.fault or verdict.error > BOUND:
            mine, other = verdict.stories
            remarks.append(
                {
                    "seed": seed,
                    "fault": verdict.fault or "error",
                    "error": verdict.error if not verdict.fault else None,
                    "grazes": verdict.grazes,
                    "compiled": [mine.events, mine.ending, mine.apex],
                    "reference": [other.events, other.ending, other.apex],
                }
            )
    endings: dict[str, int] = {}
    for story in stories:
        endings[story.ending] = endings.get(story.ending, 0) + 1
    return {
        "first": first,
        "count": count,
        "hops": len(cases),
        "events": sum(len(story.events) for story in stories),
        "endings": endings,
        "errors": errors,
        "remarks": remarks,
    }


def show(remark: dict[str, Any]) -> None:
    """Print one line about a hop that differs, and its stories if nothing excuses it."""
    what = f"grazes ({remark['grazes']})" if remark["grazes"] else "WRONG"
    error = "" if remark["error"] is None else f" {remark['error']:.1e}"
    print(f"seed {remark['seed']}: {remark['fault']}{error}, {what}", flush=True)
    if not remark["grazes"]:
        print(f"  compiled  {remark['compiled']}\n  reference {remark['reference']}", flush=True)


def summary(blocks: list[dict[str, Any]]) -> int:
    """Print the totals; return the exit status."""
    remarks = [remark for block in blocks for remark in block["remarks"]]
    wrong = [remark for remark in remarks if not remark["grazes"]]
    errors = np.array([error for block in blocks for error in block["errors"]])
    clear = errors[errors <= BOUND]
    endings: dict[str, int] = {}
    for block in blocks:
        for name, count in block["endings"].items():
            endings[name] = endings.get(name, 0) + count
    kinds = {
        kind: sum(remark["fault"] == kind for remark in wrong)
        for kind in ("missed", "doubled", "false", "late", "ending", "error")
    }
    hops, events = (sum(block[name] for block in blocks) for name in ("hops", "events"))
    median = float(np.median(errors))
    print(
        f"{hops} hops with {events} events, {endings} "
        f"({sum(block['count'] for block in blocks) - hops} could not begin)\n"
        f"wrong: {', '.join(f'{count} {kind}' for kind, count in kinds.items())}\n"
        f"{len(remarks) - len(wrong)} graze; error: median {median:.1e}, "
        f"99.9 % below {np.quantile(errors, 0.999):.1e}, largest {np.max(clear, initial=0.0):.1e} "
        "where nothing is grazed"
    )
    return int(bool(wrong) or median > MEDIAN)


def main() -> int:
    """Print a line for each hop that differs, and a summary."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=100_000, help="number of hops [-]")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first hop [-]")
    parser.add_argument(
        "--tolerance", type=float, default=1e-9, help="tolerance of the compiled leg [-]"
    )
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after [s]")
    parser.add_argument("--out", type=Path, help="file of results, which is continued")
    flags = parser.parse_args()
    head = {"seed": flags.seed, "tolerance": flags.tolerance, "block": BLOCK}
    blocks = finished(flags.out, head) if flags.out else []
    done, began = sum(block["count"] for block in blocks), time.monotonic()
    for block in blocks:
        for remark in block["remarks"]:
            show(remark)
    before = done
    while done < flags.count and time.monotonic() - began < flags.seconds:
        block = block_of(flags.seed + done, min(BLOCK, flags.count - done), flags.tolerance)
        blocks.append(block)
        if flags.out:
            with flags.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(block) + "\n")
        done += block["count"]
        for remark in block["remarks"]:
            show(remark)
        left = (time.monotonic() - began) / (done - before) * (flags.count - done) / 60.0
        print(f"{done} of {flags.count} hops, {left:.0f} min left", file=sys.stderr, flush=True)
    return summary(blocks)


def finished(path: Path, head: dict[str, Any]) -> list[dict[str, Any]]:
    """Blocks that an earlier run has written; a last line that was cut off is dropped."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
    whole = [json.loads(line) for line in lines if line.endswith("\n")]
    if whole and whole[0] != head:
        raise SystemExit(f"{path} holds hops of {whole[0]}, not of {head}; give another file")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(json.dumps(line) + "\n" for line in whole or [head]), "utf-8")
    return whole[1:]


if __name__ == "__main__":
    raise SystemExit(main())

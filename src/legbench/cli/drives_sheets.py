"""`legbench drives learn|check`: data sheets of drives against bus files; opens no bus."""

from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from tyro.conf import Positional, UseAppendAction

from legbench.cli.drives_reading import BenchFlags
from legbench.cli.output import note, print_json, report_error
from legbench.cli.waived import note_waived
from legbench.plant.can_choice import LIMITS_NAME
from legbench.shipped import locate

if TYPE_CHECKING:
    from legbench.commissioning.learn import Learned
    from legbench.drives.sheet.assess import Finding


@dataclass(frozen=True, slots=True, kw_only=True)
class Learn:
    """Read a vendor's data sheet (EDS or DCF), say what the drive lacks, and propose a bus file."""

    eds: Positional[Path]
    """Data sheet of the drives."""
    out: Path
    """Bus file to write; one that is there already is left as it is."""
    node: UseAppendAction[tuple[int, ...]] = ()
    """Node id of a drive, once for each, in the order of the joints; 1 and 2 if none is given."""
    link: str | None = None
    """Object that shows the position of the link, such as "60E4:01 i32", or none for a drive with
    one encoder; else the likeliest."""

    def run(self, bench: BenchFlags) -> int:
        """Print what is there, fixed or missing; 1 if the drives cannot be used."""
        from legbench.commissioning.learn import learn, write_bus
        from legbench.drives.setup.bus_file import parse_object
        from legbench.drives.sheet.propose import ONE_ENCODER

        link = self.link if self.link in (None, ONE_ENCODER) else parse_object(self.link)
        learned = learn(self.eds, self.out, self.node, link)
        if not learned.problems:
            write_bus(learned, self.out)
            note_waived(self.out, None)
        _print(learned, as_json=bench.json, out=self.out)
        return _ended(learned)


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """Hold a bus file against the data sheets of its drives, before anything is powered."""

    eds: Path | None = None
    """Data sheet of all drives; by default those that the bus file names."""

    def run(self, bench: BenchFlags) -> int:
        """Print what is there, fixed or missing; 1 if the drives cannot be used."""
        from legbench.commissioning.learn import check
        from legbench.drives.setup.exchange import check_budget

        bus = locate(bench.bus)
        learned = check(bus, self.eds)
        note_waived(bus, None)
        _print(learned, as_json=bench.json, out=None)
        check_budget(bench.config().at(bench.bitrate))
        return _ended(learned)


def _ended(learned: "Learned") -> int:
    """Report why drives cannot be used, a line each; 1 if there is one."""
    for problem in learned.problems:
        report_error(problem)
    return 1 if learned.problems else 0


def _print(learned: "Learned", *, as_json: bool, out: Path | None) -> None:
    if as_json:
        print_json(_as_json(learned, out))
        return
    told: dict[tuple[str, tuple[Finding, ...]], list[str]] = {}
    for one in learned.assessments:
        told.setdefault((learned.sheets[one.node].name, one.findings), []).append(one.node)
    for one in learned.assessments:
        names = told.pop((learned.sheets[one.node].name, one.findings), None)
        if names is None:
            continue  # Drives of one kind are described once.
        sheet = learned.sheets[one.node]
        print(
            f"{', '.join(names)}: {sheet.product_name or sheet.name} of "
            f"{sheet.vendor_name or '?'}, {len(sheet.objects)} objects"
        )
        for remark in sheet.remarks:
            print(f"  {remark}")
        counts = Counter(finding.state.value for finding in one.findings)
        print("  " + ", ".join(f"{state} {count}" for state, count in sorted(counts.items())))
        print(_listed("has", one.findings))
        for finding in one.findings:
            if finding.state.value != "has" or finding.remark:
                remark = f": {finding.remark}" if finding.remark else ""
                print(f"  {finding.need:<10} {finding.state.value:<5} {finding.object}{remark}")
        times = [f"{means.time_ms:.0f} ms by {means.name}" for means in one.means]
        reacts = f"it reacts after {' or '.join(times)}" if times else "no reaction of it is known"
        print(f"  without master {reacts}")
    if out is not None and not learned.problems:
        note(f"wrote {out}")
        if not (out.parent / LIMITS_NAME).exists():
            note(
                f"a run also needs limits: copy hardware/{LIMITS_NAME} beside it, or give --limits"
            )
    if learned.to_measure and not (out is not None and learned.problems):
        note(
            f"{len(learned.to_measure)} lines of the bus file are still to be measured; each says "
            "MEASURE"
        )


def _listed(state: str, findings: "tuple[Finding, ...]") -> str:
    """Objects in a state, without their names, in lines as long as a page is wide."""
    known = [one.object.split(" ")[0] for one in findings if one.state.value == state]
    return fill(", ".join(known), 100, initial_indent=f"  {state} ", subsequent_indent="      ")


def _as_json(learned: "Learned", out: Path | None) -> dict[str, Any]:
    return {
        "out": None if out is None or learned.problems else str(out),
        "problems": list(learned.problems),
        "to_measure": list(learned.to_measure),
        "nodes": [
            {
                "name": one.node,
                "eds": learned.sheets[one.node].name,
                "vendor": learned.sheets[one.node].vendor,
                "product": learned.sheets[one.node].product,
                "remarks": list(learned.sheets[one.node].remarks),
                "needs": [
                    asdict(finding) | {"state": finding.state.value} for finding in one.findings
                ],
                "not_protected": list(one.unprotected),
                "master_watch": [asdict(means) for means in one.means],
            }
            for one in learned.assessments
        ],
    }

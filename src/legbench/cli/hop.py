"""`legbench hop`: the apex return map of a leg, its periodic hops, their families and basin."""

from legbench.cli.hop_arguments import HopArguments
from legbench.cli.output import note, print_json, results_in, write_json
from legbench.cli.parse import parse
from legbench.design import load_design


def main(arguments: list[str]) -> int:
    """Run `legbench hop`."""
    flags = parse(HopArguments, "hop", arguments)
    from legbench.cli.hop_checks import check

    check(flags)
    design = load_design(flags.design)
    with results_in(flags.out):
        if flags.passive:
            from legbench.cli.hop_passive import answer

            content, lines = answer(design, flags.rest)
        else:
            from legbench.cli.hop_driven import answer as driven

            content, lines = driven(flags, design)
        if flags.json:
            print_json(content | {"out": flags.out and str(flags.out)})
        else:
            print("\n".join(lines))
        if flags.out is not None:
            write_json(flags.out / "hop.json", content)
            note(f"wrote {flags.out / 'hop.json'}")
    # Who asks for a map and gets none is told so by the status, too.
    return int(flags.basin > 0 and "basin" not in content)

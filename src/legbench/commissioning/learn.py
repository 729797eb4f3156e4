"""Learning a drive from its data sheet, and holding a bus file against it; no drive is asked."""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from legbench.drives.errors import DriveError
from legbench.drives.protocol.pdo import Mapped
from legbench.drives.setup.bus_file import bus_from_mapping, load_bus
from legbench.drives.setup.bus_numbers import RUN_PERIODS_US
from legbench.drives.setup.config import BusConfig
from legbench.drives.setup.configuration import quick_stop_ramp
from legbench.drives.setup.exchange import check_budget
from legbench.drives.setup.master_watch import Means, means_of
from legbench.drives.setup.outcome import held_by
from legbench.drives.setup.taken import check_taken
from legbench.drives.sheet.assess import Assessment, assess
from legbench.drives.sheet.bus_text import bus_text, marked_lines, waivers_for
from legbench.drives.sheet.data_sheet import DataSheet
from legbench.drives.sheet.load import load_sheet
from legbench.drives.sheet.predict import predict
from legbench.drives.sheet.propose import Proposal, propose
from legbench.errors import ConfigError
from legbench.reading import LARGEST_TOML, UnreadableError, parse_toml, read_file
from legbench.writing import save_whole

USUAL_NODES = (1, 2)
"""Node ids of a leg's drives, if nobody says otherwise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Learned:
    """What a data sheet says of its drives, as nodes of a bus file."""

    sheets: Mapping[str, DataSheet]
    """Data sheet of every node, by its name."""
    assessments: tuple[Assessment, ...]
    problems: tuple[str, ...]
    """Reasons for which the drives cannot be used as the bus file says, a line each."""
    to_measure: tuple[int, ...]
    """Numbers of the lines of the bus file whose value is still a guess."""
    text: str
    """The bus file."""


def learn(
    eds: Path, out: Path, node_ids: Sequence[int] = (), link: Mapped | str | None = None
) -> Learned:
    """Read a data sheet and propose a bus file for drives of its kind; writes nothing.

    Args:
        eds: the data sheet.
        out: where the bus file is going to be, from which the data sheet is named.
        node_ids: ids of the drives; 1 and 2 by default.
        link: object that shows the position of the link, or `ONE_ENCODER`; by default the likeliest
            one, or none where no object looks like it.

    Raises:
        ConfigError: the file is no data sheet, or its drives cannot be used; the message names the
            object and the way out.
        MissingExtraError: canopen is not installed.
    """
    sheet = load_sheet(eds)
    relative = os.path.relpath(eds.absolute(), out.parent.absolute())
    proposal, ids = propose(sheet, relative, link), tuple(node_ids) or USUAL_NODES
    period_us = _period_us(proposal, ids, out.parent)

    def text_with(waive: Sequence[str]) -> str:
        return bus_text(proposal, ids, waive, period_us=period_us)

    config = _parsed(text_with(waivers_for(proposal, watched=False, braked=False)), out.parent)
    found = [assess(sheet, config, node) for node in config.nodes]
    waive = waivers_for(
        proposal,
        watched=all(one.means for one in found),
        braked=all(
            any(entry.parameter.key == quick_stop_ramp(node) for entry in one.outcomes)
            for node, one in zip(config.nodes, found, strict=True)
        ),
    )
    text = text_with(waive)
    config = _parsed(text, out.parent)
    return _judged(config, {node.name: sheet for node in config.nodes}, text)


def _period_us(proposal: Proposal, ids: Sequence[int], folder: Path) -> int:
    """Return the shortest period in which all frames are exchanged and that the drives take.

    Raises:
        ConfigError: no period is long enough for all frames.
    """
    everything = waivers_for(proposal, watched=False, braked=False)
    carried: list[int] = []
    for period_us in RUN_PERIODS_US:
        text = bus_text(proposal, ids, everything, period_us=period_us)
        config = _parsed(text, folder)
        try:
            check_budget(config)
        except ConfigError:
            if period_us == RUN_PERIODS_US[-1] and not carried:
                raise
            continue
        carried.append(period_us)
        if not any(assess(proposal.sheet, config, node).problems for node in config.nodes):
            return period_us
    return carried[0]


def write_bus(learned: Learned, out: Path) -> None:
    """Write a proposed bus file as a whole.

    Raises:
        ConfigError: there is such a file already, or it cannot be written.
    """
    if out.exists() or out.is_symlink():
        raise ConfigError(f"{out} is there already, and is left as it is; give another --out")
    save_whole(out, learned.text)


def check(bus: Path, eds: Path | None = None) -> Learned:
    """Hold a bus file against data sheets: one for all its nodes, or those that it names.

    Raises:
        ConfigError: a file is missing or makes no sense, or the bus file names no data sheet.
        MissingExtraError: canopen is not installed.
    """
    config = load_bus(bus)
    paths = {node.name: eds or node.eds for node in config.nodes}
    missing = [name for name, path in paths.items() if path is None]
    if missing:
        raise ConfigError(
            f"{bus}: '{missing[0]}' names no data sheet; give --eds, or eds = \"FILE\" in the file"
        )
    known = {path: load_sheet(path) for path in set(paths.values()) if path is not None}
    sheets = {name: known[path] for name, path in paths.items() if path is not None}
    return _judged(config, sheets, read_file(bus, LARGEST_TOML).decode("utf-8"))


def known_means(config: BusConfig, *, speed: float) -> dict[str, tuple[Means, ...]]:
    """Return how every drive notices that its master is gone, by the name of its node.

    A drive whose node names a data sheet has the means that the data sheet leaves it.

    Args:
        config: the bus.
        speed: highest speed of the motors [rad/s].

    Raises:
        ConfigError: a data sheet is missing or is none.
        MissingExtraError: canopen is not installed.
    """
    known = {path: load_sheet(path) for path in {node.eds for node in config.nodes} if path}
    return {
        node.name: means_of(
            config,
            node,
            speed=speed,
            held=None if node.eds is None else held_by(predict(known[node.eds], config, node)),
        )
        for node in config.nodes
    }


def problems_of(config: BusConfig) -> tuple[str, ...]:
    """Return why the drives of data sheets cannot be used as a bus says, a line each.

    Nodes that name no data sheet have no problems.

    Raises:
        ConfigError: a data sheet is missing or is none.
        MissingExtraError: canopen is not installed.
    """
    known = {path: load_sheet(path) for path in {node.eds for node in config.nodes} if path}
    return _together(
        assess(known[node.eds], config, node) for node in config.nodes if node.eds is not None
    )


def _together(assessments: Iterable[Assessment]) -> tuple[str, ...]:
    """Return the problems of all drives, each once, with the names of the nodes that have it."""
    told: dict[str, list[str]] = {}
    for one in assessments:
        for problem in one.problems:
            told.setdefault(problem, []).append(f"'{one.node}'")
    return tuple(f"{', '.join(names)}: {problem}" for problem, names in told.items())


def _parsed(text: str, folder: Path) -> BusConfig:
    """Return the bus of a proposed file; raises ConfigError for ids that make no bus."""
    try:
        return bus_from_mapping(parse_toml(text.encode()), folder)
    except UnreadableError as error:
        raise ConfigError(f"the data sheet makes no bus file: {error}") from None


def _judged(config: BusConfig, sheets: Mapping[str, DataSheet], text: str) -> Learned:
    assessments = tuple(assess(sheets[node.name], config, node) for node in config.nodes)
    problems = list(_together(assessments))
    if not problems:
        try:
            check_taken(config, {one.node: one.outcomes for one in assessments})
        except DriveError as error:
            problems.append(str(error))
    return Learned(
        sheets=sheets,
        assessments=assessments,
        problems=tuple(problems),
        to_measure=marked_lines(text),
        text=text,
    )
